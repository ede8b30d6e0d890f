"""Events and points that the journal beside a file has and the file has not."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.record import hdf5
from bench.record.errors import UNREADABLE, RecordError
from bench.record.fields import field_of

Row = Mapping[str, Any]


def add_lost_events(entry: hdf5.Group, lines: Sequence[Row]) -> tuple[int, int]:
    """Append to the tables of events and points what the journal has beyond them; returns how many rows of each.

    Points are looked at by themselves: they can be missing where their event is not.
    Raises RecordError, and appends nothing, for a journal that does not begin as the file does: it is another one's.
    """
    points = [line["point"] for line in lines if "point" in line]
    events = _beyond(hdf5.group(entry, "events"), lines, ("time", "kind"))
    results = _beyond(hdf5.group(entry, "points"), points)
    for stored, values in (*events, *results):
        hdf5.append(stored, values)
    return max((len(values) for _, values in events), default=0), max((len(values) for _, values in results), default=0)


def _beyond(
    table: hdf5.Group, rows: Sequence[Row], compared: Sequence[str] | None = None
) -> list[tuple[hdf5.Dataset, NDArray[Any]]]:
    """Every dataset of a table with the rows to be added; the rows before must be those of the table."""
    new: list[tuple[hdf5.Dataset, NDArray[Any]]] = []
    for name in table:
        stored = hdf5.dataset(table, name)
        known, field = hdf5.read(stored, slice(None)), field_of(name, stored)
        try:
            values = np.array([field.encode(row.get(name)) for row in rows], dtype=field.dtype)
        except UNREADABLE as error:
            raise RecordError(f"the journal has no {name} for {table.name}: it is damaged") from error
        if compared is None or name in compared:
            told = values[: len(known)]
            # JSON knows finite numbers only
            same = (told == known[: len(told)]) | ((told != told) if told.dtype.kind == "f" else False)
            if not np.all(same):
                raise RecordError(f"the journal and the file differ in {stored.name}: it is that of another file")
        new.append((stored, values[len(known) :]))
    return new
