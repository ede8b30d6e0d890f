"""Slowness of the machine beside a test: the duration of a fixed piece of work before it, and after it has failed.

A test with the mark `seconds` bounds something in seconds, with room for a busy machine of usual speed. Its failure on
a machine that is much slower (a throttled one, or two cores for ten people) says nothing of the bench, so it is
reported as skipped, with the measured figures; on any other machine it stays a failure.
"""

import time

WORK = 200_000
USUAL = 0.01
"""Duration of the work on an office computer with nothing else to do [s]; a fast one takes 0.008."""
REPEATED = 10
"""How often the work is done after a failure; once before each test, to cost little."""
SLOW = 4.0
"""Times the usual duration from which on a bound in seconds means nothing: the bounds leave less room than that."""


class Slowness:
    """Measures when it is made, and when it is asked for an excuse."""

    def __init__(self) -> None:
        self._before = _duration()

    @property
    def excuse(self) -> str | None:
        """Reason to disregard a failure, with the figures; None where the machine has its usual speed."""
        after = sum(_duration() for _ in range(REPEATED)) / REPEATED
        if max(self._before, after) <= SLOW * USUAL:
            return None
        took = f"work of {1e3 * USUAL:.0f} ms took {1e3 * self._before:.0f} ms before and {1e3 * after:.0f} ms after it"
        return f"this machine is too slow for a bound in seconds: {took} (allowed {1e3 * SLOW * USUAL:.0f} ms)"


def _duration() -> float:
    """Seconds on the clock, waiting for a processor included."""
    begun, total = time.perf_counter(), 0
    for k in range(WORK):
        total += k * k % 7
    return time.perf_counter() - begun
