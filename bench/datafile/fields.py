"""Fields of a row, with their types in the file, units and missing values."""

import dataclasses
import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
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
    """Kind of a field's values: real numbers, integers, switches or strings."""

    REAL = "real"
    WHOLE = "whole"
    SWITCH = "switch"
    TEXT = "text"


@dataclass(frozen=True)
class Field:
    """A field of a row. An absent number is stored as NaN, an absent switch as -1, and an absent string as an empty
    string.

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
        """The in-memory type of the stored values; integers that may be absent are float64, because they need NaN.

        All strings have a fixed length, because HDF5 stores variable-length strings separately from their dataset and a
        reader of a file that is being written may find one without the other.
        """
        if self.kind is Kind.TEXT:
            return hdf5.text_type(TEXT_WIDTH)
        if self.kind is Kind.SWITCH:
            return np.dtype(np.int8)
        return np.dtype(np.int64 if self.kind is Kind.WHOLE and not self.optional else np.float64)

    @property
    def attributes(self) -> dict[str, str | np.int8]:
        """The attributes of this field's dataset, in the order in which they are written."""
        unit = {} if self.kind is Kind.TEXT else {"units": self.unit or "1"}
        about = {"description": self.description, "kind": self.kind.value}
        return {**unit, **about, "optional": np.int8(self.optional)}

    def create(self, parent: hdf5.Group) -> None:
        """Create the empty dataset of this field, without compression unless packed, so that rows are appended in
        place.
        """
        chunk = ROWS_PER_PACKED_CHUNK if self.packed else ROWS_PER_CHUNK
        rows = chunk // 4 if self.kind is Kind.TEXT else chunk
        hdf5.grow(parent, self.name, self.dtype, rows, compress=self.packed, attributes=self.attributes)

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
        return _decoded(Kind(stored.attrs["kind"]), bool(stored.attrs["optional"]), hdf5.read(stored, slice(None)))


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
        about = hdf5.attributes(stored)
        unit, description = str(about.get("units", "")), str(about["description"])
        return Field(name, Kind(about["kind"]), unit, description, bool(about["optional"]))


def values_of(field: Field, stored: hdf5.Dataset) -> list[Any]:
    """The values of a field that `field_of` has read from its dataset; absent values are None."""
    with reading(stored.name):
        return _decoded(field.kind, field.optional, hdf5.read(stored, slice(None)))


def fields_from(declared: Any) -> tuple[Field, ...]:
    """Fields from the journal, where they are stored as JSON; empty if they are not valid."""
    fields = list[Field]()
    try:
        for each in declared:
            given = dict[str, Any](each)
            name = given["name"] + ""
            if not (name.isidentifier() and isinstance(given["unit"] + given["description"], str)):
                return ()
            given["kind"] = Kind(given["kind"])
            fields.append(Field(**given))
    except (TypeError, ValueError, KeyError, AttributeError):
        return ()
    return tuple(fields) if len({each.name for each in fields}) == len(fields) else ()


@lru_cache(maxsize=256)
def fields_of(row_type: type[Any]) -> tuple[Field, ...]:
    """The fields of a group of parameters, or the columns of a dataclass (`sim.parameters.column`) other than its
    parts.

    Raises InvalidInput for types other than number, switch, string and array of numbers.
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
    """Name and item type of the column whose value is a tuple of dataclasses; None if the dataclass has no such
    column.
    """
    for name, hint, _ in _columns(row_type):
        if get_origin(hint) is tuple and dataclasses.is_dataclass(inner := get_args(hint)[0]):
            assert isinstance(inner, type)
            return name, inner
    return None


@lru_cache(maxsize=256)
def _columns(row_type: type[Any]) -> tuple[tuple[str, Any, Mapping[str, str]], ...]:
    """Name, type and declaration of each field declared as a column."""
    hints = get_type_hints(row_type)
    declared = dataclasses.fields(row_type)
    return tuple((each.name, hints[each.name], each.metadata) for each in declared if "unit" in each.metadata)


def _is_array(hint: Any) -> bool:
    origin = get_origin(hint)
    # NDArray is a generic type in NumPy up to 2.4 and on Python 3.11, and an alias of a generic type later
    return np.ndarray in (origin, get_origin(getattr(origin, "__value__", None)))


def _classify(item: str, annotation: Any) -> tuple[Kind, bool]:
    if get_origin(annotation) is Annotated:
        return _classify(item, get_args(annotation)[0])
    if get_origin(annotation) in (Union, UnionType):
        others = [part for part in get_args(annotation) if part is not NoneType]
        if len(others) == 1:
            return _classify(item, others[0])[0], True
    elif inspect.isclass(annotation):
        # bool is a subclass of int and must come first; a string enumeration is recorded as a str
        for types, kind in ((bool, Kind.SWITCH), (int, Kind.WHOLE), (float, Kind.REAL), (str, Kind.TEXT)):
            if issubclass(annotation, types):
                return kind, False
    raise InvalidInput(
        item,
        repr(annotation),
        "a recorded field must be a number, a switch or a string (or None), or an array of numbers",
    )
