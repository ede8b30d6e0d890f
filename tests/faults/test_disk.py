"""A disk that is slow or hangs never holds the drive up."""

import shutil
from collections.abc import Callable
from pathlib import Path
from threading import Thread

import pytest

from bench.datafile import recorder as recording
from bench.datafile.hdf5_reading import DataFileError
from bench.datafile.reader import open_datafile
from bench.datafile.recorder import Recorder
from bench.events import Warned
from drivers.rig import Channel
from tests.faults.disk import Disk, spoil
from tests.faults.setup import NoPoint
from tests.patience import LONG

SMALL, SHORT = 8, 0.05
"""Backlog [events], and patience of the recorder with a hung disk [s]."""


@pytest.fixture
def hung(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Recorder, Disk]:
    """A recorder whose disk hangs."""
    monkeypatch.setattr(recording, "BACKLOG", SMALL)
    monkeypatch.setattr(recording, "PATIENCE", SHORT)
    channel = Channel("laser_1", "displacement", "m", 1e-6, 0.0, (-32768, 32767), "")
    recorder = Recorder(tmp_path / "c.h5", channels=[channel], sample_rate=1000.0, point_type=NoPoint, metadata={})
    disk = Disk()
    spoil(recorder, disk)
    disk.free.clear()
    return recorder, disk


def _fill(recorder: Recorder) -> int:
    """Events that are taken before the recorder gives up."""
    taken: list[int] = []
    with pytest.raises(DataFileError, match="events behind"):
        _tell(recorder, taken)
    return len(taken)


def _tell(recorder: Recorder, taken: list[int]) -> None:
    for k in range(SMALL + 3):
        recorder(Warned(f"event {k}", time=float(k)))
        taken.append(k)


def _finish(recorder: Recorder, disk: Disk) -> None:
    disk.free.set()
    thread: Thread = recorder._thread  # pyright: ignore[reportPrivateUsage]
    thread.join(LONG)
    assert not thread.is_alive()


def test_a_full_backlog_is_told_once_and_at_once(hung: tuple[Recorder, Disk], monkeypatch: pytest.MonkeyPatch) -> None:
    recorder, disk = hung
    # longer than any test, if it were waited for
    monkeypatch.setattr(recording, "PATIENCE", 2.0 * LONG)
    # one event is in the hands of the thread, if it was quick
    assert _fill(recorder) in (SMALL, SMALL + 1)
    for k in range(100):
        recorder(Warned("after the failure", time=float(k)))
    monkeypatch.setattr(recording, "PATIENCE", SHORT)
    _finish_after_closing(recorder, disk)


def _finish_after_closing(recorder: Recorder, disk: Disk) -> None:
    recorder.close("failed", "the disk")
    _finish(recorder, disk)


@pytest.mark.parametrize(
    "end", [lambda recorder: recorder.sync(), lambda recorder: recorder.close("completed", "")], ids=["sync", "close"]
)
def test_nobody_waits_for_ever(end: Callable[[Recorder], None], hung: tuple[Recorder, Disk]) -> None:
    recorder, disk = hung
    recorder(Warned("one event", time=0.0))
    # otherwise never: the disk hangs until the test ends
    with pytest.raises(DataFileError, match="has not responded"):
        end(recorder)
    _finish_after_closing(recorder, disk)


def test_what_is_on_the_disk_is_readable_while_it_hangs_and_the_rest_comes_when_it_recovers(
    hung: tuple[Recorder, Disk], tmp_path: Path
) -> None:
    recorder, disk = hung
    taken = _fill(recorder)
    recorder.close("failed", "the disk hung")
    copy = tmp_path / "copy.h5"
    shutil.copy(recorder.path, copy)
    with open_datafile(copy) as record:
        assert (record.status, record.events) == ("running", [])
    _finish(recorder, disk)
    with open_datafile(recorder.path) as record:
        assert (record.status, record.summary) == ("failed", "the disk hung")
        assert [event.text for event in record.events] == [f"event {k}" for k in range(taken)]


def test_in_virtual_time_a_slow_disk_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording, "BACKLOG", SMALL)
    channel = Channel("laser_1", "displacement", "m", 1e-6, 0.0, (-32768, 32767), "")
    path = tmp_path / "c.h5"
    recorder = Recorder(path, channels=[channel], sample_rate=1e3, point_type=NoPoint, metadata={}, hold_up=LONG)
    for k in range(50 * SMALL):
        recorder(Warned(f"event {k}", time=float(k)))
    recorder.close("completed", "")
    with open_datafile(path) as record:
        assert len(record.events) == 50 * SMALL
