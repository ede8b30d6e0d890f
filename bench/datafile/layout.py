"""The skeleton of the file. All groups and datasets are created before the first sample, because none can be added to a
file that is being read. `docs/file-format.md` describes the layout for users.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from functools import cache
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from bench.datafile import hdf5, tables
from bench.datafile.checksums import Checksums
from bench.datafile.declared import (
    FIXED_ENTRIES,
    FIXED_GROUPS,
    FIXED_INSTRUMENTS,
    RESERVED,
    TABLES,
    counters,
    event_tables,
)
from bench.datafile.fields import Field, fields_of
from bench.datafile.opening import FORMAT, FORMAT_VERSION, INTERVALS, WORDING
from bench.datafile.rows import Growing, Rows, rows_of
from bench.datafile.samples import CHUNK_TIME, Samples, chunk_of, companions, create_plot
from bench.datafile.tables import Table
from bench.events import Event
from drivers.rig import Channel
from sim.errors import InvalidInput
from sim.parameters import Parameters

STATUS_WIDTH, TIME_WIDTH, SUMMARY_WIDTH = 16, 40, 4096


class Status(StrEnum):
    """Status of a campaign in its file; only a recovery sets "interrupted"."""

    RUNNING = "running"
    COMPLETED = "completed"
    STOPPED = "stopped"
    ABORTED = "aborted"
    HALTED = "halted"
    FAILED = "failed"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class Skeleton:
    """Planned contents of the file, checked before the file is created."""

    title: str
    channels: Sequence[Channel]
    sample_rate: float
    point_type: type[Parameters]
    metadata: Mapping[str, str]
    tables: Mapping[str, Table]
    events: Sequence[type[Event]] = ()
    """Events of the protocol that have a table in the file."""
    chunk_time: float = CHUNK_TIME
    """Duration of a chunk of samples [s]."""

    @property
    def own(self) -> dict[str, tuple[Field, ...]]:
        """Fields of the tables of `events`, by path below /entry."""
        return {table.path: table.fields for table in event_tables(self.events).values()}

    def check(self) -> None:
        """Raise InvalidInput for contents that the file cannot store."""
        if not self.channels:
            raise InvalidInput("channels", 0, "a data file needs at least one channel")
        if not self.sample_rate > 0.0:
            raise InvalidInput("sample_rate", self.sample_rate, "it must be a positive number of samples per second")
        names = [channel.name for channel in self.channels]
        paths = [table.path for table in event_tables(self.events).values()]
        _check_names("channel", names, (*FIXED_INSTRUMENTS, *(each for name in names for each in companions(name))))
        _check_names("metadata entry", list(self.metadata), ())
        _check_names("table of events", paths, (*TABLES, *RESERVED, *FIXED_ENTRIES))
        _check_names("table", list(self.tables), (*FIXED_GROUPS, *FIXED_ENTRIES, *self.own))
        for name, table in self.tables.items():
            _check_names(f"column of table {name}", list(table), ())
            tables.check(name, table)
        fields_of(self.point_type)


@dataclass(frozen=True)
class Parts:
    """The parts of a new file that grow or change."""

    samples: Samples
    rows: Mapping[str, Rows]
    grown: Sequence[Growing]
    complete: hdf5.Dataset
    status: hdf5.Dataset
    summary: hdf5.Dataset
    end_time: hdf5.Dataset
    checksums: Checksums

    def reopened(self, file: hdf5.File) -> "Parts":
        """Connect every part to the reopened file, and return the parts."""
        for each in self.grown:
            each.reopen(file)
        self.checksums.reopen(hdf5.group(file, "entry"))
        ends = {name: hdf5.dataset(file, f"entry/{name}") for name in ("complete", "status", "summary", "end_time")}
        return replace(self, **ends)


def build(file: hdf5.File, skeleton: Skeleton) -> Parts:
    """Create every group and dataset of a checked skeleton."""
    hdf5.describe(file, NX_class="NXroot", default="entry", format=FORMAT, format_version=FORMAT_VERSION)
    hdf5.describe(file, wording=WORDING, intervals=INTERVALS)
    entry = hdf5.create_group(file, "entry", "NXentry")
    hdf5.describe(entry, default="data")
    hdf5.write_text(entry, "title", skeleton.title)
    hdf5.write_text(entry, "start_time", now(), description="wall-clock time of the creation of this file, ISO 8601")
    hdf5.describe(hdf5.write_text(entry, "program_name", "rocking-bench"), version=software_version())

    metadata = hdf5.create_group(entry, "metadata", "NXcollection")
    for name, text in skeleton.metadata.items():
        hdf5.write_text(metadata, name, text)
    if operator := skeleton.metadata.get("operator"):
        hdf5.write_text(hdf5.create_group(entry, "user", "NXuser"), "name", operator)
    if notes := skeleton.metadata.get("notes"):
        hdf5.write_text(hdf5.create_group(entry, "notes", "NXnote"), "data", notes)
    for name, table in skeleton.tables.items():
        tables.write(entry, name, table)

    instrument = hdf5.create_group(entry, "instrument", "NXinstrument")
    hdf5.write_numbers(
        instrument, "sample_rate", skeleton.sample_rate, unit="Hz", description="samples per second of every channel"
    )
    chunk = chunk_of(skeleton.sample_rate, skeleton.chunk_time)
    samples = Samples(instrument, skeleton.channels, chunk, create_plot(entry, skeleton.channels, chunk))
    growing, rows = {**TABLES, **skeleton.own, "points": fields_of(skeleton.point_type)}, dict[str, Rows]()
    for path, fields in growing.items():
        folder, _, name = path.rpartition("/")
        rows[name] = rows_of(instrument if folder else entry, name, fields, samples.packer)
    replaced = create_ends(entry, counters(skeleton.own))
    grown = [*samples.grown, *(each for table in rows.values() for each in table.grown)]
    changing = [*(each.path for each in grown), *(each.name for each in replaced)]
    checksums = Checksums(entry, changing, {f"/entry/{path}": fields for path, fields in growing.items()})
    return Parts(samples, rows, grown, *replaced, checksums)


def create_ends(
    entry: hdf5.Group, counted: Sequence[str]
) -> tuple[hdf5.Dataset, hdf5.Dataset, hdf5.Dataset, hdf5.Dataset]:
    """Create `complete`, which holds the row counts of the parts `counted`, and `status`, `summary` and `end_time`,
    with initial values.
    """
    complete = hdf5.write_numbers(
        entry, "complete", np.zeros(len(counted), dtype=np.int64), unit="1", description="complete rows of each part"
    )
    hdf5.describe(complete, parts=" ".join(counted))
    return (
        complete,
        hdf5.write_text(entry, "status", Status.RUNNING, width=STATUS_WIDTH),
        hdf5.write_text(entry, "summary", "", width=SUMMARY_WIDTH, description="reason for the end of the campaign"),
        hdf5.write_text(
            entry,
            "end_time",
            "",
            width=TIME_WIDTH,
            description="wall-clock time of the end of the campaign, ISO 8601; empty while it is running",
        ),
    )


def now() -> str:
    """The wall-clock time as ISO 8601 with time zone."""
    return datetime.now().astimezone().isoformat(timespec="milliseconds")


@cache
def software_version() -> str:
    """The installed version of this software, or "unknown" if it runs without installation."""
    try:
        return version("rocking-bench")
    except PackageNotFoundError:
        return "unknown"


def _check_names(item: str, names: Sequence[str], taken: Sequence[str]) -> None:
    for name in names:
        if not name or "/" in name or "\0" in name or name.strip(".") == "":
            raise InvalidInput(
                item, name, "a name in the file must not be empty, consist only of dots, or contain '/' or NUL"
            )
        if name in taken or names.count(name) > 1:
            raise InvalidInput(item, name, "this name is already used in the file")
