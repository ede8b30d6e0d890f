"""Time is handed in, never taken: virtual for dry runs, the wall clock for the real thing."""

import time
from typing import Protocol


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
    """The machine's monotonic clock."""

    def now(self) -> float:
        return time.monotonic()

    def wait_until(self, instant: float) -> None:
        while (remaining := instant - time.monotonic()) > 0:
            time.sleep(remaining)
