"""A writer that dies, a disk that is full, and a reader beside a living writer: with real processes."""

import os
import subprocess
import sys
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from bench.datafile.hdf5_reading import DataFileError
from bench.datafile.reader import open_datafile
from bench.datafile.recorder import Recorder
from bench.events import Acquired, PointFinished, State, StateChanged
from drivers.rig import Block, Channel
from protocols.harmonic.protocol import HarmonicPoint
from tests.bench.datafile.living import BLOCK, NAMES, POINT, check, counts_of
from tests.patience import LONG

ROOT = Path(__file__).parents[3]
POSIX_ONLY = pytest.mark.skipif(os.name != "posix", reason="kills and limits processes the POSIX way")


def write_for_ever(path: Path, pause: float) -> None:
    """The writing process. It prints how many rows and points are certain to be in the file."""
    channels = [Channel(name, "displacement", "m", 1e-6, 0.0, (-32768, 32767), "") for name in NAMES]
    recorder = Recorder(path, channels=channels, sample_rate=2000.0, point_type=HarmonicPoint, metadata={"seed": "1"})
    recorder(StateChanged(State.ARMED, State.RUNNING, "started", time=0.0))
    for k in range(100_000):
        rows = np.arange(k * BLOCK, (k + 1) * BLOCK)
        counts = np.stack([counts_of(rows, channel) for channel in range(len(NAMES))], axis=1)
        recorder(Acquired(1, Block(int(rows[0]), counts), np.sin(0.01 * rows), time=0.1 * k))
        if k % 25 == 24:
            recorder(PointFinished(POINT, time=0.1 * k))
            recorder.sync()
            # the whole chunks of 1000 rows that were complete when the point came
            print((k + 1) * BLOCK // 1000 * 1000, (k + 1) // 25, flush=True)
        time.sleep(pause)


def write_until_the_disk_is_full(path: Path) -> None:
    """The writing process with a limit on the size of files; it prints the error and how it went on."""
    import resource
    import signal

    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))
    try:
        write_for_ever(path, 0.0)
    except DataFileError as error:
        print(f"error: {error}", flush=True)


@contextmanager
def writer(path: Path, mode: str) -> Generator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "tests.bench.datafile.test_recorder_crash", mode, str(path)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


@POSIX_ONLY
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(1, 4))])
def test_what_was_flushed_survives_a_killed_writer(tmp_path: Path, seed: int) -> None:
    path, rng = tmp_path / "campaign.h5", np.random.default_rng(seed)
    with writer(path, "pace") as process:
        assert process.stdout is not None
        told = process.stdout.readline()
        for _ in range(int(rng.integers(0, 12))):
            told = process.stdout.readline()
        time.sleep(float(rng.uniform(0.0, 0.2)))
        process.kill()
        told = (told + process.stdout.read()).splitlines()[-1]
    with open_datafile(path) as record:
        assert record.status == "running"
        check(record, *map(int, told.split()))


@POSIX_ONLY
def test_a_living_file_can_be_read_and_grows(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    with writer(path, "pace") as process:
        assert process.stdout is not None
        rows, points = map(int, process.stdout.readline().split())
        with open_datafile(path) as record:
            for _ in range(4):
                check(record, rows, points)
                rows, points = map(int, process.stdout.readline().split())
                record.refresh()
            check(record, rows, points)
            assert record.status == "running"


@POSIX_ONLY
def test_a_full_disk_ends_with_one_error_and_a_readable_file(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    with writer(path, "full") as process:
        output, _ = process.communicate(timeout=LONG)
    *told, error = output.splitlines()
    assert process.returncode == 0
    assert error.startswith("error: ")
    assert str(path) in error
    assert len(told) > 2
    with open_datafile(path) as record:
        check(record, *map(int, told[-1].split()))


if __name__ == "__main__":
    if sys.argv[1] == "full":
        write_until_the_disk_is_full(Path(sys.argv[2]))
    else:
        write_for_ever(Path(sys.argv[2]), 0.001)
