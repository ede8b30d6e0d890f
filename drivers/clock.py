"""Time is handed in, never taken: virtual for dry runs, the wall clock for the real thing."""

import time
from typing import Protocol


def now() -> float:
    """The machine's clock [s since an arbitrary origin]: never decreases, steps by less than a microsecond.

    Everything that is placed in time is read off this one. The monotonic clock of the language may step by 15.6 ms on
    Windows (documentation of Python, `time.monotonic` before 3.13), this counter does not. On Linux both are
    CLOCK_MONOTONIC, so that other processes on the machine agree with it.
    """
    return time.perf_counter()


class Clock(Protocol):
    """Seconds since an arbitrary origin, and a way to let them pass."""

    def now(self) -> float:
        """Seconds since the clock's origin; never decreases."""
        ...

    def wait_until(self, instant: float) -> None:
        """Return when `now()` has reached `instant`."""
        ...


class VirtualClock:
    """Time that passes as fast as the machine allows: waiting only moves the hand."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        return self._now

    def wait_until(self, instant: float) -> None:
        self._now = max(self._now, instant)


class WallClock:
    """The machine's clock."""

    def now(self) -> float:
        return now()

    def wait_until(self, instant: float) -> None:
        while (remaining := instant - now()) > 0:
            time.sleep(remaining)
