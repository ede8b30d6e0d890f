"""Delay of a laser whose readings are held until the next one, from the phases of single cycles.

The age of a held reading, between 0 and the period T of the laser, adds to its delay. It advances with the difference
between the rates of laser and samples. In N samples of a cycle that begin with the age a, in periods, and whose ages
advance by s from one to the next, the mean age is T times the mean of frac(a + k s) over k = 0 to N - 1. If s is close
to a fraction p / q, the ages of q successive samples are 1 / q apart, so that their mean is (frac(q a) + (q - 1) / 2) /
q. The ages of all cycles of a check follow from a first age and the difference between the clocks, whose probability
given the measured delays (Bayes) yields the delay without the age.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import ceil

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CLOCKS = 100e-6
"""Largest relative difference between the rates of the two clocks: two quartz clocks, each within 50 ppm."""

EQUAL = 0.3e-6
"""Relative difference below which all differences are equally likely; above, they are on a logarithmic scale, since the
clocks may also be as good as equal.
"""

_FIRST_AGES = 48
_RESOLVED, _MOST = 0.05, 4000
"""Difference between the ages in the last cycle [T / q] for neighbouring differences of the clocks, and largest number
of these on each side of 0, which bounds the time for short periods, whose ages hardly matter.
"""

_GRID = 0.02
"""Error of an age due to the steps of the grid [T / q], which is added to the scatter."""

_SEQUENCE = 16
"""Largest q."""

_TOGETHER = 64
"""Differences of the clocks that are evaluated in one array."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Times in which the delays of a laser are measured: begin and length [s], shape (m,) each, without gaps between
    the samples of each.
    """

    begin: Array
    length: Array

    @property
    def weight(self) -> Array:
        """Weights of the windows by their length, with a sum of 1."""
        return self.length / self.length.sum()

    @property
    def span(self) -> float:
        """Time from the begin of the first window to the end of the last [s]."""
        return float((self.begin + self.length).max() - self.begin.min())


@dataclass(frozen=True, eq=False)
class Delay:
    """Mean delay over all ages, its standard uncertainty, and deviations of the windows' delays from the most probable
    course of the ages [s].
    """

    value: float
    uncertainty: float
    deviations: Array


def covariance(windows: Windows, first: Delay, second: Delay) -> float:
    """Covariance [s2] of two delays against the same sensor, whose noise they share."""
    return float(windows.weight @ (first.deviations * second.deviations)) / (first.deviations.size - 3)


def delay_without_age(windows: Windows, delays: Array, timing: float, sample_rate: float) -> Delay:
    """Mean delay over all ages of the held readings.

    `delays` [s], shape (m,), are those of a signal of constant velocity amplitude: their variance is inversely
    proportional to the length of the window, and its magnitude is estimated from them. `timing` [s] is the period of
    the laser, `sample_rate` is in Hz. At least four windows are required.
    """
    weight = windows.weight
    freedom = delays.size - 1
    ways = Fraction(1.0 / (timing * sample_rate)).limit_denominator(_SEQUENCE).denominator
    logs, means, variances = list[Array](), list[Array](), list[Array]()
    deviations, largest = np.zeros_like(delays), -np.inf
    for prior, ages in _ages(windows, timing, sample_rate, ways):
        left = delays - timing * ages
        mean = left @ weight
        left -= mean[..., None]
        square = left**2 @ weight + (_GRID * timing / ways) ** 2
        # the likelihood with the unknown mean and variance integrated out
        log = np.log(prior)[:, None] - 0.5 * freedom * np.log(square)
        best = np.unravel_index(np.argmax(log), log.shape)
        if log[best] > largest:
            deviations, largest = left[best], log[best]
        logs.append(log)
        means.append(mean)
        # Student's t: the variance of the mean exceeds its scale by f / (f - 2)
        variances.append(square / (freedom - 2))
    log, mean, variance = (np.concatenate(each) for each in (logs, means, variances))
    probability = np.exp(log - largest)
    probability /= probability.sum()
    found = float(np.sum(probability * mean))
    spread = float(np.sum(probability * ((mean - found) ** 2 + variance)))
    return Delay(found + 0.5 * timing, spread**0.5, deviations)


def _ages(windows: Windows, timing: float, sample_rate: float, ways: int) -> Iterator[tuple[Array, Array]]:
    """For groups of differences between the clocks: their prior density, shape (k,), and the mean ages [T] in the
    windows for each first age, shape (k, n, m).
    """
    ratio = 1.0 / (timing * sample_rate)
    expected = (ratio - round(ratio * ways) / ways) * sample_rate
    most = CLOCKS / timing
    steps = min(max(ceil(ways * most * windows.span / _RESOLVED), 1), _MOST)
    differences = most * np.arange(-steps, steps + 1) / steps
    first = (np.arange(_FIRST_AGES) + 0.5) / _FIRST_AGES
    begin = windows.begin - windows.begin.min()
    for some in np.array_split(differences, ceil(differences.size / _TOGETHER)):
        advance = ways * (expected + some)[:, None, None]
        at = first[:, None] + advance * begin
        turned = advance * windows.length
        still = np.abs(turned) < 1e-6
        ages = np.where(still, np.mod(at, 1.0), (_integral(at + turned) - _integral(at)) / np.where(still, 1.0, turned))
        yield 1.0 / (np.abs(some) * timing + EQUAL), (ages + 0.5 * (ways - 1)) / ways


def _integral(x: Array) -> Array:
    """Integral of the fractional part from 0 to x."""
    whole = np.floor(x)
    return 0.5 * (whole + (x - whole) ** 2)
