"""Largest drift within one period of a motion that is not steady: its minimum, mean and maximum over the test.

The peak of a cycle of the drive depends on where the cycle begins if the peaks of the motion wander in phase: two of
them may fall into one cycle and none into the next, and a delay of the sensors by 5 ms changed the smallest peak of a
cycle by 5 %. The largest drift within a period that slides over the motion does not.

The drift is smoothed by parabolas, not taken from fits of the cycles: a fit by harmonics of the drive overshoots the
peak, by 10 % if the amplitude changes by half within a few cycles, because the motion then differs at the two ends of
the cycle. The uncertainties are those of the motion that occurred; they do not include how much other cycles differ.
Where cycles are missing, no period spans the gap.

Of many peaks with noise, the largest is too large and the smallest too small, by up to sqrt(2 ln N) standard deviations
of the noise if N of them are equal. How many are nearly equal is seen from the measured peaks: by how much the largest
would increase on average if the same noise were added to them again, which the distribution of the largest of
independent values gives. The larger of the peaks on both sides within a period is too large for the same reason (Clark,
C. E., 1961, Operations Research 9:145), and so is the mean over the periods. So is the largest sample of one peak, less
the more the peak is curved.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import erfc, hypot, log, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import SHARE, Cycle, mean_amplitude, mean_waves, parabola
from bench.analysis.gain import SteadyPeak
from bench.analysis.peak_readings import PeakReadings
from bench.analysis.signals import ACCELERATION, DRIFT, U1
from sim.attractor import largest_within

Array = NDArray[np.float64]

SPAN, PLACES = 5.0, 200
"""Distances that are integrated over, in standard deviations of the noise, and their number."""

_ERFC = np.frompyfunc(erfc, 1, 1)

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
    every = np.concatenate([each.sides for each in windows])
    tops = every.max(axis=1)
    u1 = max(float(cycle.extreme[U1]) for cycle in cycles)
    amplitude = mean_amplitude(cycles, ACCELERATION)
    harmonics = float(mean_waves(cycles).harmonics[ACCELERATION])

    def of(drift: float, there: Array, error: float) -> SteadyPeak:
        readings = _readings(drift, there, omega)
        return SteadyPeak(drift, 0.0, 0.0, u1, amplitude, harmonics, readings, len(cycles), noise=error)

    mean = float(np.concatenate([each.largest for each in windows]).mean())
    smallest = hypot(_selected(-tops, noise), excess)
    seen = np.array([each.seen(k) for each in windows for k in range(0, each.largest.size, each.length)])
    return UnsteadyPeaks(
        least=of(float(least.largest.min()), least.seen(int(least.largest.argmin())), smallest),
        mean=_mean(of(mean, _turned(seen).mean(axis=0), hypot(_averaged(every, noise), excess)), seen),
        # the vertex of a parabola, not the largest sample
        greatest=of(
            max(float(cycle.extreme[DRIFT]) for cycle in cycles),
            greatest.seen(int(greatest.largest.argmax())),
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
    def sides(self) -> Array:
        """Largest drift on both sides in each period, one after the other, shape (periods, 2) [m]."""
        periods = self.smooth[: len(self.smooth) // self.length * self.length, 0].reshape(-1, self.length)
        return np.stack((periods.max(axis=1), -periods.min(axis=1)), axis=1)

    @property
    def excess(self) -> float:
        """Mean of what noise adds to a peak because the sample is the largest one: slope^2 / (2 x curvature) [m]."""
        size, step = np.abs(self.smooth[:, 0]), _half(self.length)
        periods = size[: size.size // self.length * self.length].reshape(-1, self.length)
        tops = np.arange(len(periods)) * self.length + periods.argmax(axis=1)
        tops = np.clip(tops, step, size.size - 1 - step)
        curvature = (2.0 * size[tops] - size[tops - step] - size[tops + step]) / step**2
        peaks = curvature > 0.0
        return float(np.mean(np.minimum(0.5 * self.slope**2 / curvature[peaks], self.noise))) if peaks.any() else 0.0

    def seen(self, window: int) -> Array:
        """Readings of both lasers [m] at the peak within one window, their changes per cycle / (2 pi), and their ranges
        around it, shape (3, 2).
        """
        top = window + int(np.abs(self.smooth[window : window + self.length, 0]).argmax())
        step = _half(self.length)
        first, last = max(top - step, 0), min(top + step, len(self.smooth) - 1)
        rates = (self.smooth[last, 1:] - self.smooth[first, 1:]) * (self.length / (tau * (last - first)))
        return np.stack((self.smooth[top, 1:], rates, np.ptp(self.smooth[first : last + 1, 1:], axis=0)))


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
    """Rms error of the largest of `values`, shape (n,), each with independent `noise`."""
    if noise == 0.0:
        return 0.0
    last = SPAN + sqrt(2.0 * log(values.size))
    # distances below the largest, in standard deviations; those far below do not count
    below = (values.max() - values) / noise
    below = below[below <= last + SPAN]
    x = np.linspace(-SPAN, last, PLACES)
    probability = np.diff(_normal(x[:, None] + below).prod(axis=1))
    middles = 0.5 * (x[1:] + x[:-1])
    excess = float(probability @ middles)
    variance = float(probability @ (middles - excess) ** 2)
    return noise * hypot(sqrt(variance), AGAIN * excess)


def _averaged(sides: Array, noise: float) -> float:
    """Rms error of the mean, over periods, of the larger of the peaks on both `sides`, shape (n, 2), each with
    independent `noise`.
    """
    if noise == 0.0:
        return 0.0
    distance = np.abs(np.diff(sides, axis=1)) / (sqrt(2.0) * noise)
    density = np.exp(-0.5 * distance**2) / sqrt(tau)
    excess = sqrt(2.0) * float(np.mean(density - distance * _normal(-distance)))
    return noise * hypot(1.0 / sqrt(len(sides)), AGAIN * excess)


def _normal(x: Array) -> Array:
    """Distribution function of the standard normal distribution, without `scipy.special`, which would be imported while
    the table is driven.
    """
    return np.asarray(_ERFC(-x / sqrt(2.0)), dtype=np.float64) / 2.0


def _turned(seen: Array) -> Array:
    """What is `seen` at peaks, shape (n, 3, 2), turned to the side on which the drift is positive."""
    return seen * np.stack((_side(seen), _side(seen), np.ones(len(seen))), axis=1)[:, :, None]


def _side(seen: Array) -> Array:
    """Sign of the drift at peaks, shape (n,)."""
    return np.where(seen[:, 0, 1] < seen[:, 0, 0], -1.0, 1.0)


def _mean(peak: SteadyPeak, seen: Array) -> SteadyPeak:
    """The mean of several peaks, with what is `seen` at each of them, shape (n, 3, 2)."""
    return replace(peak, readings=replace(peak.readings, several=(seen[:, 0].T, _side(seen))))


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
