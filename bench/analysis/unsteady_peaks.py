"""Largest drift within one period of a motion that is not steady: its minimum, mean and maximum over the test.

The peak of a cycle of the drive depends on where the cycle begins if the peaks of the motion wander in phase: two of
them may fall into one cycle and none into the next, and a delay of the sensors by 5 ms changed the smallest peak of a
cycle by 5 %. The largest drift within a period that slides over the motion does not.

The drift is smoothed by parabolas, not taken from fits of the cycles: a fit by harmonics of the drive overshoots the
peak, by 10 % if the amplitude changes by half within a few cycles, because the motion then differs at the two ends of
the cycle. The uncertainties are those of the motion that occurred; they do not include how much other cycles differ.
Where cycles are missing, no period spans the gap.

The largest of several peaks with errors is too large on average, the smallest too small; both are corrected for it
(`bench.analysis.selection`). The errors that differ between peaks are noise, the steps of the lasers and the delays due
to their clocks. The largest sample of one peak is too large as well, less the more the peak is curved. Noise is that of
the residual, which contains the steps of lasers that are not read through a filter.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot, sqrt, tau

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bench.analysis.cycles import SHARE, Cycle, mean_amplitude, mean_waves, parabola
from bench.analysis.gain import SteadyPeak
from bench.analysis.peak_readings import PeakReadings
from bench.analysis.selection import LEFT, larger_side, selection_bias
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.signals import ACCELERATION, DRIFT, U1
from bench.analysis.smoothed_peaks import SmoothedPeaks
from sim.attractor import largest_within

Array = NDArray[np.float64]

POSITIONS = 8
"""Positions of the period, for each period, at which the peaks of the mean are described."""


@dataclass(frozen=True, eq=False)
class UnsteadyPeaks:
    """Largest drift within one period: smallest, mean and largest over all positions of the period in the `used`
    cycles.
    """

    least: SteadyPeak
    mean: SteadyPeak
    greatest: SteadyPeak
    used: tuple[Cycle, ...] = ()


def unsteady_peaks(cycles: Sequence[Cycle], omega: float, accuracy: SensorAccuracy) -> UnsteadyPeaks:
    """Peaks of consecutive cycles at `omega` [rad/s], relative to the storeys at rest."""
    windows = _windows(cycles)
    least = min(windows, key=lambda each: each.largest.min())
    greatest = max(windows, key=lambda each: each.largest.max())
    noise, excess = max(each.noise for each in windows), max(each.excess for each in windows)
    u1 = max(float(cycle.extreme[U1]) for cycle in cycles)
    amplitude = mean_amplitude(cycles, ACCELERATION)
    harmonics = float(mean_waves(cycles).harmonics[ACCELERATION])

    def of(drift: float, readings: PeakReadings, error: float) -> SteadyPeak:
        seen = replace(readings, drift=drift)
        return SteadyPeak(drift, 0.0, 0.0, u1, amplitude, harmonics, seen, len(cycles), noise=error)

    at_least = least.seen(least.top_within(int(least.largest.argmin()))).mean(np.ones(1), omega)
    at_greatest = greatest.seen(greatest.top_within(int(greatest.largest.argmax()))).mean(np.ones(1), omega)
    seen = _Seen.joined([each.seen(each.tops[0]) for each in windows])
    positions = np.concatenate([each.tops[1] for each in windows])
    shares = positions / positions.sum()
    smallest = float(least.largest.min())
    # the vertex of a parabola, not the largest sample
    vertex = max(float(cycle.extreme[DRIFT]) for cycle in cycles)
    errors = seen.covariance(noise, accuracy, omega)
    tops = np.abs(seen.drift)
    sides = np.concatenate([each.sides for each in windows])
    one = sqrt(float(shares @ np.diag(errors)))
    mean = float(np.concatenate([each.largest for each in windows]).mean())
    too_small, too_large = selection_bias(-tops, errors), selection_bias(tops, errors)
    # errors may be smaller than assumed
    corrected = min(smallest + too_small, mean), max(vertex - too_large, mean)
    return UnsteadyPeaks(
        least=of(corrected[0], at_least, hypot(noise, LEFT * too_small, excess)),
        mean=of(mean, seen.mean(shares, omega), hypot(noise / sqrt(len(cycles)), larger_side(sides, one), excess)),
        greatest=of(corrected[1], at_greatest, hypot(noise, LEFT * too_large)),
        used=tuple(cycles),
    )


@dataclass(frozen=True, eq=False)
class _Seen:
    """Smoothed `drift` [m] at n peaks, shape (n,), and of both lasers the readings there [m], shape (n, 2), their
    changes per cycle / (2 pi), shape (n, 2), and the readings `around` them, shape (n, 2, m), with the `weights` of the
    parabola, shape (m,).
    """

    drift: Array
    readings: Array
    rates: Array
    around: Array
    weights: Array

    @classmethod
    def joined(cls, parts: "Sequence[_Seen]") -> "_Seen":
        """The peaks of all `parts`."""
        drift, readings, rates, around = (
            np.concatenate([getattr(each, name) for each in parts]) for name in ("drift", "readings", "rates", "around")
        )
        return cls(drift, readings, rates, around, parts[0].weights)

    def covariance(self, noise: float, accuracy: SensorAccuracy, omega: float) -> Array:
        """Covariance [m2], shape (n, n), of the errors of the peaks due to `noise` [m] and to the delays and the steps
        of the lasers.
        """
        late = omega * accuracy.laser_timing / sqrt(12.0) * np.linalg.norm(self.rates, axis=1)
        found = np.diag(noise**2 + late**2)
        if accuracy.laser_resolution:
            each = SmoothedPeaks(self.around.transpose(1, 0, 2), self.weights, np.sign(self.drift))
            found += each.covariance(accuracy.laser_resolution)
        return found

    def mean(self, shares: Array, omega: float) -> PeakReadings:
        """Readings at the mean of the peaks, with their `shares`, shape (n,), of a motion at `omega` [rad/s]."""
        turned = np.where(self.drift < 0.0, -shares, shares)
        lasers, speeds, swings = (
            tuple(map(float, each))
            for each in (turned @ self.readings, omega * turned @ self.rates, shares @ np.ptp(self.around, axis=2))
        )
        return PeakReadings(
            drift=float(shares @ np.abs(self.drift)),
            sign=1.0,
            lasers=(lasers[0], lasers[1]),
            speeds=(speeds[0], speeds[1]),
            zero=np.zeros((2, 1)),
            swings=(swings[0], swings[1]),
            at_rest=True,
            fitted=SmoothedPeaks(self.around.transpose(1, 0, 2), self.weights, turned),
            several=(self.readings.T, turned),
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
    def of(cls, traces: Array, length: int) -> "_Windows":
        """The windows within `traces`, shape (n, 3) [m]."""
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

    def top_within(self, window: int) -> NDArray[np.intp]:
        """Sample with the largest drift at one position of the period, shape (1,)."""
        return window + np.abs(self.smooth[window : window + self.length, :1]).argmax(axis=0)

    def seen(self, tops: NDArray[np.intp]) -> _Seen:
        """What is seen at the samples `tops`, shape (n,)."""
        step, last = _half(self.length), len(self.smooth) - 1
        first, end = np.maximum(tops - step, 0), np.minimum(tops + step, last)
        drift, lasers = self.smooth[tops, 0], self.smooth[:, 1:]
        rates = (lasers[end] - lasers[first]) * (self.length / (tau * (end - first)))[:, None]
        rows = np.clip(tops, step, last - step)[:, None] + np.arange(-step, step + 1)
        return _Seen(drift, lasers[tops], rates, lasers[rows].transpose(0, 2, 1), parabola(2 * step + 1)[0])


def _windows(cycles: Sequence[Cycle]) -> list[_Windows]:
    """Windows of every stretch of `cycles` without a missing cycle that is as long as a period."""
    stretches = [
        np.concatenate([cycle.traces for cycle in stretch]).astype(np.float64) for stretch in uninterrupted(cycles)
    ]
    # single cycles may have one sample less than the period
    longest = max(len(each) for each in stretches)
    length = min(round(sum(len(each) for each in stretches) / len(cycles)), longest)
    return [_Windows.of(each, length) for each in stretches if len(each) >= length]


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
