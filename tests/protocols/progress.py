"""Runs with their events, whose progress ends at the end: everything is done, and nothing is left."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bench.app.session import SessionResult, run_session
from bench.engine.interface import Requests, Unattended
from bench.events import Acquired, Event, Progress
from bench.protocol import Protocol


def followed(
    protocol: Protocol[Any], prepared: Any, out: Path, *, figures: bool = False
) -> tuple[SessionResult, list[Event]]:
    """Carry out a prepared run in virtual time, without a person; its result, and its events without samples."""
    events: list[Event] = []
    result = run_session(
        protocol if figures else replace(protocol, figures=()),
        prepared,
        out=out,
        operator=Unattended(),
        subscribers=[lambda event: None if isinstance(event, Acquired) else events.append(event)],
        requests=Requests(),
        realtime=False,
    )
    return result, events


def ends_at_100_percent(events: Sequence[Event]) -> None:
    """Check the progress that a completed run has told among its events."""
    told = [event for event in events if isinstance(event, Progress)]
    assert all(-1e-9 <= each.fraction <= 1.0 + 1e-9 for each in told)
    assert all(each.remaining >= -1e-6 for each in told)
    # but for what a duration is longer than whole samples
    assert told[-1].fraction == pytest.approx(1.0, abs=1e-4)
    assert told[-1].remaining < 0.01
