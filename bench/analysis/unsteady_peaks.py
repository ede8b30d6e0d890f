"""Largest drift within one period of a motion that is not steady: its minimum, mean and maximum over the test.

The peak of a cycle of the drive depends on where the cycle begins if the peaks of the motion wander in phase: two of
them may fall into one cycle and none into the next, and a delay of the sensors by 5 ms changed the smallest peak of a
cycle by 5 %. The largest drift within a period that slides over the motion does not.

The drift is smoothed by parabolas, not taken from fits of the cycles: a fit by harmonics of the drive overshoots the
peak, by 10 % if the amplitude changes by half within a few cycles, because the motion then differs at the two ends of
the cycle. The uncertainties are those of the motion that occurred; they do not include how much other cycles differ.
Where cycles are missing, no period spans the gap.

Of N equal peaks with noise, the largest is too large by up to sqrt(2 ln N) standard deviations of the noise, the
smallest too small. Peaks are taken for equal if they differ by less than `NEAR` standard deviations; the bound counts
as a rectangular distribution. The larger of the peaks on both sides within a period is too large for the same reason
(Clark, C. E., 1961, Operations Research 9:145), and so is the mean over the periods. So is the largest sample of one
peak, less the more the peak is curved.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import erfc, hypot, log, sqrt, tau

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bench.analysis.cycles import SHARE, Cycle, mean_amplitude, mean_waves, parabola
from bench.analysis.gain import SteadyPeak
from bench.analysis.peak_readings import PeakReadings
from bench.analysis.signals import ACCELERATION, DRIFT, U1
from sim.attractor import largest_within

Array = NDArray[np.float64]

NEAR = 4.0
"""Largest difference of peaks that are taken for equal, in standard deviations of the noise."""

POSITIONS = 8
"""Positions of the period, for each period, at which the peaks of the mean are described."""

AGAIN = 1.0 / (sqrt(2.0) - 1.0)
"""Excess of the largest of equal values with noise, relative to the further excess if noise of the same size is added
again: equal values with both scatter by sqrt(2) of it.
"""


@dataclass(frozen=True, eq=False)
class UnsteadyPeaks:
    """Largest drift within one period: smallest, mean and largest over all positions of the period in the `used`
    cycles.
    """

    least: SteadyPeak
    mean: SteadyPeak
    greatest: SteadyPeak
    used: tuple[Cycle, ...] = ()


def unsteady_peaks(cycles: Sequence[Cycle], omega: float) -> UnsteadyPeaks:
    """Peaks of consecutive cycles at `omega` [rad/s], relative to the storeys at rest."""
    windows = [_Windows.of(each) for each in uninterrupted(cycles)]
    least = min(windows, key=lambda each: each.largest.min())
    greatest = max(windows, key=lambda each: each.largest.max())
    noise, excess = max(each.noise for each in windows), max(each.excess for each in windows)
    tops = np.concatenate([each.largest[:: each.length] for each in windows])
    sides = np.concatenate([each.sides for each in windows])
    u1 = max(float(cycle.extreme[U1]) for cycle in cycles)
    amplitude = mean_amplitude(cycles, ACCELERATION)
    harmonics = float(mean_waves(cycles).harmonics[ACCELERATION])

    def of(drift: float, readings: PeakReadings, error: float) -> SteadyPeak:
        return SteadyPeak(drift, 0.0, 0.0, u1, amplitude, harmonics, readings, len(cycles), noise=error)

    mean, smallest = float(np.concatenate([each.largest for each in windows]).mean()), float(least.largest.min())
    # the vertex of a parabola, not the largest sample
    largest = max(float(cycle.extreme[DRIFT]) for cycle in cycles)
    seen = np.concatenate([each.seen(each.tops[0]) for each in windows])
    shares = np.concatenate([each.tops[1] for each in windows]) / sum(each.tops[1].sum() for each in windows)
    return UnsteadyPeaks(
        least=of(
            smallest,
            _readings(smallest, least.seen_within(int(least.largest.argmin())), omega),
            hypot(_selected(-tops, noise), excess),
        ),
        mean=of(mean, _mean(mean, seen, shares, omega), hypot(_averaged(sides, noise, len(tops)), excess)),
        greatest=of(
            largest,
            _readings(largest, greatest.seen_within(int(greatest.largest.argmax())), omega),
            _selected(tops, noise),
        ),
        used=tuple(cycles),
    )


@dataclass(frozen=True, eq=False)
class _Windows:
    """`largest` drift [m] within every position of a period, of `length` samples, in a stretch of cycles.

    `smooth` [m], shape (n, 3), are the drift and the readings of both lasers by parabolas fitted around each sample;
    `noise` [m] is the standard uncertainty of the drift due to noise, and `slope` [m] that of its change per sample.
    """

    smooth: Array
    noise: float
    slope: float
    length: int
    largest: Array

    @classmethod
    def of(cls, cycles: Sequence[Cycle]) -> "_Windows":
        traces = np.concatenate([cycle.traces for cycle in cycles]).astype(np.float64)
        length = round(len(traces) / len(cycles))
        smooth, noise, slope = _smoothed(traces, _half(length))
        return cls(smooth, noise, slope, length, largest_within(np.abs(smooth[:, 0]), length))

    @property
    def _spacing(self) -> int:
        """Samples between the positions of the period at which the peaks are described."""
        return max(self.length // POSITIONS, 1)

    @property
    def _positions(self) -> Array:
        """Drift within `POSITIONS` positions of the period for each period, shape (positions, length) [m]."""
        drift = np.ascontiguousarray(self.smooth[:, 0])
        return sliding_window_view(drift, self.length)[:: self._spacing]

    @property
    def sides(self) -> Array:
        """Largest drift on both sides at each position of the period, shape (positions, 2) [m]."""
        within = self._positions
        return np.stack((within.max(axis=1), -within.min(axis=1)), axis=1)

    @cached_property
    def tops(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Samples with the largest drift at the positions of the period, and the number of positions of each."""
        within = np.abs(self._positions)
        return np.unique(self._spacing * np.arange(len(within)) + within.argmax(axis=1), return_counts=True)

    @property
    def excess(self) -> float:
        """Mean of what noise adds to a peak because the sample is the largest one: slope^2 / (2 x curvature) [m]."""
        size, step = np.abs(self.smooth[:, 0]), _half(self.length)
        tops, number = self.tops
        tops = np.clip(tops, step, size.size - 1 - step)
        curvature = (2.0 * size[tops] - size[tops - step] - size[tops + step]) / step**2
        # at an end of a window the drift may not have a peak
        bound = np.maximum(curvature, 0.5 * self.slope**2 / self.noise if self.noise else 1.0)
        return float(np.average(0.5 * self.slope**2 / bound, weights=number))

    def seen_within(self, window: int) -> Array:
        """What is `seen` at the sample with the largest drift at one position of the period, shape (3, 2)."""
        return self.seen(window + np.abs(self.smooth[window : window + self.length, :1]).argmax(axis=0))[0]

    def seen(self, tops: NDArray[np.intp]) -> Array:
        """Readings of both lasers [m] at the samples `tops`, shape (n,), their changes per cycle / (2 pi), and their
        ranges around them, shape (n, 3, 2).
        """
        step = _half(self.length)
        first, last = np.maximum(tops - step, 0), np.minimum(tops + step, len(self.smooth) - 1)
        lasers = self.smooth[:, 1:]
        rates = (lasers[last] - lasers[first]) * (self.length / (tau * (last - first)))[:, None]
        ranges = [np.ptp(lasers[begin : end + 1], axis=0) for begin, end in zip(first, last, strict=True)]
        return np.stack((lasers[tops], rates, np.array(ranges)), axis=1)


