"""Waiting for a tick of the plant, or for somebody to end the wait."""

import threading
import time

_SOON = 5.0e-5
"""The clock's reading may lie a rounding error before the tick it promised [s]."""


def deadline_after(timeout: float) -> float:
    """When a call with this DAQmx time-out gives up (monotonic seconds); -1 waits for ever."""
    return float("inf") if timeout < 0.0 else time.monotonic() + timeout


def wait_until(changed: threading.Condition, instant: float, deadline: float) -> bool:
    """Let time pass until `instant`, `deadline` or a change; False when the deadline has passed before."""
    now = time.monotonic()
    if now >= deadline:
        return False
    remaining = min(max(instant - now, _SOON), deadline - now)
    changed.wait(None if remaining == float("inf") else remaining)
    return True
