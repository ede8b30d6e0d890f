"""Reads the file of a campaign: finished, still being written, or left by a killed writer."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from bench.events import FitFinished
from bench.record import checksums, findings, fits, hdf5, tables
from bench.record.declared import FIXED_GROUPS, OWN_TABLES
from bench.record.errors import UNREADABLE, RecordError, reading, reason
from bench.record.fields import decode
from bench.record.integrity import SMALL, Integrity, integrity
from bench.record.opening import open_file
from bench.record.plot import GROUP as PLOT
from bench.record.plot import TIME
from bench.record.stored import StoredSamples
from bench.record.tables import Column
from drivers.rig import Alignment
from sim.identified import Identified


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

    def integrity(self, largest: int | None = SMALL) -> Integrity:
        """What is not as it was written: `record.integrity().failing`, one line by path; `str` of it is one line.

        Datasets of at most `largest` bytes are read for it, every one when it is None; that takes as long as reading.
        """
        return integrity(self._entry, largest)

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
        columns = self._decoded("events")
        return [RecordedEvent(*row) for row in zip(columns["time"], columns["kind"], columns["text"], strict=True)]

    @property
    def points(self) -> list[dict[str, Any]]:
        """The results, one dict per point with the fields of its type; enumerations are texts, absent values None."""
        return self._rows("points")

    @property
    def results(self) -> dict[str, Column]:
        """The results as a table: columns with units, rows as in `points`; absent values as they are stored."""
        group, whole = hdf5.group(self._entry, "points"), len(self.points)
        return {name: Column(c.values[:whole], c.unit, c.description) for name, c in tables.read(group).items()}

    @property
    def estimates(self) -> dict[str, list[Any]]:
        """The running estimates, one list per column; an absent value is None, an unknown one NaN."""
        return self._decoded("estimates")

    @property
    def running_gains(self) -> dict[str, list[Any]]:
        """The running gains under records, one list per column; `beta` is None for the bare frame."""
        return self._decoded("running_gains") if hdf5.has(self._entry, "running_gains") else {}

    @property
    def twin(self) -> dict[str, list[Any]]:
        """What the model said that ran beside, one list per column; no columns in a file that knows of none."""
        return self._decoded("twin") if hdf5.has(self._entry, "twin") else {}

    @property
    def passes(self) -> list[dict[str, Any]]:
        """What the passes of replications achieved, one dict each; none in a file that knows of none."""
        return self._rows("passes") if hdf5.has(self._entry, "passes") else []

    @property
    def table_response(self) -> dict[str, list[Any]]:
        """The identified response of the table, one list per column, one row per line; empty where there is none."""
        return self._decoded("table_response") if hdf5.has(self._entry, "table_response") else {}

    @property
    def fits(self) -> list[FitFinished]:
        """The models that were fitted, as they were said; none in a file that knows of none."""
        return fits.read(self._entry, self._complete("fits")) if hdf5.has(self._entry, "fits") else []

    @property
    def identified(self) -> Identified | None:
        """What was known of the specimen when the run had last found something; None where it identified nothing."""
        return findings.last(*self.findings.values())

    @property
    def findings(self) -> dict[str, list[dict[str, Any]]]:
        """The rows of what was identified, each time that it was said, and of its correlations."""
        return {name: self._rows(name) if hdf5.has(self._entry, name) else [] for name in findings.TABLES}

    @property
    def alignments(self) -> dict[int, tuple[Alignment, ...]]:
        """How sensors with clocks of their own were placed on the sample clock, by run; empty where there are none."""
        if not hdf5.has(self._instrument, "alignments"):
            return {}
        columns = self._decoded("alignments", self._instrument)
        runs = columns.pop("run")
        found = [Alignment(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)]
        return {run: tuple(one for of, one in zip(runs, found, strict=True) if of == run) for run in sorted({*runs})}

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
        folders = [
            "instrument/blocks",
            "events",
            "points",
            "instrument/alignments",
            *(name for name, _ in OWN_TABLES.values()),
            *fits.TABLES,
            *findings.TABLES,
        ]
        folders = [folder for folder in folders if hdf5.has(self._entry, folder)]
        paths += [f"{folder}/{name}" for folder in folders for name in hdf5.names(hdf5.group(self._entry, folder))]
        paths += [f"{PLOT}/{TIME}"] if self.format_version > 1 else []
        return [*paths, "instrument/drive/voltage", "status", "summary", "end_time"]

    def _decoded(self, name: str, parent: hdf5.Group | None = None) -> dict[str, list[Any]]:
        """The columns of a table that grew, in the order in which they were declared."""
        group = hdf5.group(parent or self._entry, name)
        columns = {column: decode(hdf5.dataset(group, column)) for column in hdf5.names(group)}
        whole = min([self._complete(name), *(len(values) for values in columns.values())])
        return {column: values[:whole] for column, values in columns.items()}

    def _rows(self, name: str) -> list[dict[str, Any]]:
        columns = self._decoded(name)
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
