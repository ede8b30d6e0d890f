"""Largest drift within one period of a motion that is not steady: its minimum, mean and maximum over the test.

The peak of a cycle of the drive depends on where the cycle begins if the peaks of the motion wander in phase: two of
them may fall into one cycle and none into the next, and a delay of the sensors by 5 ms changed the smallest peak of a
cycle by 5 %. The largest drift within a period that slides over the motion does not.

The drift is smoothed by parabolas, not taken from fits of the cycles: a fit by harmonics of the drive overshoots the
peak, by 10 % if the amplitude changes by half within a few cycles, because the motion then differs at the two ends of
the cycle. The uncertainties are those of the motion that occurred; they do not include how much other cycles differ.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt, tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import SHARE, Cycle, mean_amplitude, mean_waves, parabola
from bench.analysis.gain import SteadyPeak
from bench.analysis.sensor_accuracy import PeakReadings
from bench.analysis.signals import ACCELERATION, U1
from sim.attractor import largest_within

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CyclePeaks:
    """Largest drift within one period: smallest, mean and largest over all positions of the period."""

    least: SteadyPeak
    mean: SteadyPeak
    greatest: SteadyPeak


def cycle_peaks(cycles: Sequence[Cycle], omega: float) -> CyclePeaks:
    """Peaks of consecutive cycles at `omega` [rad/s], relative to the storeys at rest."""
    windows = [_Windows.of(each) for each in _uninterrupted(cycles)]
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
    return CyclePeaks(
        least=of(float(least.largest.min()), least.seen(int(least.largest.argmin()))[None], noise),
        # about one independent peak per cycle contributes to the mean
        mean=of(mean, np.array(tops), noise / sqrt(len(cycles))),
        greatest=of(float(greatest.largest.max()), greatest.seen(int(greatest.largest.argmax()))[None], noise),
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
        length = len(traces) // len(cycles)
        smooth, noise = _smoothed(traces, max(length // (2 * SHARE), 1))
        return cls(smooth, noise, length, largest_within(np.abs(smooth[:, 0]), length))

    def seen(self, window: int) -> Array:
        """Readings of both lasers [m] at the peak within one window, and their changes per cycle / (2 pi), shape (2,
        2).
        """
        top = window + int(np.abs(self.smooth[window : window + self.length, 0]).argmax())
        step = max(self.length // (2 * SHARE), 1)
        first, last = max(top - step, 0), min(top + step, len(self.smooth) - 1)
        rates = (self.smooth[last, 1:] - self.smooth[first, 1:]) * (self.length / (tau * (last - first)))
        return np.stack((self.smooth[top, 1:], rates))


def _smoothed(traces: Array, half: int) -> tuple[Array, float]:
    """Values of parabolas fitted to `half` samples on both sides of each sample, shape (n, k), and the standard
    uncertainty of the first trace due to noise.
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


def _uninterrupted(cycles: Sequence[Cycle]) -> list[list[Cycle]]:
    """Stretches of cycles without a missing cycle."""
    found: list[list[Cycle]] = [[cycles[0]]]
    for cycle in cycles[1:]:
        if cycle.index == found[-1][-1].index + 1:
            found[-1].append(cycle)
        else:
            found.append([cycle])
    return found


def _readings(drift: float, there: Array, omega: float) -> PeakReadings:
    """Mean of the readings at several peaks, shape (n, 2, 2), all turned to the side of the first peak."""
    sides = np.sign(there[:, 0, 1] - there[:, 0, 0])
    (first, second), (rate_1, rate_2) = np.mean((sides * sides[0])[:, None, None] * there, axis=0).tolist()
    return PeakReadings(
        drift=drift,
        sign=float(sides[0]) or 1.0,
        lasers=(first, second),
        speeds=(omega * rate_1, omega * rate_2),
        zero=np.zeros((2, 1)),
        swings=(0.0, 0.0),
        # rounding errors around the peak are part of its noise
        terms=0.0,
        at_rest=True,
    )
