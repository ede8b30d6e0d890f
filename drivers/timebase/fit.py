"""Bounds on a clock's error, and lines fitted to them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_STRETCH = 0.2
"""Length of an interval [s]; the best reading of each interval is kept. Clocks that differ by 50 ppm drift apart by
10 us in this time.
"""
_KEPT = 120.0
"""Duration of the history [s]: long enough for a rate accurate to 1e-6, so short that quartz clocks hardly drift."""


@dataclass(frozen=True)
class Points:
    """Readings at ascending `seconds` of one clock, shape (n,); `delay`, shape (n,) [s], is the simultaneous reading of
    another clock minus that of this one, of either sign.
    """

    seconds: NDArray[np.float64]
    delay: NDArray[np.float64]

    def __len__(self) -> int:
        return int(self.seconds.size)


class Bounds:
    """History of the smallest delays of the last two minutes."""

    def __init__(self) -> None:
        self._points = Points(np.zeros(0), np.zeros(0))

    @property
    def points(self) -> Points:
        """The history: at most one reading per interval of 0.2 s, so at most about 600."""
        return self._points

    def add(self, seconds: NDArray[np.float64], delay: NDArray[np.float64]) -> None:
        """Add readings, shape (n,) each [s]; none may precede the newest interval of the history."""
        kept = self._points
        if seconds.size == 0:
            return
        seconds = np.concatenate((kept.seconds[-1:], seconds))
        delay = np.concatenate((kept.delay[-1:], delay))
        stretch: NDArray[np.float64] = np.floor(seconds / _STRETCH)
        order: NDArray[np.intp] = np.lexsort((delay, stretch))
        in_order: NDArray[np.float64] = stretch[order]
        leads = np.ones(order.size, dtype=np.bool_)
        leads[1:] = np.greater(in_order[1:], in_order[:-1])
        best: NDArray[np.intp] = order[leads]
        seconds = np.concatenate((kept.seconds[:-1], seconds[best]))
        delay = np.concatenate((kept.delay[:-1], delay[best]))
        begin = int(np.searchsorted(seconds, float(seconds[-1]) - _KEPT))
        self._points = Points(seconds[begin:], delay[begin:])

    def forget(self) -> None:
        """Discard the older half of the history."""
        half = len(self._points) // 2
        self._points = Points(self._points.seconds[half:], self._points.delay[half:])


_RATE_SPREAD = 50e-6
"""Standard deviation of the prior of the relative rate error between two quartz clocks [1]."""
_LARGEST = 1e-3
"""Largest rate error searched for [1]: a machine's clock is slewed by at most 500 ppm."""
_HALVINGS = 18
"""Number of bisections, which give the rate to 4e-9, a quarter of a microsecond per minute."""
_STEPS = 2.0 ** np.arange(-30, -9)
"""Steps from the most probable rate, 1e-9 to 1e-3, to find the width of its posterior [1]."""
_NEGLIGIBLE = 8.0
"""Slopes whose log posterior is below its maximum by more than this are neglected."""
_GRID = 41
"""Number of slopes in the average over the posterior."""
_RESOLUTION = 1e-7
"""Mean delay below which readings are considered exact [s]."""
_FAR = 5.0
"""Multiple of the typical delay above which a delay is excluded as an outlier, caused by a stall of the machine."""
_QUARTER = 8
"""Minimum number of readings in a quarter of the history for the test in `bends`."""
_CHANCE = 4.0
"""Multiple of mean/sqrt(n) that the smallest of n delays practically never exceeds, even if each is the sum of two
delays, such as those due to bursts and to the scheduler.
"""

_GROWTH = 0.02
"""Growth of the history, as a fraction, after which a line is refitted."""
_PATIENCE = 1.0
"""Growth of the history [s] after which a line is refitted; bounds the work per iteration of the acquisition loop."""


def needs_refit(history: float, fitted: float) -> bool:
    """Whether a line must be refitted to a history of length `history` [s] if the length was `fitted` [s] at the last
    fit.
    """
    return history - fitted >= min(_GROWTH * history, _PATIENCE)


@dataclass(frozen=True)
class Prior:
    """Normal prior of a relative rate error [1]; by default that of two quartz clocks."""

    mean: float = 0.0
    spread: float = _RATE_SPREAD


