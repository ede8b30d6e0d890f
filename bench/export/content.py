"""What a campaign's file has to give, free of any format: signals by run, tables of results, and what they are."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bench.record import findings
from bench.record.declared import EVENT_TABLES
from bench.record.reader import Record
from bench.record.series import RecordedRun
from drivers.rig import Channel

ROWS_AT_ONCE = 2**18
"""Samples of a signal that are in memory at once where a format can be written in pieces."""

Kind = Literal["number", "whole", "switch", "text"]


@dataclass(frozen=True)
class Signal:
    """One column of samples: a channel or the drive. `read` takes rows of the file.

    With raw counts `conversion` says how they become values in `value_unit`.
    """

    name: str
    unit: str
    quantity: str
    device: str
    dtype: np.dtype[Any]
    read: Callable[[slice], NDArray[Any]]
    conversion: Mapping[str, Any] | None = None

    def of(self, run: RecordedRun) -> NDArray[Any]:
        """All samples of a run."""
        return self.read(slice(run.rows.start, run.rows.stop)).astype(self.dtype, copy=False)

    def pieces(self, run: RecordedRun) -> Iterator[NDArray[Any]]:
        """The samples of a run in order, some at a time."""
        for start in range(run.rows.start, run.rows.stop, ROWS_AT_ONCE):
            stop = min(start + ROWS_AT_ONCE, run.rows.stop)
            yield self.read(slice(start, stop)).astype(self.dtype, copy=False)


@dataclass(frozen=True)
class TableColumn:
    """A column of a table of results; None where a value is absent. `unit` is empty for texts and switches."""

    name: str
    unit: str
    description: str
    kind: Kind
    values: Sequence[Any]


@dataclass(frozen=True)
class Content:
    """Everything that is exported of an open file. `tables` are those that have rows."""

    runs: tuple[RecordedRun, ...]
    signals: tuple[Signal, ...]
    tables: Mapping[str, Sequence[TableColumn]]
    info: Mapping[str, Any]
    sample_rate: float


def content_of(record: Record, path: Path, *, raw: bool) -> Content:
    """What an open file holds: physical values as float64, or the counts as converted when `raw`."""
    signals = [_raw_signal(record, channel) if raw else _signal(record, channel) for channel in record.channels]
    drive = np.dtype(np.float32 if raw else np.float64)
    signals.append(Signal("drive", "V", "drive as sent to the amplifier", "", drive, record.drive))
    info = {
        "file": path.name,
        "title": record.title,
        "start_time": record.start_time,
        "end_time": record.end_time,
        "status": record.status,
        "summary": record.summary,
        "software": record.software,
        "sample_rate": record.sample_rate,
        **record.metadata,
    }
    return Content(record.runs, tuple(signals), dict(_tables(record)), info, record.sample_rate)


def _signal(record: Record, channel: Channel) -> Signal:
    def read(rows: slice) -> NDArray[np.float64]:
        return record.values(channel.name, rows)

    return Signal(channel.name, channel.unit, channel.quantity, channel.device, np.dtype(np.float64), read)


def _raw_signal(record: Record, channel: Channel) -> Signal:
    def read(rows: slice) -> NDArray[Any]:
        return record.counts(channel.name, rows)

    conversion = {
        "value_unit": channel.unit,
        "scale": channel.scale,
        "offset": channel.offset,
        "higher": " ".join(repr(term) for term in channel.higher),
        "valid_low": channel.valid[0],
        "valid_high": channel.valid[1],
    }
    stored = np.dtype(channel.storage)
    return Signal(channel.name, "counts", channel.quantity, channel.device, stored, read, conversion)


def _tables(record: Record) -> Iterator[tuple[str, list[TableColumn]]]:
    """The results, what was recorded on the way to them, and what was stored before the run."""
    points, about = record.points, record.results
    if points:
        yield "points", [_column(name, about[name].unit, about[name].description, points) for name in points[0]]
    for path in (*(table.path for table in EVENT_TABLES.values()), *findings.TABLES, "events"):
        columns = record.growing(path)
        if any(columns.values()):
            named = [_plain(field.name, field.unit, field.description, values) for field, values in columns.items()]
            yield path.rpartition("/")[2], named
    for number, fit in enumerate(record.fits, start=1):
        columns = [
            _plain(key, each.unit, f"{fit.name}: {each.description}", each.values.tolist())
            for key, each in fit.columns.items()
        ]
        yield f"fit_{number}", columns
    for name, table in record.tables.items():
        columns = [_plain(key, each.unit, each.description, each.values.tolist()) for key, each in table.items()]
        if columns and columns[0].values:
            yield name, columns


def _column(name: str, unit: str, description: str, rows: Sequence[Mapping[str, Any]]) -> TableColumn:
    return _plain(name, unit, description, [row[name] for row in rows])


def _plain(name: str, unit: str, description: str, values: Sequence[Any]) -> TableColumn:
    known = [value for value in values if value is not None]
    kind: Kind = "number"
    if known and all(isinstance(value, bool) for value in known):
        kind = "switch"
    elif known and all(isinstance(value, str) for value in known):
        kind = "text"
    elif known and all(isinstance(value, int) for value in known):
        kind = "whole"
    return TableColumn(name, "" if kind in ("switch", "text") else unit, description, kind, values)
