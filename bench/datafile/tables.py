"""Tables stored before the run, such as the prediction: named columns with units."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.datafile import hdf5


@dataclass(frozen=True)
class Column:
    """A column: `values` of shape (n,) are numbers, booleans or strings; `unit` is "1" for a pure number."""

    values: NDArray[Any]
    unit: str
    description: str


Table = Mapping[str, Column]
"""Columns of equal length by name."""


def check(name: str, table: Table) -> None:
    """Raise InvalidInput unless the columns are one-dimensional and of equal length, and numbers have a unit."""
    lengths: set[int] = set()
    for key, column in table.items():
        item, values = f"column {key} of table {name}", column.values
        if values.ndim != 1 or values.dtype.kind not in "fiubU":
            raise InvalidInput(
                item,
                (values.shape, str(values.dtype)),
                "it must be a one-dimensional array of numbers, booleans or strings",
            )
        if values.dtype.kind in "fiu" and not column.unit:
            raise InvalidInput(item, column.unit, 'numbers need a unit, "1" for pure numbers')
        lengths.add(len(values))
    if len(lengths) > 1:
        raise InvalidInput(f"table {name}", sorted(lengths), "its columns must be of equal length")


def write(parent: "hdf5.Group", name: str, table: Table) -> None:
    """Store a table as a group with one dataset per column; booleans become int8."""
    from bench.datafile import hdf5  # h5py is imported only when a table is stored

    group = hdf5.create_group(parent, name, "NXcollection")
    for key, column in table.items():
        kind = column.values.dtype.kind
        if kind == "U":
            hdf5.write_text_array(group, key, column.values, description=column.description)
            continue
        values = column.values.astype(np.int8) if kind == "b" else column.values
        stored = hdf5.write_numbers(group, key, values, unit=column.unit or "1", description=column.description)
        if kind == "b":
            stored.attrs["kind"] = "switch"


def read(group: "hdf5.Group") -> dict[str, Column]:
    """Read a table stored by `write`; booleans with absent values (-1) are returned as numbers with NaN."""
    from bench.datafile import hdf5

    table: dict[str, Column] = {}
    for key in hdf5.names(group):
        stored = hdf5.dataset(group, key)
        values: NDArray[Any] = hdf5.read(stored, slice(None))
        if values.dtype.kind == "S":
            values = np.array(hdf5.read_texts(values), dtype=np.str_)
        elif stored.attrs.get("kind") == "switch":
            values = np.where(values < 0, np.nan, values) if (values < 0).any() else values.astype(np.bool_)
        table[key] = Column(values, str(stored.attrs.get("units", "")), str(hdf5.attribute(stored, "description")))
    return table


def as_rows(columns: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    """Columns of equal length as one dict per row."""
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def arrays(table: Table) -> dict[str, NDArray[Any]]:
    """Values of the columns by name, for drawing."""
    return {name: column.values for name, column in table.items()}
