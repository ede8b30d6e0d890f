"""kill -9 in every state of the engine: the file is readable, and holds what had been written."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bench.datafile.reader import open_datafile
from tests.faults.places import PLACES
from tests.faults.setup import BLOCK
from tests.patience import LONG

ROOT = Path(__file__).parents[2]


@pytest.mark.skipif(os.name != "posix", reason="kills processes the POSIX way")
def test_killed_in_every_state(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.faults.killed", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=LONG, check=True)
    told = dict(line.split() for line in done.stdout.splitlines())
    assert len(told) == 2 * len(PLACES)
    assert set(told.values()) == {str(-signal.SIGKILL)}, done.stderr
    for number, place in enumerate(PLACES):
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
