"""Reads the file of a campaign: finished, still being written, or left by a killed writer."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from bench.events import Event, FitFinished, SensorsAligned
from bench.record import checksums, findings, fits, hdf5, tables
from bench.record.declared import EVENT_TABLES, FIXED_GROUPS, TABLES
from bench.record.errors import UNREADABLE, RecordError, reading, reason
from bench.record.fields import Field, decode, field_of
from bench.record.integrity import SMALL, Integrity, integrity
from bench.record.opening import open_file
from bench.record.plot import GROUP as PLOT
from bench.record.plot import TIME
from bench.record.stored import StoredSamples
from bench.record.tables import Column, as_rows
from drivers.rig import Alignment
from sim.identified import Identified
from sim.sweep import Done


@dataclass(frozen=True)
class RecordedEvent:
    """An entry of the journal: bench time [s], the name of the event, and one line of text."""

    time: float
    kind: str
    text: str


def open_record(path: Path, *, judging: bool = False) -> "Record":
    """Open the file of a campaign; use it in a `with` statement.

    A file that is being written can be followed, but not when `judging`: then it is read as it lies on the disk, and
    what is damaged raises an error at once.
    Raises InvalidInput when there is no such file or it is not one of ours, RecordError when it cannot be read.
    """
    file = open_file(path, judging=judging)
    try:
        return Record(file)
    except BaseException as error:
        file.close()
        if isinstance(error, UNREADABLE):
            told = f"{path} is damaged: {reason(error)}; `rockbench file recover` keeps what it can"
            raise RecordError(told) from error
        raise


class Record(StoredSamples):
    """What a file holds. All is read when asked for; `refresh` looks again at a file that is being written."""

    def __init__(self, file: hdf5.File) -> None:
        super().__init__(hdf5.group(file, "entry"))
        self._file = file

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the file. Allowed any number of times."""
        self._file.close()

    def refresh(self) -> None:
        """See what a writer has added since the file was opened."""
        self._count_again()
        for path in self._growing:
            with reading(path):
                hdf5.dataset(self._entry, path).refresh()

    @property
    def format_version(self) -> int:
        """Version of the layout that the file was written in."""
        return int(hdf5.attribute(self._file, "format_version"))

    @property
    def file(self) -> hdf5.File:
        """The open file itself."""
        return self._file

    @property
    def recoveries(self) -> list[str]:
        """How the file was rebuilt from others, one line each; mostly none."""
        if not hdf5.has(self._entry, "recovery/description"):
            return []
        return hdf5.read_text(self._entry, "recovery/description").splitlines()

    @property
    def checksums(self) -> dict[str, tuple[str, str]]:
        """SHA-256 of values and attributes by dataset; those of values are empty where the file was not closed."""
        return checksums.read(self._entry) if hdf5.has(self._entry, checksums.GROUP) else {}

    def integrity(self, largest: int | None = SMALL, done: Done = lambda _done, _all: None) -> Integrity:
        """What is not as it was written: `record.integrity().failing`, one line by path; `str` of it is one line.

        Datasets of at most `largest` bytes are read for it, every one when it is None; that takes as long as reading.
        `done` counts them.
        """
        return integrity(self._entry, largest, done)

    @property
    def status(self) -> str:
        """How the campaign ended; "running" while it is written, and for ever when its writer was killed."""
        return hdf5.read_text(self._entry, "status")

    @property
    def summary(self) -> str:
        """How the campaign ended, in words."""
        return hdf5.read_text(self._entry, "summary")

    @property
    def title(self) -> str:
        """What the campaign was called."""
        return hdf5.read_text(self._entry, "title")

    @property
    def start_time(self) -> str:
        """When the file was created, ISO 8601 with zone."""
        return hdf5.read_text(self._entry, "start_time")

    @property
    def end_time(self) -> str:
        """When it was closed, ISO 8601 with zone; empty when it was not."""
        return hdf5.read_text(self._entry, "end_time")

    @property
    def software(self) -> str:
        """Name and version of the software that wrote the file."""
        name = hdf5.dataset(self._entry, "program_name")
        return f"{hdf5.read_text(self._entry, 'program_name')} {hdf5.attribute(name, 'version')}"

    @cached_property
    def metadata(self) -> dict[str, str]:
        """The texts that were given to the recorder."""
        group = hdf5.group(self._entry, "metadata")
        return {name: hdf5.read_text(group, name) for name in hdf5.names(group)}

    @property
    def events(self) -> list[RecordedEvent]:
        """The journal."""
        return [RecordedEvent(**row) for row in self._rows("events")]

    @property
    def points(self) -> list[dict[str, Any]]:
        """The results, one dict per point with the fields of its type; enumerations are texts, absent values None."""
        return self._rows("points")

    @property
    def results(self) -> dict[str, Column]:
        """The results as a table: columns with units, rows as in `points`; absent values as they are stored."""
        group, whole = hdf5.group(self._entry, "points"), len(self.points)
        return {name: Column(c.values[:whole], c.unit, c.description) for name, c in tables.read(group).items()}

    def columns_of(self, event: type[Event]) -> dict[str, list[Any]]:
        """What was recorded of a kind of events that has a table, one list per column, in the order of declaration.

        An absent value is None, an unknown one NaN. No columns in an older file that has no such table.
        """
        return {field.name: values for field, values in self.growing(EVENT_TABLES[event].path).items()}

    def rows_of(self, event: type[Event]) -> list[dict[str, Any]]:
        """The same as one dict per row."""
        return as_rows(self.columns_of(event))

    def growing(self, path: str) -> dict[Field, list[Any]]:
        """The complete rows of the table at `path` below /entry, by column as the file declares it."""
        if not hdf5.has(self._entry, path):
            return {}
        group = hdf5.group(self._entry, path)
        stored = {name: hdf5.dataset(group, name) for name in hdf5.names(group)}
        columns = {field_of(name, each): decode(each) for name, each in stored.items()}
        whole = min([self._complete(path.rpartition("/")[2]), *(len(values) for values in columns.values())])
        return {field: values[:whole] for field, values in columns.items()}

    @property
    def fits(self) -> list[FitFinished]:
        """The models that were fitted, as they were said; none in a file that knows of none."""
        return fits.read(self._entry, self._complete("fits")) if hdf5.has(self._entry, "fits") else []

    @property
    def identified(self) -> Identified | None:
        """What was known of the specimen when the run had last found something; None where it identified nothing."""
        return findings.last(*(self._rows(name) for name in findings.TABLES))

    @property
    def alignments(self) -> dict[int, tuple[Alignment, ...]]:
        """How sensors with clocks of their own were placed on the sample clock, by run; empty where there are none."""
        found: dict[int, list[Alignment]] = {}
        for row in self.rows_of(SensorsAligned):
            found.setdefault(row.pop("run"), []).append(Alignment(**row))
        return {run: tuple(found[run]) for run in sorted(found)}

    @cached_property
    def tables(self) -> dict[str, dict[str, Column]]:
        """The tables that were stored before the run, such as "prediction"."""
        return {
            name: tables.read(hdf5.group(self._entry, name))
            for name, member in hdf5.members(self._entry)
            if name not in FIXED_GROUPS and not hdf5.is_dataset(member)
        }

    @cached_property
    def _growing(self) -> list[str]:
        """Paths of the datasets that change while the file is written."""
        paths = [f"instrument/{channel.name}/counts" for channel in self.channels]
        folders = [*TABLES, "points"]
        folders = [folder for folder in folders if hdf5.has(self._entry, folder)]
        paths += [f"{folder}/{name}" for folder in folders for name in hdf5.names(hdf5.group(self._entry, folder))]
        paths += [f"{PLOT}/{TIME}"] if self.format_version > 1 else []
        return [*paths, "instrument/drive/voltage", "status", "summary", "end_time"]

    def _rows(self, path: str) -> list[dict[str, Any]]:
        return as_rows({field.name: values for field, values in self.growing(path).items()})
