"""Watches when blocks come: late data, and a sample clock that disagrees with the computer's."""

from collections import deque

from bench.guard.limits import Limits
from bench.guard.violation import Violation

_SETTLED = 20.0
"""Time after which two clocks can be compared [s]: a block's delay is small against it."""
_COMPARED = 100
"""Blocks among which the earliest is looked for."""


class TimeWatch:
    """Compares when each block was in hand with when its last sample was due."""

    def __init__(self, sample_rate: float, limits: Limits) -> None:
        self._rate = sample_rate
        self._limits = limits
        self._origin: float | None = None
        self._first_end = 0
        self._recent: deque[float] = deque(maxlen=_COMPARED)

    def check(self, now: float, end: int) -> list[Violation]:
        """What is wrong with a block that was in hand at `now` [s] and ends before sample `end`."""
        if self._origin is None:
            self._origin, self._first_end = now, end
            return []
        sampled = (end - self._first_end) / self._rate
        late = now - self._origin - sampled
        self._recent.append(late)
        limits = self._limits
        if late > limits.late:
            return [Violation("delay of a block of samples", late, limits.late, "s", end - 1)]
        # single blocks come late for many reasons; the earliest of many tells the clocks apart
        difference = abs(min(self._recent)) / sampled if sampled > _SETTLED else 0.0
        if difference > limits.clock:
            return [Violation("difference of the clocks", difference, limits.clock, "1", end - 1)]
        return []
