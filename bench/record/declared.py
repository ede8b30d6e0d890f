"""The tables that grow in the file besides the samples, and the names that they take.

The tables of events follow from the declarations in `bench.events`; `fits` and `findings` have tables of their own,
whose rows refer to one another.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench import events
from bench.events import Event
from bench.record import findings, fits
from bench.record.fields import Field, Kind, fields_of, parts_of
from bench.record.plot import TIME

BLOCKS = (
    Field("row", Kind.WHOLE, "1", "row of the samples at which the block begins"),
    Field("run", Kind.WHOLE, "1", "how many times the rig had been armed"),
    Field("first", Kind.WHOLE, "1", "index of the block's first sample, counted from 0 in each run"),
    Field("time", Kind.REAL, "s", "bench time at which the block had been read"),
)
EVENTS = (
    Field("time", Kind.REAL, "s", "bench time"),
    Field("kind", Kind.TEXT, "", "what happened: the name of the event"),
    Field("text", Kind.TEXT, "", "one line for the reader"),
)


@dataclass(frozen=True)
class EventTable:
    """The table of a kind of events at `path` below /entry.

    An event whose columns are arrays of one length, or that has a tuple of `parts` with columns of their own, makes
    as many rows; they have no column of the time.
    """

    path: str
    fields: tuple[Field, ...]
    parts: tuple[str, tuple[str, ...]] | None

    @property
    def name(self) -> str:
        """The table's own name."""
        return self.path.rpartition("/")[2]

    def rows(self, event: Event) -> Iterator[tuple[Any, ...]]:
        """The rows that an event makes, a value for each field."""
        if self.parts is not None:
            attribute, inner = self.parts
            outer = [getattr(event, field.name) for field in self.fields if field.name not in inner]
            for part in getattr(event, attribute):
                yield (*outer, *(getattr(part, name) for name in inner))
            return
        values = [getattr(event, field.name) for field in self.fields]
        if isinstance(values[0], np.ndarray):
            yield from zip(*(value.tolist() for value in values), strict=True)
        else:
            yield tuple(values)


def _table_of(kind: type[Event]) -> EventTable:
    fields, parts = fields_of(kind), parts_of(kind)
    several = parts is not None or any(field.array for field in fields)
    kept = tuple(field for field in fields if not (several and field.name == "time"))
    if parts is None:
        return EventTable(kind.table, kept, None)
    inner = fields_of(parts[1])
    return EventTable(kind.table, (*kept, *inner), (parts[0], tuple(field.name for field in inner)))


EVENT_TABLES: Mapping[type[Event], EventTable] = {
    kind: _table_of(kind)
    for kind in vars(events).values()
    if isinstance(kind, type) and issubclass(kind, Event) and kind.table
}
"""The events that have a table, in the order of their declaration."""

TABLES: Mapping[str, tuple[Field, ...]] = {
    "instrument/blocks": BLOCKS,
    "events": EVENTS,
    **{table.path: table.fields for table in EVENT_TABLES.values()},
    **fits.TABLES,
    **findings.TABLES,
}
"""Every table that grows, by its path below /entry, but for the points: their columns are the protocol's."""

_PATHS = {path.rpartition("/")[2]: path for path in (*TABLES, "points")}
_FIRST = (
    *("samples", "blocks", "events", "estimates", "points", "alignments"),
    *("running_gains", "passes", "table_response"),
    *("fits", "fit_columns", "fit_parameters", "fit_values"),
    "twin",
    *("identified", "identified_correlations"),
)
"""What files have counted until now, by their places: later tables come after them, in the order of declaration."""

COUNTED = (*_FIRST, *(name for name in _PATHS if name not in _FIRST))
"""What is counted in the dataset `complete`: rows beyond were still on their way when the disk or the writer failed."""

FIXED_GROUPS = (
    *("checksums", "data", "fitted", "instrument", "metadata", "notes", "recovery", "user"),
    *(path for path in _PATHS.values() if "/" not in path),
)
FIXED_ENTRIES = ("complete", "end_time", "program_name", "start_time", "status", "summary", "title")
FIXED_INSTRUMENTS = (
    *(name for name, path in _PATHS.items() if path.startswith("instrument/")),
    *("drive", "sample_rate", TIME),
)

_PARTS = {f"/entry/{path}": name for name, path in _PATHS.items()}


def part_of(path: str) -> str:
    """By which count of `complete` a dataset that grows goes: that of its table, or that of the samples."""
    return _PARTS.get(path.rpartition("/")[0], "samples")
