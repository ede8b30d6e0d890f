"""The growing tables of the file, except the samples, and their names.

The tables of events follow from the declarations of the events in `bench.events`, `bench.live_values`, `bench.findings`
and the modules of a protocol.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from bench import events, findings, live_values
from bench.datafile.fields import Field, Kind, fields_of, parts_of
from bench.datafile.findings_tables import FINDING_TABLES, FIT_TABLES
from bench.datafile.samples import TIME
from bench.events import Event

BLOCKS = (
    Field("row", Kind.WHOLE, "1", "row of the samples at which the block begins"),
    Field("run", Kind.WHOLE, "1", "number of the run; each arming of the rig begins one"),
    Field("first", Kind.WHOLE, "1", "index of the block's first sample, counted from 0 in each run"),
    Field("time", Kind.REAL, "s", "bench time after reading the block"),
)
EVENTS = (
    Field("time", Kind.REAL, "s", "bench time"),
    Field("kind", Kind.TEXT, "", "name of the event"),
    Field("text", Kind.TEXT, "", "one-line text"),
)


RAW_VALUES = tuple(
    Field(name, Kind.WHOLE, unit, description, packed=True)
    for name, unit, description in (
        ("run", "1", "number of the run; each arming of the rig begins one"),
        ("sensor", "1", "number of the sensor's channel, in the order of the rig, from 0"),
        ("index", "1", "number of the measurement, counted by the sensor; it jumps where values were lost"),
        ("time", "us", "time of the measurement by the sensor's clock"),
        ("code", "1", "output word of the sensor, before conversion"),
        ("arrival", "us", "time of arrival by the computer's clock, since the rig was armed"),
    )
)
"""Values of sensors with free-running clocks, as received, before resampling."""


@dataclass(frozen=True)
class EventTable:
    """The table for one kind of event, at `path` below /entry.

    An event adds several rows, which have no time column, if its columns are arrays of equal length or if it has a
    tuple of `parts` with columns of their own.
    """

    path: str
    fields: tuple[Field, ...]
    parts: tuple[str, tuple[str, ...]] | None

    @property
    def single(self) -> bool:
        """Whether an event adds exactly one row."""
        return self.parts is None and not any(field.array for field in self.fields)

    @property
    def name(self) -> str:
        """Name of the table: the last part of its path."""
        return self.path.rpartition("/")[2]

    def rows(self, event: Event) -> Iterator[tuple[Any, ...]]:
        """The rows of an event, each with one value per field."""
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


@lru_cache(maxsize=256)
def event_table(kind: type[Event]) -> EventTable | None:
    """The table that the declaration of an event implies; None for an event without a table."""
    if not kind.table:
        return None
    fields, parts = fields_of(kind), parts_of(kind)
    several = parts is not None or any(field.array for field in fields)
    kept = tuple(field for field in fields if not (several and field.name == "time"))
    if parts is None:
        return EventTable(kind.table, kept, None)
    inner = fields_of(parts[1])
    return EventTable(kind.table, (*kept, *inner), (parts[0], tuple(field.name for field in inner)))


def event_tables(kinds: Iterable[object]) -> dict[type[Event], EventTable]:
    """Tables, in the order of declaration, of the members of `kinds` that are events with a table."""
    declared = (kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Event))
    return {kind: table for kind in declared if (table := event_table(kind)) is not None}


EVENT_TABLES: Mapping[type[Event], EventTable] = event_tables(
    kind for module in (events, live_values, findings) for kind in vars(module).values()
)
"""Tables of the events of all protocols, which every file has; the tables of a protocol's own events follow them."""

ENTRY_TABLES: Mapping[type[Event], EventTable] = {
    kind: table for kind, table in EVENT_TABLES.items() if kind.journalled and table.single
}
"""Tables with exactly one row for each journal entry of their kind."""

ENTRY_PATHS = {**{kind.__name__: table.path for kind, table in ENTRY_TABLES.items()}, "PassFinished": "passes"}
"""Tables of journal entries, by event name, in files of earlier versions, which do not name the tables."""

TABLES: Mapping[str, tuple[Field, ...]] = {
    "instrument/blocks": BLOCKS,
    "instrument/raw_values": RAW_VALUES,
    "events": EVENTS,
    **{table.path: table.fields for table in EVENT_TABLES.values()},
    **FIT_TABLES,
    **FINDING_TABLES,
}
"""Growing tables of every file by path below /entry, except the points, whose columns depend on the protocol."""

_PATHS = {path.rpartition("/")[2]: path for path in (*TABLES, "points")}
FORMER = (
    *("samples", "blocks", "events", "estimates", "points", "alignments"),
    *("running_gains", "passes", "table_response"),
    *("fits", "fit_columns", "fit_parameters", "fit_values"),
    "twin",
    *("identified", "identified_correlations", "live_values"),
    *("state_changes", "operator_actions", "warnings", "exceeded_limits", "operator_requests", "operator_answers"),
    *("raw_values", "hold_cycles", "operator_notes"),
)
"""Names, in order, of the counters in the dataset `complete` in files of earlier versions, which do not name the
counters. Rows beyond these counts may be incomplete, because the disk or the writer failed.
"""


def counters(own: Iterable[str]) -> tuple[str, ...]:
    """Names of the counters of a new file; `own` are the tables of the protocol's events."""
    return (*FORMER, *(name for name in (*_PATHS, *own) if name not in FORMER))


def path_of(counter: str) -> str:
    """Path below /entry of the table with this counter."""
    return _PATHS.get(counter, counter)


_GROUPS = ("checksums", "data", "fitted", "instrument", "metadata", "notes", "recovery", "user")
RESERVED = (*_GROUPS, "points", "samples")
"""Names below /entry that no table of a protocol's events may have; `samples` is a counter in `complete`."""
FIXED_GROUPS = (
    *_GROUPS,
    *(path for path in map(path_of, counters(())) if "/" not in path and path != "samples"),
)
FIXED_ENTRIES = ("complete", "end_time", "program_name", "start_time", "status", "summary", "title")
FIXED_INSTRUMENTS = (
    *(name for name, path in _PATHS.items() if path.startswith("instrument/")),
    *("drive", "sample_rate", TIME),
)


def part_of(path: str, counted: Mapping[str, int]) -> str:
    """The counter in `complete` that applies to a growing dataset: that of its table, or that of the samples."""
    folder = path.rpartition("/")[0]
    name = folder.rpartition("/")[2]
    return name if name in counted and folder == f"/entry/{path_of(name)}" else "samples"
