"""The machine's clock: fine enough to place values by, and the same for every process on Linux."""

import sys
import time
from itertools import pairwise

import pytest

from drivers.clock import WallClock, now


def test_it_steps_by_less_than_a_microsecond() -> None:
    seen = [now() for _ in range(20_000)]
    steps = [after - before for before, after in pairwise(seen)]
    assert min(steps) >= 0.0
    assert min(step for step in steps if step > 0.0) < 1e-6


def test_a_coarse_monotonic_clock_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows up to Python 3.12."""
    exact = time.monotonic
    monkeypatch.setattr(time, "monotonic", lambda: exact() // 15.6e-3 * 15.6e-3)
    clock, seen = WallClock(), set[float]()
    for _ in range(1000):
        seen |= {now(), clock.now()}
    assert len(seen) > 100


@pytest.mark.skipif(sys.platform != "linux", reason="says how it is on Linux")
def test_on_linux_other_processes_agree_with_it() -> None:
    assert abs(now() - time.monotonic()) < 1.0
    implementations = {time.get_clock_info(name).implementation for name in ("perf_counter", "monotonic")}
    assert implementations == {"clock_gettime(CLOCK_MONOTONIC)"}
