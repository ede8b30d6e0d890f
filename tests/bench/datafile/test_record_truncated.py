"""A file of which the end is missing: what is recovered is what was written, to the last bit, and the rest is told."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.app.cli.main import main
from bench.datafile.inspection import verify
from bench.datafile.reader import DataFile, open_datafile
from bench.datafile.recovery import recover
from bench.datafile.writer import journal_path
from bench.events import PointFinished, State, StateChanged, Warned
from sim.errors import RockbenchError
from tests.bench.datafile.example import CHANNELS, Small, begin, block

BLOCK, BLOCKS = 20, 600
"""More blocks than one chunk of their table has rows."""


@dataclass(frozen=True)
class Written:
    """The file when it was closed, as its writer left it just before, and what it holds."""

    closed: bytes
    left: bytes
    journal: bytes
    kept: dict[str, NDArray[Any]]
    events: list[Any]
    points: list[dict[str, Any]]


def kept_of(record: DataFile) -> dict[str, NDArray[Any]]:
    return {
        **{channel.name: record.counts(channel.name) for channel in record.channels},
        **{f"block {name}": values for name, values in record.blocks.items()},
        "drive": record.drive(),
        "time": record.time(),
    }


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """Two runs, of which the second has a gap, with events and points throughout."""
    path = tmp_path_factory.mktemp("whole") / "campaign.h5"
    recorder = begin(path, point_type=Small)
    recorder(StateChanged(State.ARMED, State.RUNNING, "started", time=0.0))
    for k in range(BLOCKS):
        run, number = divmod(k, BLOCKS // 2)
        missing = 1000 if run and number > 100 else 0
        recorder(block(number * BLOCK + missing, BLOCK, run=run + 1, time=0.01 * (k + 1) + 3.0 * run, seed=run))
        if k % 6 == 0:
            recorder(Warned(f"warning {k}", time=0.01 * k))
        if k % 50 == 49:
            recorder(PointFinished(Small(number=k, alpha_2=1.0 / k), time=0.01 * k))
            recorder.sync()
    left = path.read_bytes()
    recorder.close("completed", "all done")
    with open_datafile(path) as record:
        return Written(
            path.read_bytes(), left, journal_path(path).read_bytes(), kept_of(record), record.events, record.points
        )


def cut_file(folder: Path, content: bytes, length: int) -> Path:
    path = folder / f"{length}.h5"
    path.write_bytes(content[:length])
    return path


def hold(written: Written, path: Path, counted: int) -> int:
    """Recover what is left; return its rows, or -1 when that is refused."""
    before, clean = path.read_bytes(), path.with_suffix(".clean.h5")
    try:
        found = recover(path, clean)
    except RockbenchError:
        assert not clean.exists()
        return -1
    finally:
        assert path.read_bytes() == before
    with open_datafile(clean) as record:
        kept = kept_of(record)
        gone = written.kept.keys() - kept.keys()
        # a channel whose description was cut off is named
        assert gone <= {channel.name for channel in CHANNELS}
        assert all(any(f"/{name}/counts" in damage for damage in found.damage) for name in gone)
        for name, values in kept.items():
            assert values.dtype == written.kept[name].dtype
            np.testing.assert_array_equal(values, written.kept[name][: len(values)], err_msg=name)
        lengths = {len(kept[channel.name]) for channel in record.channels}
        assert lengths == {len(kept["drive"]), record.rows} == {found.rows}
        assert found.rows + found.unreadable == counted
        assert record.events == written.events[: len(record.events)]
        assert record.points == written.points[: len(record.points)]
        lost = len(written.points) > len(record.points) or found.unreadable > 0
        assert record.status == ("interrupted" if lost else "completed")
        assert not found.unreadable or f"{found.unreadable} rows of samples" in record.summary
        # notes of what is damaged follow
        note = record.recoveries[-1 - len(found.damage)]
        assert not found.unreadable or f"{found.unreadable} rows of samples" in note
    return found.rows


@pytest.mark.parametrize("number", [5, pytest.param(200, marks=(pytest.mark.soak, pytest.mark.timeout(1200)))])
def test_of_a_closed_file_cut_anywhere_the_beginning_is_kept(written: Written, tmp_path: Path, number: int) -> None:
    rng, whole = np.random.default_rng(number), len(written.closed)
    # one length in each of so many stretches, and where the file begins
    lengths = [7, 40, 700, *(whole * (np.arange(number) + rng.random(number)) / number).astype(int).tolist()]
    rows = [hold(written, cut_file(tmp_path, written.closed, length), BLOCK * BLOCKS) for length in lengths]
    assert sorted(rows) == rows
    assert rows[:3] == [-1, -1, -1]
    # what describes the file lies at its beginning: the rest is recovered in proportion
    assert sum(found > 0 for found in rows) > number / 4


# the first half of so small a file describes it
@pytest.mark.parametrize("share", [5 / 6, pytest.param(2 / 3, marks=pytest.mark.soak)])
def test_zeros_beyond_the_end_of_a_file_that_was_not_closed_are_not_taken_for_values(
    written: Written, tmp_path: Path, capsys: pytest.CaptureFixture[str], share: float
) -> None:
    """The tables are not packed: what is missing of them reads as 0, with no error."""
    path = cut_file(tmp_path, written.left, int(share * len(written.left)))
    assert any("truncated" in problem for problem in verify(path).problems)
    assert main(["file", "info", str(path)]) == 2
    assert "truncated" in capsys.readouterr().err
    clean = tmp_path / "clean.h5"
    assert main(["file", "recover", str(path), "--out", str(clean), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["lost"]["samples"] == BLOCK * BLOCKS - told["samples"]
    assert verify(clean).problems == ()
    with open_datafile(clean) as record:
        assert 0 < record.rows == told["samples"]
        for name, values in kept_of(record).items():
            np.testing.assert_array_equal(values, written.kept[name][: len(values)], err_msg=name)
        assert record.status == "interrupted"
        assert f"{told['lost']['samples']} rows of samples" in record.summary


def test_points_come_back_from_the_journal_whatever_the_file_lost(written: Written, tmp_path: Path) -> None:
    path = cut_file(tmp_path, written.closed, len(written.closed) // 3)
    journal_path(path).write_bytes(written.journal)
    found = recover(path, tmp_path / "clean.h5")
    assert found.points_from_journal > 0
    with open_datafile(tmp_path / "clean.h5") as record:
        assert record.points == written.points
        assert record.events == written.events
        assert (record.status, found.lost.keys() & {"points", "events"}) == ("interrupted", set())
