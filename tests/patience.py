"""The bound against hanging of all waits in tests: generous, for it claims nothing of what is waited for.

A machine may be twenty times slower than usual. A claim about time is counted in operations instead, or has the mark
`milliseconds` or `seconds`.
"""

import time
from collections.abc import Callable

LONG = 500.0
"""Longest wait for anything that must come [s]: shorter than `timeout` in pyproject.toml, so that the test itself says
what did not come."""
LONG_MS = round(1e3 * LONG)
"""The same for Qt [ms]."""


def eventually(condition: Callable[[], object], what: str = "waited in vain") -> None:
    """Wait until the condition holds; AssertionError with `what` after `LONG`."""
    end = time.monotonic() + LONG
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.005)
