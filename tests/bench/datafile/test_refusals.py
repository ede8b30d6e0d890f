"""What the record refuses, and how it says so."""

from pathlib import Path
from typing import Any

import h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
import pytest

from bench.datafile import hdf5
from bench.datafile.hdf5_reading import DataFileError
from bench.datafile.reader import open_datafile
from bench.datafile.tables import Column
from bench.events import Acquired, PointFinished, State, StateChanged, Warned
from drivers.rig import Block, Channel
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity
from tests.bench.datafile.example import CHANNELS, PREDICTION, begin, block


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "campaign.h5"


def test_nothing_is_overwritten(path: Path) -> None:
    path.write_bytes(b"precious")
    with pytest.raises(InvalidInput, match="never overwritten"):
        begin(path)
    assert path.read_bytes() == b"precious"


def test_a_folder_that_cannot_be_written_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    for folder in ("missing", "file"):
        with pytest.raises(InvalidInput, match="cannot be created") as caught:
            begin(tmp_path / folder / "campaign.h5")
        assert "\n" not in str(caught.value)


class _Nested(Parameters):
    inner: tuple[float, ...] = quantity((), "m", "no single number")


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"channels": (CHANNELS[0], CHANNELS[0])}, "storey 1"),
        ({"channels": (Channel("a/b", "voltage", "V", 1.0, 0.0, (0, 1), ""),)}, "a/b"),
        ({"channels": (Channel("drive", "voltage", "V", 1.0, 0.0, (0, 1), ""),)}, "drive"),
        ({"channels": ()}, "channels"),
        ({"sample_rate": 0.0}, "sample_rate"),
        ({"point_type": _Nested}, "inner"),
        ({"tables": {"points": PREDICTION}}, "points"),
        ({"tables": {"t": {"x": Column(np.zeros((2, 2)), "m", "")}}}, "column x"),
        ({"tables": {"t": {"x": Column(np.zeros(2), "", "")}}}, "column x"),
        ({"tables": {"t": {"x": Column(np.zeros(2), "m", ""), "y": Column(np.zeros(3), "m", "")}}}, "table t"),
        ({"metadata": {"..": "x"}}, r"\.\."),
    ],
)
def test_what_cannot_be_stored_is_refused_before_the_file_exists(
    path: Path, changes: dict[str, Any], named: str
) -> None:
    with pytest.raises(InvalidInput, match=named):
        begin(path, **changes)
    assert not path.exists()


def test_a_block_of_the_wrong_shape_is_refused(path: Path) -> None:
    recorder = begin(path)
    good = block(0, 10)
    with pytest.raises(DataFileError, match="drive"):
        recorder(Acquired(1, good.block, np.zeros(9), time=0.0))
    with pytest.raises(DataFileError, match=r"\(10, 2\)"):
        recorder(Acquired(1, Block(0, good.block.counts[:, :2]), good.drive, time=0.0))
    with pytest.raises(DataFileError, match="Frame"):
        recorder(PointFinished(_Frame(), time=0.0))
    recorder.close("failed")
    with pytest.raises(DataFileError, match="closed"):
        recorder(good)
    with pytest.raises(InvalidInput, match="completed, stopped, aborted, halted, failed"):
        recorder.close("running")


class _Frame(Parameters):
    """Some other type of point."""


def test_a_failing_disk_is_told_once_and_what_was_written_stays(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = begin(path)
    recorder(block(0, 1500))
    recorder(StateChanged(State.ARMED, State.RUNNING, "started", time=1.0))
    recorder.sync()

    def fail(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(hdf5, "append", fail)
        recorder(Warned("this cannot be written", time=2.0))
        with pytest.raises(DataFileError, match="No space left") as caught:
            recorder.sync()
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    recorder(StateChanged(State.RUNNING, State.ABORTING, "the disk is full", time=3.0))
    recorder.close("aborted")
    with open_datafile(path) as kept:
        assert kept.status == "running"
        assert kept.rows == 1500
        assert [event.kind for event in kept.events] == ["StateChanged"]


def test_other_files_are_refused_clearly(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="no such file"):
        open_datafile(tmp_path / "missing.h5")
    text = tmp_path / "text.h5"
    text.write_text("not HDF5")
    with pytest.raises(InvalidInput, match="not an HDF5 file"):
        open_datafile(text)
    foreign = tmp_path / "foreign.h5"
    with h5py.File(foreign, "w") as file:
        file["x"] = 1.0
    with pytest.raises(InvalidInput, match="not a data file of rocking-bench"):
        open_datafile(foreign)
    newer = tmp_path / "newer.h5"
    with h5py.File(newer, "w") as file:
        attrs: Any = file.attrs
        attrs["format"], attrs["format_version"] = "rocking-bench record", 99
    with pytest.raises(InvalidInput, match="99 is newer"):
        open_datafile(newer)
