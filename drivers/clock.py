"""Clocks that pace a rig: virtual time, and the wall clock."""

import time
from typing import Protocol

from sim import waiting


def now() -> float:
    """The machine's clock [s since an arbitrary origin], which never decreases; its resolution is better than a
    microsecond.

    All time stamps use this clock. Python's monotonic clock may step by 15.6 ms on Windows (documentation of Python,
    `time.monotonic` before 3.13); this counter does not. On Linux both are CLOCK_MONOTONIC, shared by all processes.
    """
    return time.perf_counter()


class Clock(Protocol):
    """Clock with an arbitrary origin, and a wait that ends at a time of this clock."""

    def now(self) -> float:
        """Seconds since the clock's origin; never decreases."""
        ...

    def wait_until(self, instant: float) -> None:
        """Block until `now()` has reached `instant`."""
        ...


class VirtualClock:
    """Virtual time: a wait sets the clock to the end of the wait and returns at once."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        return self._now

    def wait_until(self, instant: float) -> None:
        self._now = max(self._now, instant)


class WallClock:
    """Real time, from the machine's clock."""

    def now(self) -> float:
        return now()

    def wait_until(self, instant: float) -> None:
        while (remaining := instant - now()) > 0:
            waiting.sleep(remaining)
