"""A table that grows during the run: rows wait in memory until they are written together."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.record import hdf5
from bench.record.fields import Field
from bench.record.growing import Growing


class Rows:
    """A group with one dataset per field."""

    def __init__(self, parent: hdf5.Group, name: str, fields: Sequence[Field]) -> None:
        group = hdf5.create_group(parent, name, "NXcollection")
        self._columns = [(field, Growing(field.create(group))) for field in fields]
        self._pending: list[tuple[Any, ...]] = []
        self._written = 0

    def __len__(self) -> int:
        return self._written + len(self._pending)

    @property
    def written(self) -> int:
        """Rows that have been given to the file."""
        return self._written

    @property
    def grown(self) -> list[Growing]:
        """The datasets."""
        return [stored for _, stored in self._columns]

    def add(self, *values: Any) -> None:
        """Append one row, a value per field in their order; None where a value is absent."""
        self._pending.append(
            tuple(field.encode(value) for (field, _), value in zip(self._columns, values, strict=True))
        )

    def extend(self, *columns: NDArray[Any]) -> None:
        """Append many rows: a column per field in their order, all of one length, nothing absent."""
        self._pending += zip(*(column.tolist() for column in columns), strict=True)

    def write(self) -> None:
        """Put the waiting rows into the file."""
        if not self._pending:
            return
        for (field, stored), values in zip(self._columns, zip(*self._pending, strict=True), strict=True):
            stored.append(np.array(values, dtype=field.dtype))
        self._written += len(self._pending)
        self._pending.clear()
