"""Reader of a campaign file that is finished, being written, or left by a killed writer."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from bench.datafile import checksums, hdf5, tables
from bench.datafile.checksums import SMALL, Integrity, integrity
from bench.datafile.declared import FIXED_GROUPS, TABLES, event_table, path_of
from bench.datafile.fields import Field, field_of, values_of
from bench.datafile.findings_tables import FINDING_TABLES, last_findings, read_fits
from bench.datafile.hdf5_reading import UNREADABLE, DataFileError, reading, reason
from bench.datafile.opening import columns_from, open_file
from bench.datafile.samples import PLOT as PLOT
from bench.datafile.samples import TIME
from bench.datafile.series import SampleReader
from bench.datafile.tables import Column, as_rows
from bench.events import Event, SensorsAligned
from bench.findings import FitFinished
from drivers.optoncdt.codec import IMPLAUSIBLE, LATE, LOST, MID_RANGE, marked
from drivers.rig import Alignment
from drivers.timebase.resampling import Marks, resampled
from sim.errors import InvalidInput
from sim.identified import Identified
from sim.sweep import Done


@dataclass(frozen=True)
class JournalEntry:
    """A journal entry: bench time [s], name of the event, and one line of text."""

    time: float
    kind: str
    text: str


def open_datafile(path: Path, *, judging: bool = False) -> "DataFile":
    """Open the file of a campaign; use it in a `with` statement.

    A file that is being written can be followed, unless `judging` is set: the state on the disk is then read, and
    damage raises an error at once. Raises InvalidInput if the file does not exist or is of another kind, and
    DataFileError if it cannot be read.
    """
    file = open_file(path, judging=judging)
    try:
        return DataFile(file)
    except BaseException as error:
        file.close()
        if isinstance(error, UNREADABLE):
            message = f"{path} is damaged: {reason(error)}; `rockbench file recover` restores the readable part"
            raise DataFileError(message) from error
        raise


class DataFile(SampleReader):
    """An open data file. Its contents are read on access; `refresh` includes the rows that a writer has added since."""

    def __init__(self, file: hdf5.File) -> None:
        super().__init__(hdf5.group(file, "entry"))
        self._file = file
        self._size = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; may be called repeatedly."""
        self._file.close()

    def refresh(self) -> None:
        """Include data that the writer has added since the last call. Raises DataFileError if the file has been
        truncated.
        """
        self._check_size()
        self._refresh_counts()
        for path in self._growing:
            with reading(path):
                hdf5.dataset(self._entry, path).refresh()

    def _check_size(self) -> None:
        # otherwise HDF5 would search for the truncated data for hours
        with reading(str(self._file.filename)):
            size = Path(self._file.filename).stat().st_size
        if size < self._size:
            raise DataFileError(
                f"{self._file.filename} was truncated from {self._size} to {size} bytes while it was open"
            )
        self._size = size

    @property
    def format_version(self) -> int:
        """Version of the file's layout."""
        return int(hdf5.attribute(self._file, "format_version"))

    @property
    def wording(self) -> int:
        """Version of the journal's sentences; see `bench.datafile.opening.WORDING`."""
        return int(hdf5.attribute(self._file, "wording")) if "wording" in self._file.attrs else 1

    @property
    def intervals(self) -> int:
        """Version of the evaluation of uncertainties; see `bench.datafile.opening.INTERVALS`."""
        return int(hdf5.attribute(self._file, "intervals")) if "intervals" in self._file.attrs else 1

    @property
    def file(self) -> hdf5.File:
        """The open HDF5 file."""
        return self._file

    @property
    def recoveries(self) -> list[str]:
        """Notes on the recovery of this file from a damaged one, one line each; empty if it was not recovered."""
        if not hdf5.has(self._entry, "recovery/description"):
            return []
        return hdf5.read_text(self._entry, "recovery/description").splitlines()

    @property
    def checksums(self) -> dict[str, tuple[str, str]]:
        """SHA-256 of values and attributes by dataset; that of growing values is empty if the file was not closed."""
        return checksums.read(self._entry) if hdf5.has(self._entry, checksums.GROUP) else {}

    def integrity(self, largest: int | None = SMALL, done: Done = lambda _done, _all: None) -> Integrity:
        """Check for changes since the file was written. In the result, `failing` has a line for each changed path, and
        `str` gives a summary in one line.

        Reads the datasets of at most `largest` bytes, or all datasets if None. `done` receives the number of datasets
        processed and the total.
        """
        return integrity(self._entry, largest, done)

    @property
    def status(self) -> str:
        """Status of the campaign: "running" while the file is being written, and permanently if its writer was
        killed.
        """
        return hdf5.read_text(self._entry, "status")

    @property
    def summary(self) -> str:
        """Reason for the campaign's end."""
        return hdf5.read_text(self._entry, "summary")

    @property
    def title(self) -> str:
        """Name of the campaign."""
        return hdf5.read_text(self._entry, "title")

    @property
    def start_time(self) -> str:
        """Time of the file's creation, ISO 8601 with time zone."""
        return hdf5.read_text(self._entry, "start_time")

    @property
    def end_time(self) -> str:
        """Time at which the file was closed, ISO 8601 with time zone; empty if it was not closed."""
        return hdf5.read_text(self._entry, "end_time")

    @property
    def software(self) -> str:
        """Name and version of the software that wrote the file."""
        name = hdf5.dataset(self._entry, "program_name")
        return f"{hdf5.read_text(self._entry, 'program_name')} {hdf5.attribute(name, 'version')}"

    @cached_property
    def metadata(self) -> dict[str, str]:
        """The recorder's metadata: strings by name."""
        group = hdf5.group(self._entry, "metadata")
        return {name: hdf5.read_text(group, name) for name in hdf5.names(group)}

    @property
    def events(self) -> list[JournalEntry]:
        """The entries of the journal."""
        return [JournalEntry(**row) for row in self._rows("events")]

    @property
    def points(self) -> list[dict[str, Any]]:
        """The results, one dict per point with the fields of its type; enumerations are strings, absent values None."""
        return self._rows("points")

    @property
    def results(self) -> dict[str, Column]:
        """The results as a table: columns with units, rows as in `points`; missing values are in their stored form."""
        group, whole = hdf5.group(self._entry, "points"), len(self.points)
        return {name: Column(c.values[:whole], c.unit, c.description) for name, c in tables.read(group).items()}

    def columns_of(self, event: type[Event]) -> dict[str, list[Any]]:
        """Recorded events of a kind that has a table: one list per column, in the order of declaration.

        An absent value is None, an unknown value NaN. Empty for an event without a table, and for an older file without
        this table.
        """
        table = event_table(event)
        return {} if table is None else {field.name: values for field, values in self.growing(table.path).items()}

    def has_table_of(self, event: type[Event]) -> bool:
        """Whether the file has a table of this kind of event."""
        table = event_table(event)
        return table is not None and hdf5.has(self._entry, table.path)

    def rows_of(self, event: type[Event]) -> list[dict[str, Any]]:
        """The columns of `columns_of` as one dict per row."""
        return as_rows(self.columns_of(event))

    def entries_of(self, event: type[Event]) -> list[dict[str, Any]]:
        """Rows of a journalled event, with bench `time`; columns missing from an older file are extracted from its
        journal's sentences.
        """
        entries = [entry for entry in self.events if entry.kind == event.__name__]
        rows = self.rows_of(event) or [{}] * len(entries)
        return [
            {"time": entry.time, **columns_from(entry.kind, entry.text), **row}
            for entry, row in zip(entries, rows, strict=False)
        ]

    def growing(self, path: str) -> dict[Field, list[Any]]:
        """The complete rows of the table at `path` below /entry: the values of each field; empty if there is no such
        table.
        """
        if not hdf5.has(self._entry, path):
            return {}
        group = hdf5.group(self._entry, path)
        stored = {name: hdf5.dataset(group, name) for name in hdf5.names(group)}
        fields = {field_of(name, each): each for name, each in stored.items()}
        columns = {field: values_of(field, each) for field, each in fields.items()}
        whole = min([self._complete(path.rpartition("/")[2]), *(len(values) for values in columns.values())])
        return {field: values[:whole] for field, values in columns.items()}

    @property
    def fits(self) -> list[FitFinished]:
        """The published fits; empty for a file of an older version without fits."""
        return read_fits(self._entry, self._complete("fits")) if hdf5.has(self._entry, "fits") else []

    @property
    def identified(self) -> Identified | None:
        """The last identified properties of the specimen; None if the run identified none."""
        return last_findings(*(self._rows(name) for name in FINDING_TABLES))

    def resampled(self, name: str, run: int) -> NDArray[np.float64]:
        """Values of a serial laser at the samples of `run`, in its unit, from all values received in that run,
        including those that arrived after their block had been read. NaN where there is no value.

        Raises InvalidInput for a channel without raw values in that run.
        """
        raw = self.raw_values(name, run)
        alignment = next((one for one in self.alignments.get(run, ()) if one.sensor == name), None)
        if alignment is None or not len(raw) or alignment.offset != alignment.offset:
            has = ", ".join(sorted({one.sensor for several in self.alignments.values() for one in several})) or "none"
            raise InvalidInput("channel", name, f"it has no raw values in run {run}; channels with them: {has}")
        rows = next(each.rows for each in self.runs if each.number == run)
        samples = np.rint(self.time(slice(rows.start, rows.stop)) * self.sample_rate).astype(np.int64)
        marks = Marks(LOST, LATE, IMPLAUSIBLE)
        counts = resampled(raw, alignment, marked, MID_RANGE, marks, samples, self.sample_rate)
        return self._channel_named(name).to_unit(counts)

    @property
    def alignments(self) -> dict[int, tuple[Alignment, ...]]:
        """Alignments of sensors with free-running clocks to the sample clock, by run; empty if there are no such
        sensors.
        """
        found: dict[int, list[Alignment]] = {}
        for row in self.rows_of(SensorsAligned):
            found.setdefault(row.pop("run"), []).append(Alignment(**row))
        return {run: tuple(found[run]) for run in sorted(found)}

    @cached_property
    def tables(self) -> dict[str, dict[str, Column]]:
        """The tables stored before the run, such as "prediction"."""
        return {
            name: tables.read(hdf5.group(self._entry, name))
            for name, member in hdf5.members(self._entry)
            if name not in FIXED_GROUPS and name not in self.counted and not hdf5.is_dataset(member)
        }

    @property
    def own_tables(self) -> list[str]:
        """Paths of the tables of the events that the protocol declared when the file was written."""
        paths = map(path_of, self.counted)
        return [each for each in paths if each not in (*TABLES, "points") and hdf5.has(self._entry, each)]

    @cached_property
    def _growing(self) -> list[str]:
        """Paths of the datasets that change during recording."""
        paths = [f"instrument/{channel.name}/counts" for channel in self.channels]
        folders = [folder for folder in map(path_of, self.counted) if hdf5.has(self._entry, folder)]
        paths += [f"{folder}/{name}" for folder in folders for name in hdf5.names(hdf5.group(self._entry, folder))]
        paths += [f"{PLOT}/{TIME}"] if self.format_version > 1 else []
        return [*paths, "instrument/drive/voltage", "status", "summary", "end_time"]

    def _rows(self, path: str) -> list[dict[str, Any]]:
        return as_rows({field.name: values for field, values in self.growing(path).items()})
