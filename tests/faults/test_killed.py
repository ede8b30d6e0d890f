"""kill -9 in every state of the engine: the file is readable, and holds what had been written."""

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from bench.datafile.reader import open_datafile
from bench.events import State
from tests.faults.places import PLACES, Place
from tests.faults.setup import BLOCK
from tests.patience import LONG

ROOT = Path(__file__).parents[2]
STATES = [*{place.state: place for place in PLACES if place.core}.values()]
"""The last place in each state."""


@pytest.mark.skipif(os.name != "posix", reason="kills processes the POSIX way")
@pytest.mark.parametrize(
    "places",
    [pytest.param(STATES, id="a place each"), pytest.param(PLACES, id="every place", marks=pytest.mark.soak)],
)
def test_killed_in_every_state(places: Sequence[Place], tmp_path: Path) -> None:
    assert {place.state for place in places} == set(State)
    command = [sys.executable, "-m", "tests.faults.killed", str(tmp_path), *(place.name for place in places)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=LONG, check=True)
    told = dict(line.split() for line in done.stdout.splitlines())
    assert len(told) == 2 * len(places)
    assert set(told.values()) == {str(-signal.SIGKILL)}, done.stderr
    for number, place in enumerate(places):
        with open_datafile(tmp_path / f"raw-{number}.h5") as record:
            assert record.status == "running"
        with open_datafile(tmp_path / f"flushed-{number}.h5") as record:
            assert record.status == "running"
            states = [event.text for event in record.events if event.kind == "StateChanged"]
            if place.turn:
                # a place that is a change of state comes before the recorder is told of it
                assert f"-> {place.state}" in " ".join(states)
                assert record.rows >= BLOCK * (place.turn - 1)
                assert np.isfinite(record.values("table_displacement")).all()
