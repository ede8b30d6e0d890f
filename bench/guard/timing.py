"""Watches when blocks come: late data, and a sample clock that disagrees with the computer's."""

from collections import deque

from bench.guard.limits import Limits
from bench.guard.violation import Violation

_SETTLED = 20.0
"""Time after which two clocks can be compared [s]: a block's delay is small against it."""
_STRETCH = 5.0
"""How long, at the beginning and now, the earliest block is looked for [s]: it tells the clocks apart."""


class TimeWatch:
    """Compares when each block was in hand with when its last sample was due."""

    def __init__(self, sample_rate: float, limits: Limits) -> None:
        self._rate = sample_rate
        self._limits = limits
        self._origin: float | None = None
        self._first_end = 0
        self._early = (0.0, 0.0)
        self._recent: deque[tuple[float, float]] = deque()

    def check(self, now: float, end: int) -> list[Violation]:
        """What is wrong with a block that was in hand at `now` [s] and ends before sample `end`."""
        if self._origin is None:
            self._origin, self._first_end = now, end
            return []
        sampled = (end - self._first_end) / self._rate
        late = now - self._origin - sampled
        # single blocks come late for many reasons, the first one of a run too
        if sampled <= _STRETCH:
            self._early = min(self._early, (late, sampled))
        self._recent.append((late, sampled))
        while self._recent[0][1] < sampled - _STRETCH:
            self._recent.popleft()
        limits = self._limits
        if late > limits.late:
            return [Violation("delay of a block of samples", late, limits.late, "s", end - 1)]
        if sampled <= _SETTLED:
            return []
        (before, then), (after, since) = self._early, min(self._recent)
        difference = abs(after - before) / (since - then)
        if difference > limits.clock:
            return [Violation("difference of the clocks", difference, limits.clock, "1", end - 1)]
        return []
