"""Whole chunks, packed by two threads as the filters of HDF5 would do it in one: shuffle, then gzip.

zlib lets go of Python's lock while it works, HDF5 of none while it filters.
"""

import zlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.record import hdf5

THREADS = 2


class Packer:
    """Appends to compressed datasets. Its threads begin when there is work for them."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(THREADS, "record packer")

    def append(self, target: hdf5.Dataset, values: NDArray[Any]) -> None:
        """Add rows at the end; what makes no whole chunk goes the ordinary way."""
        start, chunk = target.shape[0], (target.chunks or (1,))[0]
        head = min(-start % chunk, len(values))
        whole = (len(values) - head) // chunk
        body, tail = values[head : head + whole * chunk], values[head + whole * chunk :]
        if head:
            hdf5.append(target, values[:head])
        if whole:
            hdf5.append_chunks(target, self._packed(body.reshape(whole, chunk)), whole, chunk)
        if len(tail):
            hdf5.append(target, tail)

    def close(self) -> None:
        """End the threads; none of them is waited for."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _packed(self, chunks: NDArray[Any]) -> Iterator[bytes]:
        return map(pack, chunks) if len(chunks) == 1 else self._pool.map(pack, chunks)


def pack(values: NDArray[Any]) -> bytes:
    """A chunk as HDF5 stores it behind `hdf5.FILTERS`: the first bytes of all values, then the second, and so on."""
    shuffled = np.ascontiguousarray(values).view(np.uint8).reshape(-1, values.dtype.itemsize).T
    return zlib.compress(shuffled.tobytes(), hdf5.FILTERS["compression_opts"])
