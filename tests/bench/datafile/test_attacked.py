"""What other programs do to the data file during a run ends the run with the reason; nobody hangs."""

import errno
import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from bench.datafile import hdf5, writer
from bench.datafile.access import locking
from bench.datafile.hdf5_reading import DataFileError
from bench.datafile.inspection import overview, verify
from bench.datafile.reader import open_datafile
from bench.datafile.recorder import Recorder
from bench.datafile.recovery import recover
from sim.errors import InvalidInput, RockbenchError
from tests.bench.datafile.living import begin, hand_over
from tests.patience import LONG

SOON = 5.0
"""Longest time for an answer about a damaged file [s]."""


def _truncate(to: float) -> Callable[[Path], None]:
    return lambda path: os.truncate(path, int(to * path.stat().st_size) if to < 1.0 else int(to))


def _replace(path: Path) -> None:
    other = path.with_name("other.h5")
    other.write_bytes(b"something else")
    other.replace(path)


ATTACKS: dict[str, tuple[Callable[[Path], object], str]] = {
    "truncated to nothing": (_truncate(0.0), "truncated it"),
    "truncated to its head": (_truncate(4096.0), "truncated it"),
    "truncated to half": (_truncate(0.5), "truncated it"),
    "renamed": (lambda path: path.rename(path.with_name("moved.h5")), "renamed it to moved.h5"),
    "deleted": (Path.unlink, "deleted it"),
    "replaced": (_replace, "replaced it"),
}


def _recording(path: Path, blocks: int = 20) -> Recorder:
    recorder = begin(path)
    for k in range(blocks):
        hand_over(recorder, k)
    recorder.sync()
    return recorder


@pytest.mark.parametrize("attack", ATTACKS)
def test_an_attack_on_the_file_of_a_run_is_its_next_error(attack: str, tmp_path: Path) -> None:
    act, says = ATTACKS[attack]
    path = tmp_path / "run.h5"
    recorder = _recording(path)
    act(path)
    hand_over(recorder, 20)
    with pytest.raises(DataFileError, match=says):
        recorder.sync()
    recorder.close("failed")


@pytest.mark.skipif(sys.platform != "linux", reason="finds the file of a handle in /proc")
def test_a_share_that_is_lost_is_the_next_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every look at the file fails, also when it is let go."""
    recorder = _recording(tmp_path / "run.h5")
    stat = os.fstat

    def stale(handle: int) -> os.stat_result:
        if os.readlink(f"/proc/self/fd/{handle}").endswith("run.h5"):
            raise OSError(errno.ESTALE, "Stale file handle")
        return stat(handle)

    monkeypatch.setattr(os, "fstat", stale)
    hand_over(recorder, 20)
    with pytest.raises(DataFileError, match="Stale file handle"):
        recorder.sync()
    recorder.close("failed")


@pytest.mark.parametrize("attack", ATTACKS)
def test_an_attack_just_before_the_end_is_the_error_of_closing(attack: str, tmp_path: Path) -> None:
    act, says = ATTACKS[attack]
    path = tmp_path / "run.h5"
    recorder = _recording(path)
    act(path)
    with pytest.raises(DataFileError, match=says):
        recorder.close("completed")


def test_a_deleted_file_is_written_again_and_can_be_recovered(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    recorder = _recording(path)
    path.unlink()
    with pytest.raises(DataFileError):
        recorder.close("completed")
    recover(path, tmp_path / "mended.h5")
    with open_datafile(tmp_path / "mended.h5") as record:
        assert record.rows == 20 * 200


_AMID = """
import os, sys, time
from contextlib import suppress
from pathlib import Path
from bench.datafile.hdf5_reading import DataFileError
from tests.bench.datafile.living import begin, hand_over

def cutting(path, size):
    recorder = begin(path)
    samples = recorder._writer._parts.samples
    write, count = samples.write, []
    def cut(partial):
        count.append(1)
        if len(count) == 4:
            os.truncate(path, size)
        write(partial=partial)
    samples.write = cut
    return recorder

recorders = [cutting(Path(sys.argv[1], f"{size}.h5"), size) for size in (0, 4096, 50_000)]
for k in range(40):
    for recorder in recorders:
        with suppress(DataFileError):
            hand_over(recorder, k)
    time.sleep(0.05)
