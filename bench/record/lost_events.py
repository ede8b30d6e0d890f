"""Events that the journal beside a file has and the file has not."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bench.record import hdf5
from bench.record.fields import field_of


def add_lost_events(entry: hdf5.Group, lines: Sequence[Mapping[str, Any]]) -> int:
    """Append to the tables of events and points what the journal has beyond them; returns how many events.

    A journal that does not begin with the events of the file belongs to another one, and is left alone.
    """
    times, kinds = hdf5.dataset(entry, "events/time")[:], hdf5.read_texts(hdf5.dataset(entry, "events/kind")[:])
    known = [(line["time"], line["kind"]) for line in lines[: len(kinds)]]
    if known != list(zip(times.tolist(), kinds, strict=True)):
        return 0
    lost = lines[len(kinds) :]
    _append(hdf5.group(entry, "events"), lost)
    _append(hdf5.group(entry, "points"), [line["point"] for line in lost if "point" in line])
    return len(lost)


def _append(table: hdf5.Group, rows: Sequence[Mapping[str, Any]]) -> None:
    if not rows:
        return
    for name in table:
        stored = hdf5.dataset(table, name)
        field = field_of(name, stored)
        hdf5.append(stored, np.array([field.encode(row.get(name)) for row in rows], dtype=field.dtype))
