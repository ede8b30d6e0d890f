"""A power failure: of the pages written since the disk was last told to keep them, any may have reached it.

Each `fsync` is one state of the disk. Between two of them every subset of the pages that differ is possible; here
random ones. A sector is whole or not: disks promise that much.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.datafile.reader import open_datafile
from bench.datafile.recovery import recover
from bench.datafile.samples import CHUNK_TIME
from bench.events import PointFinished
from tests.bench.datafile.example import CHANNELS, FULL, RATE, begin, block

SECTOR = 4096
BLOCKS = 120


@pytest.fixture(scope="module")
def states(tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    """The file at every `fsync` of a campaign."""
    path, found = tmp_path_factory.mktemp("power") / "campaign.h5", list[bytes]()

    def keep(handle: int) -> None:
        if path.exists() and os.fstat(handle).st_ino == path.stat().st_ino:
            found.append(path.read_bytes())

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(os, "fsync", keep)
        recorder = begin(path)
        for k in range(BLOCKS):
            recorder(block(100 * k, 100, time=0.05 * (k + 1)))
            if k % 40 == 20:
                recorder(PointFinished(FULL, time=0.05 * k))
            if k % 10 == 9:
                recorder.sync()
        recorder.close("completed")
    return found


def torn(before: bytes, after: bytes, rng: np.random.Generator) -> bytes:
    """`before` with some of the sectors of `after`; the file may have grown already."""
    size = -(-max(len(before), len(after)) // SECTOR) * SECTOR
    old, new = (np.frombuffer(each.ljust(size, b"\0"), np.uint8).reshape(-1, SECTOR) for each in (before, after))
    chosen = rng.random(len(old)) < rng.choice([0.1, 0.5, 0.9])
    return np.where(chosen[:, None], new, old).tobytes()


def rows_in(folder: Path, content: bytes) -> int:
    path = folder / "whole.h5"
    path.write_bytes(content)
    with open_datafile(path, judging=True) as record:
        return record.rows


def hold(folder: Path, states: list[bytes], seed: int, expected: NDArray[np.int16]) -> None:
    rng = np.random.default_rng(seed)
    at = int(rng.integers(2, len(states) - 1))
    path, clean = folder / f"{seed}.h5", folder / f"{seed} clean.h5"
    path.write_bytes(torn(states[at], states[at + 1], rng))
    least = rows_in(folder, states[at])
    recover(path, clean)
    with open_datafile(clean) as record:
        # a chunk that was stored before it was full is stored again elsewhere, and may be lost between the two
        assert record.rows >= least - CHUNK_TIME * RATE
        for column, channel in enumerate(CHANNELS):
            np.testing.assert_array_equal(record.counts(channel.name), expected[: record.rows, column])


@pytest.mark.skipif(os.name != "posix", reason="tells files apart by their inode")
@pytest.mark.parametrize(
    "seeds", [range(2), *(pytest.param(range(k, k + 24), marks=pytest.mark.soak) for k in range(2, 194, 24))]
)
def test_what_the_disk_had_kept_survives(states: list[bytes], tmp_path: Path, seeds: range) -> None:
    expected = np.concatenate([block(100 * k, 100).block.counts for k in range(BLOCKS)])
    for seed in seeds:
        hold(tmp_path, states, seed, expected)
