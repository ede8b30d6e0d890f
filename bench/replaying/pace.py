"""Bench time that passes at a chosen pace."""

import time

from drivers.clock import now

LONGEST_WAIT = 1.0
"""What is shown of a longer wait [s]: while hands were at work nothing happened that could be shown."""


class PacedClock:
    """Recorded time at `speed` times the pace of the wall; it is never late, however slow the machine.

    A clock that read the wall would let the guard find blocks late that came in time when they were recorded.
    """

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._now = 0.0
        self._due = now()

    def now(self) -> float:
        """Bench time [s]."""
        return self._now

    def wait_until(self, instant: float) -> None:
        """Go to bench time `instant`, not before its turn on the wall."""
        ahead = instant - self._now
        if ahead <= 0.0:
            return
        self._now = instant
        # what a slow computation has cost is not made up for
        self._due = max(self._due + min(ahead, LONGEST_WAIT) / self._speed, now())
        while (remaining := self._due - now()) > 0.0:
            time.sleep(remaining)
