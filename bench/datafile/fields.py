"""Fields of a row, with their types in the file, units and missing values, and the tables that grow during the run.

Rows are buffered in memory and written together.
"""

import dataclasses
import inspect
import zlib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import StrEnum
from hashlib import sha256
from itertools import chain
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from bench.datafile import hdf5
from bench.datafile.hdf5_reading import reading
from sim.errors import InvalidInput
from sim.parameters import Parameters, unit_of

TEXT_WIDTH = 512
"""Size of a string in a row [bytes]; longer strings are truncated with an ellipsis."""

ROWS_PER_CHUNK = 256
ROWS_PER_PACKED_CHUNK = 4096


class Kind(StrEnum):
    """Kinds of a field."""

    REAL = "real"
    WHOLE = "whole"
    SWITCH = "switch"
    TEXT = "text"


@dataclass(frozen=True)
class Field:
    """A field of a row. An absent number is stored as NaN, an absent switch as -1, and an absent string as empty.

    If `array` is true, each element of the value is a row. A `packed` field is compressed, in chunks of many rows.
    """

    name: str
    kind: Kind
    unit: str
    description: str
    optional: bool = False
    array: bool = False
    packed: bool = False

    @property
    def dtype(self) -> np.dtype[Any]:
        """The in-memory type of the stored values; integers that may be absent are float64, because they need NaN."""
        if self.kind is Kind.TEXT:
            return hdf5.text_type(TEXT_WIDTH)
        if self.kind is Kind.SWITCH:
            return np.dtype(np.int8)
        return np.dtype(np.int64 if self.kind is Kind.WHOLE and not self.optional else np.float64)

    def create(self, parent: hdf5.Group) -> hdf5.Dataset:
        """Create the empty dataset of this field, usually without compression, so that rows are appended in place."""
        if self.kind is Kind.TEXT:
            made = hdf5.grow_texts(
                parent, self.name, TEXT_WIDTH, description=self.description, chunk=ROWS_PER_CHUNK // 4
            )
        else:
            made = hdf5.grow_numbers(
                parent,
                self.name,
                self.dtype,
                unit=self.unit or "1",
                description=self.description,
                chunk=ROWS_PER_PACKED_CHUNK if self.packed else ROWS_PER_CHUNK,
                compress=self.packed,
            )
        hdf5.describe(made, kind=self.kind.value)
        made.attrs["optional"] = np.int8(self.optional)
        return made

    def encode(self, value: Any) -> Any:
        """The stored form of a value."""
        if self.kind is Kind.TEXT:
            return hdf5.clip_text("" if value is None else str(value), TEXT_WIDTH)
        if value is None:
            return -1 if self.kind is Kind.SWITCH else np.nan
        return value


def decode(stored: hdf5.Dataset) -> list[Any]:
    """The inverse of `encode` for the values of a field; absent values are None."""
    with reading(stored.name):
        return _decoded(Kind(stored.attrs["kind"]), bool(stored.attrs["optional"]), _read(stored))


def _decoded(kind: Kind, optional: bool, values: NDArray[Any]) -> list[Any]:
    if kind is Kind.TEXT:
        return [None if optional and not text else text for text in hdf5.read_texts(values)]
    if kind is Kind.SWITCH:
        return [None if value < 0 else bool(value) for value in values.tolist()]
    convert = int if kind is Kind.WHOLE else float
    return [None if optional and value != value else convert(value) for value in values.tolist()]


def field_of(name: str, stored: hdf5.Dataset) -> Field:
    """The field that a dataset stores."""
    with reading(stored.name):
        attrs = stored.attrs
        unit, told = str(attrs.get("units", "")), str(attrs["description"])
        return Field(name, Kind(attrs["kind"]), unit, told, bool(attrs["optional"]))


def fields_of(row_type: type[Any]) -> tuple[Field, ...]:
    """The fields of a group of parameters, or the columns of a dataclass (`sim.parameters.column`) other than its
    parts.

    Raises InvalidInput for types other than number, switch and string.
    """
    if issubclass(row_type, Parameters):
        declared = [
            (name, info.annotation, unit_of(info), info.description or "")
            for name, info in row_type.model_fields.items()
        ]
    else:
        parts = parts_of(row_type)
        declared = [
            (name, hint, about["unit"], about["description"])
            for name, hint, about in _columns(row_type)
            if parts is None or name != parts[0]
        ]
    fields: list[Field] = []
    for name, hint, unit, description in declared:
        array = _is_array(hint)
        kind, optional = (Kind.REAL, False) if array else _classify(f"{row_type.__name__}.{name}", hint)
        fields.append(Field(name, kind, unit, description, optional, array))
    return tuple(fields)


