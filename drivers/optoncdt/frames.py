"""From words to measurements: which belong together, which measurement it was, when it was taken."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.errors import ConnectionLost
from drivers.optoncdt.codec import Words
from drivers.optoncdt.layout import Layout

COUNTER_TURN = 2**18
"""Measurements after which the counter begins anew (manual, p. 66)."""
CLOCK_TURN = 2**32
"""Ticks after which the time stamp begins anew."""
TICK = 10e-6
"""Resolution of the time stamp [s] (manual, p. 66)."""

_LOCK = 8
"""How many measurements must follow each other without a gap before values are trusted."""
_SLACK = 2.0
"""By how many periods time stamp and counter may disagree from one measurement to the next."""
_RATE_SLACK = 0.01
"""By which part of a longer gap they may disagree."""


@dataclass(frozen=True)
class Frames:
    """Measurements: their index, time on the sensor's clock [s] and distance word, each of shape (n,)."""

    index: NDArray[np.int64]
    time: NDArray[np.float64]
    code: NDArray[np.int32]


class Assembler:
    """Puts words together to measurements at nominally `rate` [1/s], each sent as `layout` says.

    Bytes lost in a burst can join the beginning of one measurement to the end of a later one. Therefore a
    measurement counts only when counter and time stamp follow from the one before it: a gap costs, besides what is
    lost, the first measurement after it. Without time stamp the time is the index over the nominal rate.

    `values` is how many measurements were handed out.
    """

    def __init__(self, who: str, layout: Layout, rate: float) -> None:
        self.values = 0
        self._who = who
        self._layout = layout
        self._rate = rate
        self._code = np.empty(0, dtype=np.int32)
        self._first = np.empty(0, dtype=np.bool_)
        self._run = 0
        self._neighbour: tuple[int, int] | None = None
        self._counter, self._ticks = -1, 0
        self._index, self._elapsed = 0, 0

    def feed(self, words: Words) -> Frames:
        """The measurements that are complete with these words.

        Raises ConnectionLost when counter and time stamp jump for good: the sensor was switched off in between.
        """
        code, counter, ticks = self._blocks(words)
        if not code.size:
            return Frames(np.empty(0, dtype=np.int64), np.empty(0), code)
        trusted = self._trusted(counter, ticks)
        code, counter, ticks = code[trusted], counter[trusted], ticks[trusted]
        index, elapsed = self._unwrapped(counter, ticks)
        if self._layout.time is None:
            return Frames(index, index.astype(np.float64) / self._rate, code)
        return Frames(index, elapsed.astype(np.float64) * TICK, code)

    def _blocks(self, words: Words) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.int64]]:
        """Distance, counter and time stamp of the complete measurements; the last may have to wait for more words."""
        code = np.concatenate((self._code, words.code))
        first = np.concatenate((self._first, words.first))
        start = np.flatnonzero(first)
        size = np.empty_like(start)
        np.subtract(start[1:], start[:-1], out=size[:-1])
        size[-1:] = code.size - start[-1:]
        kept = int(start[-1]) if start.size and size[-1] < self._layout.size else code.size
        self._code, self._first = code[kept:], first[kept:]
        start = start[size >= self._layout.size]
        counter = code[start + self._layout.counter].astype(np.int64)
        if self._layout.time is None:
            return code[start], counter, np.zeros_like(counter)
        low, high = (code[start + place].astype(np.int64) & 0xFFFF for place in self._layout.time)
        return code[start], counter, high << 16 | low

    def _trusted(self, counter: NDArray[np.int64], ticks: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which measurements follow their neighbour, and come after `_LOCK` of such."""
        before = self._neighbour or (int(counter[0]), int(ticks[0]))
        follows = _steps(counter, before[0], COUNTER_TURN) == 1
        if self._layout.time is not None:
            periods = _steps(ticks, before[1], CLOCK_TURN) * (TICK * self._rate)
            follows &= np.abs(periods - 1.0) <= _SLACK
        self._neighbour = int(counter[-1]), int(ticks[-1])
        if self.values:
            return follows
        # length of the run of followers that ends at each measurement
        place = np.arange(counter.size)
        run = place - np.maximum.accumulate(np.where(follows, -1 - self._run, place))
        self._run = int(run[-1])
        return np.logical_or.accumulate(run > _LOCK) & follows

    def _unwrapped(
        self, counter: NDArray[np.int64], ticks: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Index and ticks since the sensor's counts began, without their turns."""
        if not counter.size:
            return counter, ticks
        if not self.values:
            self._counter = self._index = int(counter[0]) - 1
            self._ticks = self._elapsed = int(ticks[0])
        steps = _steps(counter, self._counter, COUNTER_TURN)
        passed = _steps(ticks, self._ticks, CLOCK_TURN)
        steps = self._checked(steps, passed)
        index = self._index + np.cumsum(steps)
        elapsed = self._elapsed + np.cumsum(passed)
        self.values += counter.size
        self._counter, self._ticks = int(counter[-1]), int(ticks[-1])
        self._index, self._elapsed = int(index[-1]), int(elapsed[-1])
        return index, elapsed

    def _checked(self, steps: NDArray[np.int64], passed: NDArray[np.int64]) -> NDArray[np.int64]:
        """The steps of the index, with the turns that the counter made in gaps; `passed` are the ticks in between."""
        if self._layout.time is None:
            jump = steps > COUNTER_TURN // 2
        else:
            expected = passed * (TICK * self._rate)
            turns = np.maximum(np.rint((expected - steps) / COUNTER_TURN), 0.0).astype(np.int64)
            steps = steps + turns * COUNTER_TURN
            # a gap in which the two may differ by a turn of the counter says nothing about its turns
            slack = 2.0 * _SLACK + _RATE_SLACK * expected
            jump = (np.abs(expected - steps) > slack) | (slack > COUNTER_TURN // 2)
        if jump.any():
            raise ConnectionLost(
                f"{self._who} began to count anew or was silent for too long; check its power, and open it anew"
            )
        return steps


def _steps(values: NDArray[np.int64], before: int, turn: int) -> NDArray[np.int64]:
    """Forward steps from `before` to the first value and from each to the next, of counts that turn: a power of 2."""
    steps = np.empty_like(values)
    steps[0] = values[0] - before
    np.subtract(values[1:], values[:-1], out=steps[1:])
    return steps & (turn - 1)
