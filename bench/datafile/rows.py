"""Tables that grow during the run: rows are buffered in memory and written together."""

import zlib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, cached_property
from hashlib import sha256
from itertools import chain, count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.datafile import hdf5
from bench.datafile.fields import ROWS_PER_PACKED_CHUNK, Field, Kind

TABLE_CLASS = "NXcollection"
"""NeXus class of the group of a table."""

THREADS = 2

_NUMBERS = count()


class Packer:
    """Writer of compressed datasets; several chunks are compressed in parallel threads, which start on demand."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(THREADS, "record packer")

    def append(self, target: hdf5.Dataset, values: NDArray[Any]) -> None:
        """Append rows; complete chunks are compressed here, an incomplete chunk by h5py."""
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
        """End the threads without waiting for them."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _packed(self, chunks: NDArray[Any]) -> Iterator[bytes]:
        if len(chunks) < THREADS:
            return iter(pack(chunks))
        return chain.from_iterable(self._pool.map(pack, np.array_split(chunks, THREADS)))


def pack(chunks: NDArray[Any]) -> list[bytes]:
    """Apply the filters `hdf5.FILTERS` to `chunks` of shape (n, rows): for each chunk, the first bytes of all values,
    then the second bytes, and so on, compressed.

    Each result is padded with zeros, which decoders ignore after the end of the stream, to a whole number of pages of
    the file or to a half, a quarter ... of a page. HDF5 would otherwise keep a description of each unused remainder of
    a page in memory until the file is closed: 260 bytes per chunk.
    """
    n, size = len(chunks), chunks.dtype.itemsize
    shuffled = np.ascontiguousarray(chunks).view(np.uint8).reshape(n, -1, size).transpose(0, 2, 1)
    packed = [zlib.compress(each, hdf5.FILTERS["compression_opts"]) for each in np.ascontiguousarray(shuffled)]
    return [each.ljust(_allocated(len(each)), b"\0") for each in packed]


def _allocated(size: int) -> int:
    """Smallest multiple of a page, or power of two up to a page, that holds `size` bytes [bytes]."""
    return -(-size // hdf5.PAGE) * hdf5.PAGE if size > hdf5.PAGE else 1 << (size - 1).bit_length()


class Growing:
    """A growing dataset, whose checksum is updated with every append, so that its rows need not be read again at the
    end of a long run.
    """

    def __init__(self, file: hdf5.Group, path: str, packer: Packer | None = None) -> None:
        """`path` is the absolute path of the dataset; `packer`, if given, compresses and writes the appended rows."""
        self._file, self.path = file, path
        self._packer = packer
        self._digest = sha256()

    @cached_property
    def _stored(self) -> hdf5.Dataset:
        # opened with the first rows, because most tables of a run stay empty
        return hdf5.dataset(self._file, self.path)

    def reopen(self, file: hdf5.File) -> None:
        """Append to the dataset of the reopened file from now on."""
        self._file = file
        self.__dict__.pop("_stored", None)

    @property
    def checksum(self) -> str:
        """SHA-256 of the rows so far."""
        return self._digest.hexdigest()

    def append(self, values: NDArray[Any]) -> None:
        """Add rows at the end."""
        kept = np.ascontiguousarray(values, dtype=self._stored.dtype)
        if self._packer is None:
            hdf5.append(self._stored, kept)
        else:
            self._packer.append(self._stored, kept)
        # hashed as bytes, because string arrays do not support the buffer protocol
        self._digest.update(kept.view(np.uint8).data)


@cache
def _empty(fields: tuple[Field, ...]) -> str:
    """Name, in the file in memory, of an empty table with these fields.

    Tables of files are copies of it, which take a fifth of the time of creating them: a process may write many files.
    """
    name = str(next(_NUMBERS))
    group = hdf5.create_group(hdf5.memory_file(), name, TABLE_CLASS)
    for field in fields:
        field.create(group)
    return name


class Rows:
    """Table stored as a group with one dataset per field; `write` writes the buffered rows."""

    def __init__(self, parent: hdf5.Group, name: str, fields: Sequence[Field], packer: Packer | None = None) -> None:
        """`packer` compresses the datasets of fields that are declared as packed."""
        hdf5.copy_member(hdf5.memory_file(), _empty(tuple(fields)), parent, name)
        self._columns = [
            (field, Growing(parent, f"{parent.name}/{name}/{field.name}", packer if field.packed else None))
            for field in fields
        ]
        self._fields, self._texts = tuple(fields), tuple(field.kind is Kind.TEXT for field in fields)
        self._pending: list[tuple[Any, ...]] = []
        self._written = 0

    def __len__(self) -> int:
        return self._written + len(self._pending)

    @property
    def written(self) -> int:
        """Number of rows passed to the file."""
        return self._written

    @property
    def grown(self) -> list[Growing]:
        """Growing datasets of the group."""
        return [stored for _, stored in self._columns]

    def add(self, *values: Any) -> None:
        """Append one row: one value per field, in order; None for an absent value."""
        self._pending.append(
            tuple(
                [
                    # numbers need no encoding
                    value if type(value) in (float, int) and not text else field.encode(value)
                    for field, text, value in zip(self._fields, self._texts, values, strict=True)
                ]
            )
        )

    def extend(self, *columns: NDArray[Any]) -> None:
        """Append many rows: one column per field, in order, all of equal length and without absent values."""
        self._pending += zip(*(column.tolist() for column in columns), strict=True)

    def write(self, *, partial: bool = True) -> None:  # noqa: ARG002 - uncompressed rows are appended in place
        """Write the buffered rows to the file; if all fields are packed, an incomplete chunk only if `partial`."""
        if not self._pending:
            return
        for (field, stored), values in zip(self._columns, zip(*self._pending, strict=True), strict=True):
            stored.append(np.array(values, dtype=field.dtype))
        self._written += len(self._pending)
        self._pending.clear()


class PackedRows(Rows):
    """Table whose fields are all packed; rows are buffered as arrays."""

    def __init__(self, parent: hdf5.Group, name: str, fields: Sequence[Field], packer: Packer | None = None) -> None:
        super().__init__(parent, name, fields, packer)
        self._arrays: list[tuple[NDArray[Any], ...]] = []
        self._waiting = 0

    def __len__(self) -> int:
        return self._written + self._waiting

    def extend(self, *columns: NDArray[Any]) -> None:
        self._arrays.append(columns)
        self._waiting += len(columns[0])

    def write(self, *, partial: bool = True) -> None:
        # rewriting a compressed chunk leaves its first copy as unused space
        end = len(self) if partial else len(self) // ROWS_PER_PACKED_CHUNK * ROWS_PER_PACKED_CHUNK
        count = end - self._written
        if count <= 0:
            return
        columns = [np.concatenate(parts) for parts in zip(*self._arrays, strict=True)]
        for (_, stored), values in zip(self._columns, columns, strict=True):
            stored.append(values[:count])
        self._written = end
        self._waiting -= count
        self._arrays = [tuple(values[count:] for values in columns)] if self._waiting else []


def rows_of(parent: hdf5.Group, name: str, fields: Sequence[Field], packer: Packer | None = None) -> Rows:
    """Create a table of these fields; `packer` compresses the datasets of packed fields."""
    return (PackedRows if all(field.packed for field in fields) else Rows)(parent, name, fields, packer)