for recorder in recorders:
    with suppress(DataFileError):
        recorder.close("completed")
print("over")
"""


def test_files_that_are_truncated_while_they_are_written_do_not_stop_the_process(tmp_path: Path) -> None:
    """HDF5 holds the interpreter while it searches for what is cut off, and the engine with it."""
    done = subprocess.run([sys.executable, "-c", _AMID, str(tmp_path)], timeout=LONG, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "over\n"), done.stderr


SHARES = (0.0, 0.001, 0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 0.999)


@pytest.mark.seconds
@pytest.mark.parametrize("shares", [(0.0, 0.01, 0.5, 0.999), pytest.param(SHARES, marks=pytest.mark.soak)])
def test_readers_of_a_truncated_file_refuse_it_soon(tmp_path: Path, shares: tuple[float, ...]) -> None:
    path, cut = tmp_path / "run.h5", tmp_path / "cut.h5"
    recorder = _recording(path)
    whole = path.read_bytes()
    for share in shares:
        cut.write_bytes(whole[: int(share * len(whole))])
        begun = time.monotonic()
        for read in (overview, open_datafile):
            with pytest.raises(RockbenchError):
                read(cut)
        with suppress(RockbenchError):
            assert verify(cut).problems
        assert time.monotonic() - begun < SOON
    recorder.close("completed")


@pytest.mark.seconds
def test_a_reader_that_follows_a_file_notices_that_it_is_truncated(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    recorder = _recording(path)
    with open_datafile(path) as record:
        record.refresh()
        os.truncate(path, 4096)
        begun = time.monotonic()
        with pytest.raises(DataFileError, match="truncated"):
            record.refresh()
        assert time.monotonic() - begun < SOON
    with pytest.raises(DataFileError):
        recorder.close("completed")


def test_nobody_locks_a_file_where_locks_are_mandatory() -> None:
    assert locking("win32") is False
    assert locking("linux") == "best-effort"


@pytest.mark.skipif(sys.platform == "win32", reason="locks of the whole file, as HDF5 makes them on other systems")
def test_a_reader_that_locks_the_file_while_it_is_created_does_not_end_the_recording(tmp_path: Path) -> None:
    import fcntl

    path = tmp_path / "run.h5"
    file = hdf5.create(path)
    with path.open("rb") as reader:
        fcntl.flock(reader, fcntl.LOCK_SH | fcntl.LOCK_NB)
        file.close()
        file = hdf5.open_to_write(path)
        file.flush()
    file.close()


@pytest.fixture
def meanwhile(monkeypatch: pytest.MonkeyPatch) -> list[Callable[[], object]]:
    """What another program does while a file is created."""
    steps, build = list[Callable[[], object]](), writer.build

    def interrupted(*arguments: Any) -> Any:
        for step in steps:
            step()
        return build(*arguments)

    monkeypatch.setattr(writer, "build", interrupted)
    return steps


def test_a_file_has_its_name_only_when_it_can_be_read(tmp_path: Path, meanwhile: list[Callable[[], object]]) -> None:
    path, found = tmp_path / "run.h5", list[bool]()
    meanwhile.append(lambda: found.append(path.exists()))
    recorder = begin(path)
    assert found == [False]
    with open_datafile(path) as record:
        assert record.rows == 0
    recorder.close("completed")
    assert {each.name for each in tmp_path.iterdir()} == {"run.h5", "run.events.jsonl"}


def _no_links(*_: Any) -> None:
    raise OSError(errno.EPERM, os.strerror(errno.EPERM))


@pytest.mark.parametrize("link", [os.link, _no_links])
def test_a_file_that_another_program_creates_meanwhile_is_kept(
    link: Callable[..., None], tmp_path: Path, meanwhile: list[Callable[[], object]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "link", link)
    path = tmp_path / "run.h5"
    meanwhile.append(lambda: path.write_bytes(b"theirs"))
    with pytest.raises(InvalidInput, match="never overwritten"):
        begin(path)
    assert path.read_bytes() == b"theirs"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_can_be_created_where_there_are_no_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "link", _no_links)
    path = tmp_path / "run.h5"
    begin(path).close("completed")
    assert verify(path).problems == ()
    assert {each.name for each in tmp_path.iterdir()} == {"run.h5", "run.events.jsonl"}
