"""A writer that is killed at any moment: nothing that was told to be written is lost, and a clean file comes of it."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bench.events import Acquired, PointFinished, State, StateChanged
from bench.record import diary
from bench.record.reader import open_record
from bench.record.recorder import Recorder
from bench.record.recovery import recover
from bench.record.verification import verify
from drivers.rig import Block, Channel
from protocols.harmonic.protocol import HarmonicPoint
from tests.bench.test_recorder_crash import BLOCK, NAMES, POINT, check, counts_of

pytestmark = pytest.mark.skipif(os.name != "posix", reason="forks and kills the POSIX way")
RATE = 2000.0
LONG = (pytest.mark.soak, pytest.mark.timeout(1200))


def begin(path: Path) -> Recorder:
    channels = [Channel(name, "displacement", "m", 1e-6, 0.0, (-32768, 32767), "") for name in NAMES]
    recorder = Recorder(path, channels=channels, sample_rate=RATE, point_type=HarmonicPoint, metadata={"seed": "1"})
    recorder(StateChanged(State.ARMED, State.RUNNING, "started", time=0.0))
    return recorder


def hand_over(recorder: Recorder, k: int) -> None:
    rows = np.arange(k * BLOCK, (k + 1) * BLOCK)
    counts = np.stack([counts_of(rows, channel) for channel in range(len(NAMES))], axis=1)
    recorder(Acquired(1, Block(int(rows[0]), counts), np.sin(0.01 * rows), time=0.1 * (k + 1)))


def as_fast_as_it_can(path: Path, tell: Callable[[int, int], None]) -> None:
    recorder = begin(path)
    for k in range(100_000):
        hand_over(recorder, k)
        if k % 7 == 6:
            recorder(PointFinished(POINT, time=0.1 * k))
            recorder.sync()
            tell((k + 1) * BLOCK, (k + 1) // 7)


def at_its_pace(path: Path, tell: Callable[[int, int], None]) -> None:
    recorder, start = begin(path), time.monotonic()
    for k in range(100_000):
        time.sleep(max(0.0, start + 0.1 * (k + 1) - time.monotonic()))
        hand_over(recorder, k)
        tell((k + 1) * BLOCK, 0)


def killed(path: Path, write: Callable[[Path, Callable[[int, int], None]], None], after: float) -> tuple[int, int]:
    """Let a process write, kill it `after` seconds from its first word, and return its last: rows and points."""
    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        write(path, lambda rows, points: os.write(writing, f"{rows} {points}\n".encode()) and None)
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as told:
        lines = [told.readline()]
        time.sleep(after)
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        lines += told.read().splitlines()
    rows, points = map(int, lines[-1].split())
    return rows, points


@pytest.mark.parametrize("kills", [8, *(pytest.param(16, marks=LONG, id=f"soak {k}") for k in range(4))])
def test_every_kill_leaves_what_was_told_and_a_clean_file_comes_of_it(tmp_path: Path, kills: int) -> None:
    # the moment is random by itself: the writer is another process
    rng, seen = np.random.default_rng(), set[int]()
    for number in range(kills):
        path, clean = tmp_path / f"{number}.h5", tmp_path / f"clean {number}.h5"
        rows, points = killed(path, as_fast_as_it_can, float(rng.uniform(0.0, 0.15)))
        before = path.read_bytes()
        with open_record(path) as record:
            assert record.status == "running"
            check(record, rows, points)
            kept = record.rows
        recover(path, clean)
        assert path.read_bytes() == before
        path.unlink()
        assert number % 8 or verify(clean).problems == ()
        with open_record(clean) as record:
            assert (record.status, record.rows) == ("interrupted", kept)
            check(record, rows, points)
            assert len(record.events) == len(list(diary.read(diary.beside(path))))
            assert len(record.points) == sum("point" in line for line in diary.read(diary.beside(path)))
        seen.add(rows)
    # at different moments, however busy the machine is
    assert len(seen) > 2


def test_at_most_the_last_second_is_lost_at_real_time(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    rows, _ = killed(path, at_its_pace, 2.3)
    recover(path, tmp_path / "clean.h5")
    with open_record(tmp_path / "clean.h5") as record:
        assert rows > 2.0 * RATE
        check(record, rows - int(RATE), 0)
