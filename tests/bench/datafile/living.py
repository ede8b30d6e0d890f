"""Writers of data files in processes of their own, and a comparison of what they leave."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.datafile.reader import DataFile
from bench.datafile.recorder import Recorder
from bench.events import Acquired, PointFinished, State, StateChanged
from drivers.rig import Block, Channel
from protocols.harmonic.protocol import HarmonicPoint, PointStatus

NAMES = ("storey 1", "storey 2")
BLOCK = 200
POINT = HarmonicPoint(omega_rad_s=12.5, beta=0.25, status=PointStatus.STEADY, layer="rocking", alpha_2=0.5)


def counts_of(rows: NDArray[np.int64], channel: int) -> NDArray[np.int16]:
    """What the writer records in a row: every row of 2^16 has its own value."""
    return ((rows * 40503 + channel * 1000) % 65536 - 32768).astype(np.int16)


def check(record: DataFile, rows: int, points: int) -> None:
    """At least so many rows and points are there, and all that is there is what was recorded."""
    assert record.rows >= rows
    index = np.arange(record.rows)
    for channel, name in enumerate(NAMES):
        np.testing.assert_array_equal(record.counts(name), counts_of(index, channel))
    np.testing.assert_array_equal(record.drive(), np.sin(0.01 * index).astype(np.float32))
    np.testing.assert_array_equal(record.time(), index / 2000.0)
    stored = record.points
    assert len(stored) >= points
    assert all(HarmonicPoint.model_validate(point) == POINT for point in stored)
    assert record.events[0].kind == "StateChanged"
    assert record.metadata == {"seed": "1"}


RATE = 2000.0


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
