"""The line below delays that are never negative.

Delays of USB, network and scheduler have a floor and a long tail, so a mean says little and the least ones nearly
all. For delays that are exponentially distributed above a line, the most probable line touches the readings from
below (S. B. Moon, P. Skelly, D. Towsley, "Estimation and removal of clock skew from network delay measurements",
INFOCOM 1999). A normal prior on the rate carries the first seconds, when the readings say little about it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.timebase.bounds import Points

_RATE_SPREAD = 50e-6
"""Standard deviation of the rate error of a quartz clock against another one [1]."""
_LARGEST = 1e-3
"""Rate errors that are looked for [1]: a machine's clock is slewed by 500 ppm at most."""
_HALVINGS = 18
"""So that the rate is found to 4e-9: a quarter of a microsecond in a minute."""
_STEPS = 2.0 ** np.arange(-30, -9)
"""Steps from the most probable rate in which the width of its distribution is looked for: 1e-9 to 1e-3."""
_NEGLIGIBLE = 8.0
"""Slopes whose log posterior is this much lower do not count."""
_GRID = 41
"""Slopes over which the mean is taken."""
_RESOLUTION = 1e-7
"""Mean delay below which readings count as exact [s]."""
_FAR = 5.0
"""A delay of so many typical ones is a stall of the machine: it says nothing of the others, and is left out."""
_QUARTER = 8
"""How many readings a quarter of the history needs to be judged."""
_CHANCE = 4.0
"""The least of n delays practically never exceeds this many times mean/sqrt(n), not even if short delays are as rare
as in sums of two delays, such as those of burst and scheduler."""

_GROWTH = 0.02
"""A line is fitted anew when its history has grown by this share,"""
_PATIENCE = 1.0
"""or by this many seconds: a turn of the loop that reads the bench has no time for more."""


def due(history: float, fitted: float) -> bool:
    """Whether a line over `history` [s] is to be fitted anew when it was last fitted at `fitted` [s] of it."""
    return history - fitted >= min(_GROWTH * history, _PATIENCE)


def rate_error(sides: Sequence[tuple[Points, float]]) -> float:
    """Slope of the lines below `sides`, as all together make it probable: the mean of its posterior.

    Each side has a sign: its delays grow by sign times slope. Two-sided bounds have the signs +1 and -1.
    """
    given = [_side(points.seconds, points.delay, sign) for points, sign in sides]
    rough = _most_probable(given)
    given = [_without_stalls(side, rough) for side in given]
    mode = _most_probable(given)
    steps = np.concatenate((-_STEPS, [0.0], _STEPS))
    level = _log_posterior(given, mode + steps)
    inside = steps[level > level[_STEPS.size] - _NEGLIGIBLE]
    low, high = 2.0 * float(inside.min()), 2.0 * float(inside.max())
    slopes = mode + np.linspace(low, high, _GRID, dtype=np.float64)
    weight = _log_posterior(given, slopes)
    weight = np.exp(weight - weight.max())
    return float(np.average(slopes, weights=weight))


@dataclass(frozen=True)
class _Side:
    """Delays over seconds from their mean."""

    sign: float
    seconds: NDArray[np.float64]
    delay: NDArray[np.float64]
    mean: float


def _side(seconds: NDArray[np.float64], delay: NDArray[np.float64], sign: float) -> _Side:
    return _Side(sign, seconds - seconds.mean(), delay, float(delay.mean()))


def _without_stalls(side: _Side, slope: float) -> _Side:
    """What is left of a side whose line has about this slope."""
    above = side.delay - side.sign * slope * side.seconds
    above -= above.min()
    kept = above <= _FAR * typical(above) + _RESOLUTION
    return _side(side.seconds[kept], side.delay[kept], side.sign)


def _most_probable(sides: Sequence[_Side]) -> float:
    """The slope at which the derivative of the log posterior changes its sign."""
    low, high = -_LARGEST, _LARGEST
    for _ in range(_HALVINGS):
        slope = 0.5 * (low + high)
        gain = -slope / _RATE_SPREAD**2
        for side in sides:
            above = side.delay - side.sign * slope * side.seconds
            touching = int(above.argmin())
            scale = side.mean - float(above[touching]) + _RESOLUTION
            gain -= side.sign * side.delay.size * float(side.seconds[touching]) / scale
        low, high = (slope, high) if gain > 0.0 else (low, slope)
    return 0.5 * (low + high)


def _log_posterior(sides: Sequence[_Side], slopes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of slopes, shape (m,), but for a constant; the mean delay is the most probable one for each of them."""
    level = -0.5 * (slopes / _RATE_SPREAD) ** 2
    for side in sides:
        floor = (side.delay - np.outer(side.sign * slopes, side.seconds)).min(axis=1)
        level -= side.delay.size * np.log(side.mean - floor + _RESOLUTION)
    return level


def floor_below(points: Points, slope: float) -> float:
    """The highest line of this slope below the points: its delay at second 0 [s]. Infinite without points."""
    return float((points.delay - slope * points.seconds).min(initial=np.inf))


def typical(above: NDArray[np.float64]) -> float:
    """The mean of exponentially distributed delays [s], from their median: stalls of the machine do not move it."""
    return float(np.median(above)) / np.log(2.0)


def bends(points: Points, slope: float, tolerance: float) -> bool:
    """Whether the points keep away from the line by more than `tolerance` [s] and chance: the rate has changed.

    Judged by the least delays of the last three quarters; the first may have been read in another way.
    """
    size = len(points) // 4
    if size < _QUARTER:
        return False
    above = (points.delay - slope * points.seconds)[-3 * size :].reshape(3, size)
    least = above.min(axis=1)
    chance = _CHANCE / np.sqrt(size) * np.array([typical(third) for third in above - least[:, None]])
    return bool((least - least.min() > tolerance + chance).any())
