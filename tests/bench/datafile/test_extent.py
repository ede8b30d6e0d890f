"""Where the rows of a dataset are in its file is looked up once, however long it is."""

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from bench.datafile.opening import intact_rows

CHUNK = 16


class CountedDataset:
    """A dataset, and the calls of its HDF5 identifier by name."""

    def __init__(self, stored: h5py.Dataset) -> None:
        self._stored, self.calls = stored, Counter[str]()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stored, name)

    @property
    def id(self) -> "CountedIdentifier":
        return CountedIdentifier(self._stored.id, self.calls)


class CountedIdentifier:
    def __init__(self, identifier: Any, calls: Counter[str]) -> None:
        self._identifier, self._calls = identifier, calls

    def __getattr__(self, name: str) -> Callable[..., object]:
        self._calls[name] += 1
        return getattr(self._identifier, name)


def grown(file: h5py.File, chunks: int) -> h5py.Dataset:
    stored = file.create_dataset(f"of {chunks}", shape=(0,), maxshape=(None,), chunks=(CHUNK,), dtype="i4")
    stored.resize((chunks * CHUNK,))
    stored[:] = np.arange(chunks * CHUNK)
    return stored


@pytest.mark.parametrize("libver", ["earliest", "v110"])
def test_the_work_in_the_index_does_not_grow_with_the_chunks(tmp_path: Path, libver: str) -> None:
    with h5py.File(tmp_path / "file.h5", "w", libver=libver) as file:
        asked: list[int] = []
        for chunks in (3, 3000):
            counted = CountedDataset(grown(file, chunks))
            assert intact_rows(counted, 10**9) == chunks * CHUNK  # pyright: ignore[reportArgumentType]
            asked.append(counted.calls.total())
        assert asked == [1, 1]


@pytest.mark.parametrize("libver", ["earliest", "v110"])
def test_rows_end_at_the_first_chunk_that_is_not_in_the_file(tmp_path: Path, libver: str) -> None:
    with h5py.File(tmp_path / "file.h5", "w", libver=libver) as file:
        stored = grown(file, 40)
        ends = [info.byte_offset + info.size for info in (stored.id.get_chunk_info(i) for i in range(40))]
        assert intact_rows(stored, max(ends)) == 40 * CHUNK  # pyright: ignore[reportArgumentType]
        for size in (ends[0] - 1, ends[17], ends[39] - 1):
            first = next(i for i in range(40) if ends[i] > size)
            assert intact_rows(stored, size) == first * CHUNK  # pyright: ignore[reportArgumentType]
        # rows that were made room for and never written are in no chunk
        stored.resize((45 * CHUNK,))
        assert intact_rows(stored, 10**9) == 40 * CHUNK  # pyright: ignore[reportArgumentType]