def rate_error(sides: Sequence[tuple[Points, float]], prior: Prior) -> float:
    """Posterior mean of the common slope of the lines that bound the points of `sides` from below.

    Each side has a sign; its delays grow by sign times slope per second. Two-sided bounds have the signs +1 and -1.
    """
    given = [_side(points.seconds, points.delay, sign) for points, sign in sides]
    rough = _most_probable(given, prior)
    given = [_without_stalls(side, rough) for side in given]
    mode = _most_probable(given, prior)
    steps = np.concatenate((-_STEPS, [0.0], _STEPS))
    level = _log_posterior(given, mode + steps, prior)
    inside = steps[level > level[_STEPS.size] - _NEGLIGIBLE]
    low, high = 2.0 * float(inside.min()), 2.0 * float(inside.max())
    slopes = mode + np.linspace(low, high, _GRID, dtype=np.float64)
    weight = _log_posterior(given, slopes, prior)
    weight = np.exp(weight - weight.max())
    return float(np.average(slopes, weights=weight))


@dataclass(frozen=True)
class _Side:
    """Readings of one bound, with `seconds` relative to their mean."""

    sign: float
    seconds: NDArray[np.float64]
    delay: NDArray[np.float64]
    mean: float


def _side(seconds: NDArray[np.float64], delay: NDArray[np.float64], sign: float) -> _Side:
    return _Side(sign, seconds - seconds.mean(), delay, float(delay.mean()))


def _without_stalls(side: _Side, slope: float) -> _Side:
    """The side without outliers far above its line; an approximate slope of the line is sufficient."""
    above = side.delay - side.sign * slope * side.seconds
    above -= above.min()
    kept = above <= _FAR * typical(above) + _RESOLUTION
    return _side(side.seconds[kept], side.delay[kept], side.sign)


def _most_probable(sides: Sequence[_Side], prior: Prior) -> float:
    """The slope at which the derivative of the log posterior changes its sign."""
    low, high = -_LARGEST, _LARGEST
    for _ in range(_HALVINGS):
        slope = 0.5 * (low + high)
        gain = (prior.mean - slope) / prior.spread**2
        for side in sides:
            above = side.delay - side.sign * slope * side.seconds
            touching = int(above.argmin())
            scale = side.mean - float(above[touching]) + _RESOLUTION
            gain -= side.sign * side.delay.size * float(side.seconds[touching]) / scale
        low, high = (slope, high) if gain > 0.0 else (low, slope)
    return 0.5 * (low + high)


def _log_posterior(sides: Sequence[_Side], slopes: NDArray[np.float64], prior: Prior) -> NDArray[np.float64]:
    """Log posterior of slopes, shape (m,), up to a constant, maximised over the mean delay."""
    level = -0.5 * ((slopes - prior.mean) / prior.spread) ** 2
    for side in sides:
        floor = (side.delay - np.outer(side.sign * slopes, side.seconds)).min(axis=1)
        level -= side.delay.size * np.log(side.mean - floor + _RESOLUTION)
    return level


def floor_below(points: Points, slope: float) -> float:
    """Delay at second 0 [s] of the highest line of this slope below the points; infinite if there are no points."""
    return float((points.delay - slope * points.seconds).min(initial=np.inf))


def typical(above: NDArray[np.float64]) -> float:
    """Mean of exponentially distributed delays [s], estimated from their median, so that stalls hardly affect it."""
    return float(np.median(above)) / np.log(2.0)


def bends(points: Points, slope: float, tolerance: float) -> bool:
    """Whether the points deviate from a line of this slope by more than `tolerance` [s] plus random scatter, as after a
    change of the rate.

    Compares the smallest delay in each of the last three quarters of the history. The first quarter is ignored, since
    its readings may have been taken under different conditions.
    """
    size = len(points) // 4
    if size < _QUARTER:
        return False
    above = (points.delay - slope * points.seconds)[-3 * size :].reshape(3, size)
    least = above.min(axis=1)
    chance = _CHANCE / np.sqrt(size) * np.array([typical(third) for third in above - least[:, None]])
    return bool((least - least.min() > tolerance + chance).any())
