"""The data file: how fast it is written, how large it is, how soon it opens, beside plain h5py and numpy.

    python -m tests.benchmarks.files [--minutes 10] [--kills 0] [--folder DIR]

A bench of 6 channels at 20 000 samples/s: two lasers at 4 kHz on the sample clock with 3 counts of noise, and four
converters, of 16 bits with 2 counts of noise or of 24 bits with 80 (50 uV of 5 V). Peers get the same counts and
drive: h5py as most would use it, one dataset and gzip, and numpy.save. `--kills` kills so many writers besides.
"""

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
from numpy.typing import NDArray

import bench.datafile
from bench.datafile.inspection import verify
from bench.datafile.recorder import Recorder
from bench.events import Acquired
from drivers.rig import Block, Channel
from sim.parameters import Parameters, quantity

RATE, BLOCK, PERIOD = 20_000, 2_000, 60.0
"""Samples per second, samples in a block, and seconds after which the signals repeat: longer than gzip looks back."""
SPEED, SIZE, OPENING = 50.0, 150.0, 1.0
"""Required: at least MB/s, at most MB for ten minutes, at most seconds for 10 GB."""
LARGE = 10e9


class Nothing(Parameters):
    """No result."""

    number: int = quantity(0, "1", "unused")


def signals(bits: int) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """Counts of all channels, shape (n, 6), and the drive [V] of one period."""
    rng, n = np.random.default_rng(bits), round(PERIOD * RATE)
    t, slow = np.arange(n) / RATE, np.arange(n // 5) / 4000.0
    lasers = [np.interp(t, slow, 3000.0 * np.sin(15.0 * slow + k) + rng.normal(0.0, 3.0, slow.size)) for k in range(2)]
    amplitude, noise = (4e3, 2.0) if bits == 16 else (1e6, 80.0)
    others = [amplitude * np.sin(15.0 * t + k) + rng.normal(0.0, noise, n) for k in range(4)]
    counts = np.stack([*lasers, *others], axis=1).round().astype(np.int16 if bits == 16 else np.int32)
    return counts, 1.3 * np.sin(15.0 * t)


def channels(bits: int) -> list[Channel]:
    """Two lasers and four converters of `bits`."""
    ranges = [(-32768, 32767)] * 2 + [(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)] * 4
    return [Channel(f"channel_{k}", "displacement", "m", 1e-6, 0.0, valid, "") for k, valid in enumerate(ranges)]


def timed(work: Callable[[], None]) -> tuple[float, float]:
    """Seconds of wall clock and of CPU."""
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - cpu


def ours(path: Path, bits: int, counts: NDArray[Any], drive: NDArray[np.float64], blocks: int) -> None:
    recorder = Recorder(
        path, channels=channels(bits), sample_rate=RATE, point_type=Nothing, metadata={}, hold_up=3600.0
    )
    for k in range(blocks):
        part = slice(k * BLOCK % len(counts), k * BLOCK % len(counts) + BLOCK)
        recorder(Acquired(1, Block(k * BLOCK, counts[part]), drive[part], time=(k + 1) * BLOCK / RATE))
    recorder.close("completed", "")


def plain_h5py(path: Path, _: int, counts: NDArray[Any], drive: NDArray[np.float64], blocks: int) -> None:
    with h5py.File(path, "w") as file:
        options: dict[str, Any] = {"compression": "gzip", "chunks": True}
        stored = file.create_dataset("counts", (0, 6), maxshape=(None, 6), dtype=counts.dtype, **options)
        volts = file.create_dataset("drive", (0,), maxshape=(None,), dtype="f4", **options)
        for k in range(0, blocks, 10):
            part = slice(k * BLOCK % len(counts), k * BLOCK % len(counts) + 10 * BLOCK)
            for target, values in ((stored, counts[part]), (volts, drive[part])):
                target.resize(len(target) + len(values), axis=0)
                target[-len(values) :] = values
        file.flush()


def numpy_save(path: Path, _: int, counts: NDArray[Any], drive: NDArray[np.float64], blocks: int) -> None:
    repeats = blocks * BLOCK // len(counts)
    with path.open("wb") as file:
        np.save(file, np.tile(counts, (repeats, 1)))
        np.save(file, np.tile(drive.astype(np.float32), repeats))
        os.fsync(file.fileno())


def write(folder: Path, minutes: float) -> bool:
    """Write with each writer, print the table, and say whether the requirements are met."""
    blocks, good = round(60.0 * minutes * RATE / BLOCK), True
    print(
        f"{minutes:g} min of 6 channels at {RATE} samples/s and the drive; load {os.getloadavg()[0]:.1f} at the start"
    )
    print(f"{'':24}{'MB/s':>8}{'MB/CPU-s':>10}{'MB':>9}{'MB/10 min':>11}{'speed':>9}{'size':>7}")
    for bits in (16, 24):
        counts, drive = signals(bits)
        # what has to be kept: the converters' own width, 2 or 4 bytes, and the drive
        raw = blocks * BLOCK * ((12 if bits == 16 else 20) + 4) / 1e6
        mine: tuple[float, float] | None = None
        for name, writer in (("rockbench", ours), ("h5py, gzip 4", plain_h5py), ("numpy.save", numpy_save)):
            path = folder / "file"
            wall, cpu = timed(partial(writer, path, bits, counts, drive, blocks))
            size = path.stat().st_size / 1e6
            mine = mine or (raw / wall, size)
            print(
                f"{bits} bits, {name:15}{raw / wall:8.0f}{raw / cpu:10.0f}{size:9.1f}{size * 10.0 / minutes:11.1f}"
                f"{mine[0] * wall / raw:8.2f}x{size / mine[1]:6.2f}x"
            )
            if name == "rockbench":
                good &= raw / wall >= SPEED and size * 10.0 / minutes <= SIZE
                sound = verify(path)
                print(f"{'':10}every one of {sound.compared} datasets has its checksum: {not sound.problems}")
                good &= not sound.problems
            for left in folder.iterdir():
                left.unlink()
    print(
        f"speed: rockbench over the peer; size: the peer over rockbench. At least {SPEED:g} MB/s, at most {SIZE:g} MB"
    )
    return good


def grow(path: Path) -> None:
    """Make a short file as long as 10 GB of counts; what was not written is not stored, but counts for HDF5."""
    rows = round(LARGE / 16.0)
    with h5py.File(path, "r+") as plain:
        file: Any = plain
        for channel in channels(16):
            file[f"entry/instrument/{channel.name}/counts"].resize((rows,))
        for name in ("entry/instrument/drive/voltage", "entry/data/time"):
            file[name].resize((rows,))
        file["entry/complete"][0] = rows


def opening(folder: Path) -> bool:
    """Print how soon a large file opens, gives a second from its middle, and how much memory that takes."""
    import resource

    path = folder / "file"
    counts, drive = signals(16)
    ours(path, 16, counts, drive, 100)
    grow(path)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seconds = part = float("inf")
    for _ in range(3):
        start = time.perf_counter()
        with bench.datafile.open(path) as record:
            (run,) = record.runs
            seconds = min(seconds, time.perf_counter() - start)
            middle = len(run.rows) // 2
            part, _ = timed(lambda run=run, middle=middle: run.channels["channel_5"][middle : middle + RATE].sum())
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024.0
    print(f"10 GB of counts and drive (sparse): opens in {seconds:.3f} s, a second of a channel in {part:.3f} s,"
          f" memory grows by {grown:.0f} MB")  # fmt: skip
    return seconds < OPENING


def kill(folder: Path, count: int) -> bool:
    """Kill so many writers, and recover every file."""
    from bench.datafile.recovery import recover
    from tests.bench.datafile.living import as_fast_as_it_can, check, killed

    rng = np.random.default_rng()
    for number in range(count):
        path, clean = folder / f"{number}.h5", folder / f"{number} clean.h5"
        rows, points = killed(path, as_fast_as_it_can, float(rng.uniform(0.0, 0.3)))
        recover(path, clean)
        with bench.datafile.open(clean) as record:
            check(record, rows, points)
    print(f"killed {count} writers: {count} files recovered with all that was told to be written")
    return True


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--folder", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=given.folder) as name:
        met = [write(Path(name), given.minutes), opening(Path(name))]
        met += [kill(Path(name), given.kills)] if given.kills else []
    print("requirements " + ("met" if all(met) else "NOT MET"))
    sys.exit(0 if all(met) else 1)