def parts_of(row_type: type[Any]) -> tuple[str, type[Any]] | None:
    """Name and item type of the column of a dataclass that is a tuple of dataclasses; None if there is no such
    column.
    """
    for name, hint, _ in _columns(row_type):
        if get_origin(hint) is tuple and dataclasses.is_dataclass(inner := get_args(hint)[0]):
            assert isinstance(inner, type)
            return name, inner
    return None


def _columns(row_type: type[Any]) -> list[tuple[str, Any, Mapping[str, str]]]:
    """Name, type and declaration of each field declared as a column."""
    hints = get_type_hints(row_type)
    declared = dataclasses.fields(row_type)
    return [(each.name, hints[each.name], each.metadata) for each in declared if "unit" in each.metadata]


def _is_array(hint: Any) -> bool:
    origin = get_origin(hint)
    # NDArray is a generic type in NumPy up to 2.4 and on Python 3.11, and an alias of a generic type later
    return np.ndarray in (origin, get_origin(getattr(origin, "__value__", None)))


def _read(stored: hdf5.Dataset) -> NDArray[Any]:
    return hdf5.read(stored, slice(None))


def _classify(item: str, annotation: Any) -> tuple[Kind, bool]:
    if get_origin(annotation) is Annotated:
        return _classify(item, get_args(annotation)[0])
    if get_origin(annotation) in (Union, UnionType):
        others = [part for part in get_args(annotation) if part is not NoneType]
        if len(others) == 1:
            return _classify(item, others[0])[0], True
    elif inspect.isclass(annotation):
        # bool is an int, and a string enumeration is a str: the order matters
        for types, kind in ((bool, Kind.SWITCH), (int, Kind.WHOLE), (float, Kind.REAL), (str, Kind.TEXT)):
            if issubclass(annotation, types):
                return kind, False
    raise InvalidInput(
        item, repr(annotation), "a recorded field must be a number, a switch or a text, or optionally None"
    )


THREADS = 2


class Packer:
    """Appends to compressed datasets; the compression runs in threads that start on demand."""

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
    """The bytes of chunks, shape (n, rows), after the filters `hdf5.FILTERS`: of each chunk the first bytes of all
    values, then the second bytes, and so on, compressed.
    """
    n, size = len(chunks), chunks.dtype.itemsize
    shuffled = np.ascontiguousarray(chunks).view(np.uint8).reshape(n, -1, size).transpose(0, 2, 1)
    return [zlib.compress(each, hdf5.FILTERS["compression_opts"]) for each in np.ascontiguousarray(shuffled)]


class Growing:
    """Appends rows to a dataset and hashes them, so that they need not be read again at the end of a long run."""

    def __init__(self, stored: hdf5.Dataset, packer: Packer | None = None) -> None:
        """`packer` compresses and writes complete chunks."""
        self._stored, self.path = stored, stored.name
        self._packer = packer
        self._digest = sha256()

    def reopen(self, file: hdf5.File) -> None:
        """Append to the dataset of the reopened file from now on."""
        self._stored = hdf5.dataset(file, self.path)

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
        # hashed through a view of bytes, because strings have no buffer
        self._digest.update(kept.view(np.uint8).data)


class Rows:
    """A group with one dataset per field."""

    def __init__(self, parent: hdf5.Group, name: str, fields: Sequence[Field]) -> None:
        group = hdf5.create_group(parent, name, "NXcollection")
        self._columns = [(field, Growing(field.create(group))) for field in fields]
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
                    # numbers are stored as they are
                    value if type(value) in (float, int) and not text else field.encode(value)
                    for field, text, value in zip(self._fields, self._texts, values, strict=True)
                ]
            )
        )

    def extend(self, *columns: NDArray[Any]) -> None:
        """Append many rows: one column per field, in order, all of equal length and without absent values."""
        self._pending += zip(*(column.tolist() for column in columns), strict=True)

    def write(self, *, partial: bool = True) -> None:  # noqa: ARG002 - uncompressed rows are appended in place
        """Write the buffered rows to the file; an incomplete chunk of packed fields is written only if `partial`."""
        if not self._pending:
            return
        for (field, stored), values in zip(self._columns, zip(*self._pending, strict=True), strict=True):
            stored.append(np.array(values, dtype=field.dtype))
        self._written += len(self._pending)
        self._pending.clear()


class PackedRows(Rows):
    """Rows of packed numbers, appended as arrays."""

    def __init__(self, parent: hdf5.Group, name: str, fields: Sequence[Field]) -> None:
        super().__init__(parent, name, fields)
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


def rows_of(parent: hdf5.Group, name: str, fields: Sequence[Field]) -> Rows:
    """Create a table of these fields."""
    return (PackedRows if all(field.packed for field in fields) else Rows)(parent, name, fields)
