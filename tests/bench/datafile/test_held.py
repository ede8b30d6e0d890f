"""Readers that lock the file, where locks forbid writing: the writer keeps them out, or waits, or gives the reason."""

import errno
import os
import sys
from functools import partial
from pathlib import Path

import pytest

from bench.datafile.hdf5_reading import DataFileError
from bench.datafile.held import is_held, wait_until_free
from bench.datafile.inspection import verify
from bench.datafile.recorder import Recorder
from tests.bench.datafile.held_files import compiled, write_under_readers
from tests.bench.datafile.living import begin, hand_over

REFUSED = PermissionError(errno.EACCES, "Permission denied")


@pytest.fixture(scope="module")
def mandatory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not sys.platform.startswith("linux") or (found := compiled(tmp_path_factory.mktemp("locks"))) is None:
        pytest.skip("mandatory locks are made with LD_PRELOAD and a C compiler")
    return found


def test_three_locking_readers_do_not_end_a_recording(mandatory: Path, tmp_path: Path) -> None:
    found = write_under_readers(tmp_path / "run.h5", mandatory, flushes=30, readers=3, hold=0.01)
    assert found["flushes"] == 30
    assert not verify(tmp_path / "run.h5").problems


def test_without_the_guard_a_lock_of_a_reader_ends_the_recording(mandatory: Path, tmp_path: Path) -> None:
    """The locks of this test forbid writing: else the one above would prove nothing."""
    with pytest.raises(AssertionError, match=r"another program has locked it|slist"):
        write_under_readers(
            tmp_path / "run.h5", mandatory, flushes=300, readers=3, hold=0.05, guard="open", patience=0.1
        )


def _refuse(recorder: Recorder, times: float) -> list[int]:
    """Make the next writes fail as those of a locked file do; counts them."""
    sync, count = recorder._writer._file_sync, [0]
    touch = sync.touch

    def touched() -> None:
        count[0] += 1
        if count[0] <= times:
            raise REFUSED
        touch()

    sync.touch = touched  # type: ignore[method-assign]
    return count


def test_a_file_that_is_held_for_a_moment_is_written_later(tmp_path: Path) -> None:
    recorder = begin(tmp_path / "run.h5")
    count = _refuse(recorder, 3)
    hand_over(recorder, 0)
    recorder.sync()
    assert count[0] >= 4
    recorder.close("completed")
    assert not verify(tmp_path / "run.h5").problems


@pytest.mark.parametrize("at", ["flush", "close"])
def test_a_file_that_stays_held_is_the_reason_of_the_end(
    at: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bench.datafile.held.HELD", 0.1)
    recorder = begin(tmp_path / "run.h5")
    hand_over(recorder, 0)
    recorder.sync()
    _refuse(recorder, float("inf"))
    hand_over(recorder, 1)
    end = recorder.sync if at == "flush" else partial(recorder.close, "completed")
    with pytest.raises(DataFileError, match=r"another program has locked it \(errno 13\)") as raised:
        end()
    assert "it remained locked for 0.1 s" in str(raised.value)
    recorder.close("completed")


def test_an_error_of_hdf5_itself_gives_the_same_reason(tmp_path: Path) -> None:
    said = (
        "Unable to synchronously flush file (file write failed: filename = 'run.h5', errno = 13, error message = ...)"
    )
    recorder = begin(tmp_path / "run.h5")
    hand_over(recorder, 0)
    recorder.sync()

    def fails() -> None:
        raise RuntimeError(said)

    recorder._writer._file_sync.sync = fails  # type: ignore[method-assign]
    hand_over(recorder, 1)
    with pytest.raises(DataFileError, match="close the program that displays or scans it"):
        recorder.sync()
    recorder.close("failed")


def test_other_errors_are_not_waited_for() -> None:
    def fails() -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(OSError, match="No space"):
        wait_until_free(fails)
    assert not is_held(RuntimeError("errno = 135"))
