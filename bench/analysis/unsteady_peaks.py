"""Largest drift within one period of a motion that is not steady: its minimum, mean and maximum over the test.

The peak of a cycle of the drive depends on where the cycle begins if the peaks of the motion wander in phase: two of
them may fall into one cycle and none into the next, and a delay of the sensors by 5 ms changed the smallest peak of a
cycle by 5 %. The largest drift within a period that slides over the motion does not.

The drift is smoothed by parabolas, not taken from fits of the cycles: a fit by harmonics of the drive overshoots the
peak, by 10 % if the amplitude changes by half within a few cycles, because the motion then differs at the two ends of
the cycle. The uncertainties are those of the motion that occurred; they do not include how much other cycles differ.
Where cycles are missing, no period spans the gap.

Of N equal peaks with noise, the largest is too large by up to sqrt(2 ln N) standard deviations of the noise, the
smallest too small; how many peaks are equal is not known. The bound counts as a rectangular distribution. A mean of
largest values is too large by less than one standard deviation.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import SHARE, Cycle, mean_amplitude, mean_waves, parabola
from bench.analysis.gain import SteadyPeak
from bench.analysis.peak_readings import PeakReadings
from bench.analysis.signals import ACCELERATION, DRIFT, U1
from sim.attractor import largest_within

Array = NDArray[np.float64]


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
    noise = max(each.noise for each in windows)
    u1 = max(float(cycle.extreme[U1]) for cycle in cycles)
    amplitude = mean_amplitude(cycles, ACCELERATION)
    harmonics = float(mean_waves(cycles).harmonics[ACCELERATION])

    def of(drift: float, there: Array, error: float) -> SteadyPeak:
        readings = _readings(drift, there, omega)
        return SteadyPeak(drift, 0.0, 0.0, u1, amplitude, harmonics, readings, len(cycles), noise=error)

    mean = float(np.concatenate([each.largest for each in windows]).mean())
    tops = [each.seen(k) for each in windows for k in range(0, each.largest.size, each.length)]
    chosen = noise * sqrt(1.0 + 2.0 * log(len(cycles)) / 3.0)
    return UnsteadyPeaks(
        least=of(float(least.largest.min()), least.seen(int(least.largest.argmin())), chosen),
        mean=of(mean, np.mean([_turned(each) for each in tops], axis=0), noise),
        greatest=of(
            max(float(cycle.extreme[DRIFT]) for cycle in cycles),
            greatest.seen(int(greatest.largest.argmax())),
            chosen,
        ),
        used=tuple(cycles),
    )


@dataclass(frozen=True, eq=False)
class _Windows:
    """`largest` drift [m] within every position of a period, of `length` samples, in a stretch of cycles.

    `smooth` [m], shape (n, 3), are the drift and the readings of both lasers by parabolas fitted around each sample;
    `noise` [m] is the standard uncertainty of the drift due to noise.
    """

    smooth: Array
    noise: float
    length: int
    largest: Array

    @classmethod
    def of(cls, cycles: Sequence[Cycle]) -> "_Windows":
        traces = np.concatenate([cycle.traces for cycle in cycles]).astype(np.float64)
        length = round(len(traces) / len(cycles))
        smooth, noise = _smoothed(traces, _half(length))
        return cls(smooth, noise, length, largest_within(np.abs(smooth[:, 0]), length))

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


def _smoothed(traces: Array, half: int) -> tuple[Array, float]:
    """Values of parabolas fitted to `half` samples on both sides of each sample, shape (n, k), and the standard
    uncertainty of the first trace due to noise. The values are those of `scipy.signal.savgol_filter`, which would be
    imported while the table is driven.
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
    return smooth, sqrt(residual * leverage / (1.0 - leverage))


def uninterrupted(cycles: Sequence[Cycle]) -> list[list[Cycle]]:
    """Stretches of cycles without a missing cycle."""
    found: list[list[Cycle]] = [[cycles[0]]]
    for cycle in cycles[1:]:
        if cycle.index == found[-1][-1].index + 1:
            found[-1].append(cycle)
        else:
            found.append([cycle])
    return found


def _turned(seen: Array) -> Array:
    """What is `seen` at a peak, turned to the side on which the drift is positive."""
    side = -1.0 if seen[0, 1] < seen[0, 0] else 1.0
    return seen * np.array([[side], [side], [1.0]])


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
