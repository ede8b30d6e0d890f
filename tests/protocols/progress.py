"""The progress of a run ends at its end: everything is done, and nothing is left."""

from collections.abc import Sequence

import pytest

from bench.events import Event, Progress


def ends_at_100_percent(events: Sequence[Event]) -> None:
    """Check the progress that a completed run has told among its events."""
    told = [event for event in events if isinstance(event, Progress)]
    assert all(-1e-9 <= each.fraction <= 1.0 + 1e-9 for each in told)
    assert all(each.remaining >= -1e-6 for each in told)
    # but for what a duration is longer than whole samples
    assert told[-1].fraction == pytest.approx(1.0, abs=1e-4)
    assert told[-1].remaining < 0.01
