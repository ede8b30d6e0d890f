"""How one field of a row is stored: its type in the file, its unit, and what stands for an absent value."""

import inspect
from dataclasses import dataclass
from enum import StrEnum
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

from bench.record import hdf5
from bench.record.errors import reading
from sim.errors import InvalidInput
from sim.parameters import Parameters, unit_of

TEXT_WIDTH = 512
"""Bytes kept of a text in a row: a sentence or three; longer ones are cut and end with an ellipsis."""

ROWS_PER_CHUNK = 256


class Kind(StrEnum):
    """What a field holds."""

    REAL = "real"
    WHOLE = "whole"
    SWITCH = "switch"
    TEXT = "text"


@dataclass(frozen=True)
class Field:
    """One field. When it is absent, a number is NaN, a switch -1, and a text empty."""

    name: str
    kind: Kind
    unit: str
    description: str
    optional: bool = False

    @property
    def dtype(self) -> np.dtype[Any]:
        """The type in memory of the stored values; whole numbers that may be absent need NaN, so they are float64."""
        if self.kind is Kind.TEXT:
            return hdf5.text_type(TEXT_WIDTH)
        if self.kind is Kind.SWITCH:
            return np.dtype(np.int8)
        return np.dtype(np.int64 if self.kind is Kind.WHOLE and not self.optional else np.float64)

    def create(self, parent: hdf5.Group) -> hdf5.Dataset:
        """The empty dataset of this field. It is not compressed, so that appending rewrites it in place."""
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
                chunk=ROWS_PER_CHUNK,
                compress=False,
            )
        made.attrs["kind"], made.attrs["optional"] = self.kind.value, np.int8(self.optional)
        return made

    def encode(self, value: Any) -> Any:
        """A value as it is stored."""
        if self.kind is Kind.TEXT:
            return hdf5.clip_text("" if value is None else str(value), TEXT_WIDTH)
        if value is None:
            return -1 if self.kind is Kind.SWITCH else np.nan
        return value


def decode(stored: hdf5.Dataset) -> list[Any]:
    """The values of a field as they were before `encode`, absent ones None."""
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
    """The field that a dataset was made for."""
    with reading(stored.name):
        attrs = stored.attrs
        unit, told = str(attrs.get("units", "")), str(attrs["description"])
        return Field(name, Kind(attrs["kind"]), unit, told, bool(attrs["optional"]))


def fields_of(row_type: type[Parameters]) -> tuple[Field, ...]:
    """The fields of a declared group of parameters. Raises InvalidInput for what is no number, switch or text."""
    fields: list[Field] = []
    for name, info in row_type.model_fields.items():
        kind, optional = _classify(f"{row_type.__name__}.{name}", info.annotation)
        fields.append(Field(name, kind, unit_of(info), info.description or "", optional))
    return tuple(fields)


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
        # bool is an int, and an enumeration of texts is a str: the order matters
        for types, kind in ((bool, Kind.SWITCH), (int, Kind.WHOLE), (float, Kind.REAL), (str, Kind.TEXT)):
            if issubclass(annotation, types):
                return kind, False
    raise InvalidInput(
        item, repr(annotation), "a recorded field must be a number, a switch or a text, or one of them or None"
    )
