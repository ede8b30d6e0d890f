"""Contents of an export, independent of its format, and the export formats, which are the entry points of the group
`rockbench.exports`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from bench.app.catalogue import EXPORTS
from bench.datafile.checksums import Integrity
from bench.datafile.declared import EVENT_TABLES
from bench.datafile.findings_tables import FINDING_TABLES
from bench.datafile.reader import DataFile
from bench.datafile.series import RecordedRun
from bench.plugins import load_plugin, plugin_code
from bench.progress import Progress, counting, silent
from bench.unfinished import finish, unfinished
from drivers.rig import Channel
from sim.errors import InvalidInput
from sim.extras import require

ROWS_AT_ONCE = 2**18
"""Maximum number of samples of a signal held in memory, for formats that are written in pieces."""

Kind = Literal["number", "whole", "switch", "text"]


@dataclass(frozen=True)
class Signal:
    """One column of samples: a channel or the drive. `read` returns the samples in a slice of rows of the file.

    For raw counts, `conversion` describes the conversion to physical values, whose unit is its entry `value_unit`.
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
        return self.part(slice(run.rows.start, run.rows.stop))

    def part(self, rows: slice) -> NDArray[Any]:
        """Samples of these rows of the file."""
        return self.read(rows).astype(self.dtype, copy=False)


@dataclass(frozen=True)
class TableColumn:
    """A column of a table of results; None where a value is absent. `unit` is empty for strings and Booleans."""

    name: str
    unit: str
    description: str
    kind: Kind
    values: Sequence[Any]


@dataclass(frozen=True)
class Content:
    """All exported contents of an open file. `tables` contains the non-empty tables."""

    runs: tuple[RecordedRun, ...]
    signals: tuple[Signal, ...]
    tables: Mapping[str, Sequence[TableColumn]]
    info: Mapping[str, Any]
    sample_rate: float

    def pieces(self, run: RecordedRun) -> Iterator[list[NDArray[Any]]]:
        """Samples of a run in order: time [s] and every signal, at most `ROWS_AT_ONCE` rows at once."""
        for start in range(0, len(run.rows), ROWS_AT_ONCE):
            rows = run.rows[start : start + ROWS_AT_ONCE]
            part = slice(rows.start, rows.stop)
            yield [run.time.read(part), *(signal.part(part) for signal in self.signals)]


def content_of(record: DataFile, path: Path, *, raw: bool) -> Content:
    """Contents of an open file: physical values as float64, or converter counts if `raw`."""
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


def _signal(record: DataFile, channel: Channel) -> Signal:
    def read(rows: slice) -> NDArray[np.float64]:
        return record.values(channel.name, rows)

    return Signal(channel.name, channel.unit, channel.quantity, channel.device, np.dtype(np.float64), read)


def _raw_signal(record: DataFile, channel: Channel) -> Signal:
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


def _tables(record: DataFile) -> Iterator[tuple[str, list[TableColumn]]]:
    """The results, the recorded events, findings and fits, and the tables stored before the run."""
    points, about = record.points, record.results
    if points:
        yield "points", [_column(name, about[name].unit, about[name].description, points) for name in points[0]]
    for path in (*(table.path for table in EVENT_TABLES.values()), *record.own_tables, *FINDING_TABLES, "events"):
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


def _anything(content: Content) -> None:
    """Accept all contents."""


@dataclass(frozen=True)
class ExportFormat:
    """An export format: writes open files for other programs. Its name for `--to` is that of the entry point.

    title : name shown in the window.
    write : writes the contents to a new folder.
    check : raises InvalidInput, before the folder is created, for contents that the format cannot represent.
    library : required module of the extra `export`; empty for none.
    """

    title: str
    write: Callable[[Content, Path], None]
    check: Callable[[Content], None] = _anything
    library: str = ""


def load_format(name: str) -> ExportFormat:
    """The export format `name`. Raises InvalidInput if the format is not installed or fails to load."""
    return load_plugin(EXPORTS, name, "--to", ExportFormat)


DAMAGED = "DAMAGED.txt"
"""File in an export folder that lists the damaged datasets."""


def export(
    record: DataFile, path: Path, to: str, out: Path, *, raw: bool = False, progress: Progress = silent
) -> tuple[list[Path], Integrity]:
    """Export an open data file, read from `path`, to the new folder `out`; returns the written files and the integrity
    of the data file. Damaged datasets are listed in the file DAMAGED.txt of the export.

    Physical values are float64; with `raw`, counts are written together with their conversion. Raises InvalidInput if
    the format is not installed or cannot represent the contents, or if `out` exists or cannot be created; MissingExtra
    if the format's library is not installed.
    """
    wanted = load_format(to)
    if wanted.library:
        require("export", f"--to {to}", wanted.library)
    if out.exists():
        raise InvalidInput("--out", str(out), "the folder exists and is never overwritten; choose another folder")
    integrity = record.integrity(None, counting(progress, "verifying the checksums"))
    progress("writing the exported files")
    content = content_of(record, path, raw=raw)
    wanted.check(content)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        temporary = out.with_name(f".{out.name}-{uuid4().hex[:8]}")
        temporary.mkdir()
    except OSError as error:
        raise InvalidInput("--out", str(out), f"the folder cannot be created: {error.strerror}") from None
    with unfinished(temporary):
        with plugin_code(f"the export format {to}", files=True):
            wanted.write(content, temporary)
        if integrity.failing:
            lines = (f"{path.name} is damaged or was changed since it was written:", *integrity.failing.values())
            (temporary / DAMAGED).write_text("\n".join(lines) + "\n", encoding="utf-8")
        finish(temporary, out)
    return sorted(out.iterdir()), integrity