def _half(length: int) -> int:
    """Number of samples on each side of a sample to which a parabola is fitted: at least two, so that it has a
    residual.
    """
    return max(length // (2 * SHARE), 2)


def _smoothed(traces: Array, half: int) -> tuple[Array, float, float]:
    """Values of parabolas fitted to `half` samples on both sides of each sample, shape (n, k), and the standard
    uncertainties of the first trace and of its changes per sample due to noise. The values are those of
    `scipy.signal.savgol_filter`, which would be imported while the table is driven.
    """
    matrix = parabola(2 * half + 1)
    middle = np.stack([np.convolve(trace, matrix[0][::-1], mode="valid") for trace in traces.T], axis=1)
    x = np.arange(1, half + 1)[:, None]
    powers = np.concatenate((np.ones_like(x), x, x**2), axis=1)
    first, last = matrix @ traces[: 2 * half + 1], matrix @ traces[-2 * half - 1 :]
    start = (powers * np.array([1.0, -1.0, 1.0]))[::-1] @ first
    smooth = np.concatenate((start, middle, powers @ last))
    residual = float(np.mean((traces[:, 0] - smooth[:, 0]) ** 2))
    leverage = float(matrix[0] @ matrix[0])
    changes = np.diff(matrix[0], prepend=0.0, append=0.0)
    white = residual / (1.0 - leverage)
    return smooth, sqrt(white * leverage), sqrt(white * float(changes @ changes))


def uninterrupted(cycles: Sequence[Cycle]) -> list[list[Cycle]]:
    """Stretches of cycles without a missing cycle."""
    found: list[list[Cycle]] = [[cycles[0]]]
    for cycle in cycles[1:]:
        if cycle.index == found[-1][-1].index + 1:
            found[-1].append(cycle)
        else:
            found.append([cycle])
    return found


def _selected(values: Array, noise: float) -> float:
    """Standard uncertainty of the largest of `values`, shape (n,), each with independent `noise`."""
    near = np.count_nonzero(values >= values.max() - NEAR * noise)
    return noise * sqrt(1.0 + 2.0 * log(near) / 3.0)


def _averaged(sides: Array, noise: float, periods: int) -> float:
    """Rms error of the mean, over so many `periods`, of the larger of the peaks on both `sides`, shape (n, 2), each
    with independent `noise`.
    """
    if noise == 0.0:
        return 0.0
    distance = np.abs(np.diff(sides, axis=1)).ravel() / (sqrt(2.0) * noise)
    beyond = 0.5 * np.array([erfc(each / sqrt(2.0)) for each in distance.tolist()])
    excess = sqrt(2.0) * float(np.mean(np.exp(-0.5 * distance**2) / sqrt(tau) - distance * beyond))
    return noise * hypot(1.0 / sqrt(periods), AGAIN * excess)


def _mean(drift: float, seen: Array, shares: Array, omega: float) -> PeakReadings:
    """Readings at the mean of peaks, from what is `seen` at each, shape (n, 3, 2), and their `shares`, shape (n,)."""
    side = np.where(seen[:, 0, 1] < seen[:, 0, 0], -1.0, 1.0)
    turned = seen * np.stack((side, side, np.ones(side.size)), axis=1)[:, :, None]
    return replace(_readings(drift, np.tensordot(shares, turned, 1), omega), several=(seen[:, 0].T, side * shares))


def _readings(drift: float, seen: Array, omega: float) -> PeakReadings:
    (first, second), (rate_1, rate_2), (range_1, range_2) = seen.tolist()
    return PeakReadings(
        drift=drift,
        sign=-1.0 if second < first else 1.0,
        lasers=(first, second),
        speeds=(omega * rate_1, omega * rate_2),
        zero=np.zeros((2, 1)),
        # one rounding error, averaged over the steps that a laser passes around the peak
        swings=(range_1, range_2),
        at_rest=True,
    )
