"""The skeleton of the file: all is created before the first sample, for nothing can be added while it may be read.

`docs/file-format.md` is the same thing for readers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from bench.record import hdf5, tables
from bench.record.fields import Field, Kind, fields_of
from bench.record.rows import Rows
from bench.record.samples import Samples
from bench.record.tables import Table
from drivers.rig import Channel
from sim.errors import InvalidInput
from sim.parameters import Parameters

FORMAT = "rocking-bench record"
FORMAT_VERSION = 1
STATUS_WIDTH, TIME_WIDTH, SUMMARY_WIDTH = 16, 40, 4096
FIXED_GROUPS = ("data", "estimates", "events", "instrument", "metadata", "points")
FIXED_ENTRIES = ("complete", "end_time", "program_name", "start_time", "status", "summary", "title")
COUNTED = ("samples", "blocks", "events", "estimates", "points", "alignments")
"""What is counted in the dataset `complete`: rows beyond were still on their way when the disk or the writer failed."""

FIXED_INSTRUMENTS = ("alignments", "blocks", "drive", "sample_rate")


class Status(StrEnum):
    """How the campaign stands, or how it ended."""

    RUNNING = "running"
    COMPLETED = "completed"
    STOPPED = "stopped"
    ABORTED = "aborted"
    HALTED = "halted"
    FAILED = "failed"


BLOCKS = (
    Field("row", Kind.WHOLE, "1", "row of the samples at which the block begins"),
    Field("run", Kind.WHOLE, "1", "how many times the rig had been armed"),
    Field("first", Kind.WHOLE, "1", "index of the block's first sample, counted from 0 in each run"),
    Field("time", Kind.REAL, "s", "bench time at which the block had been read"),
)
ALIGNMENTS = (
    Field("run", Kind.WHOLE, "1", "how many times the rig had been armed"),
    Field("sensor", Kind.TEXT, "", "name of the channel"),
    Field("offset", Kind.REAL, "s", "time of the run at which second 0 of the sensor's clock stands, without delay"),
    Field("rate", Kind.REAL, "1", "seconds of the sample clock per second of the sensor's clock"),
    Field("residual", Kind.REAL, "s", "root mean square of what the fit leaves of the readings of the clocks"),
    Field("delay", Kind.REAL, "s", "fixed delay by which the values were placed later, as configured"),
    Field("values", Kind.WHOLE, "1", "values that the sensor gave"),
    Field("lost", Kind.WHOLE, "1", "values that it should have given and that did not arrive"),
)
EVENTS = (
    Field("time", Kind.REAL, "s", "bench time"),
    Field("kind", Kind.TEXT, "", "what happened: the name of the event"),
    Field("text", Kind.TEXT, "", "one line for the reader"),
)
ESTIMATES = (
    Field("time", Kind.REAL, "s", "bench time"),
    Field("omega", Kind.REAL, "rad/s", "circular frequency of the base motion"),
    Field("beta", Kind.REAL, "1", "stiffness ratio of the coupling spring; absent for the bare frame", optional=True),
    Field("cycles", Kind.WHOLE, "1", "cycles over which the estimate was made"),
    Field("drift_peak", Kind.REAL, "m", "peak drift"),
    Field("alpha_2", Kind.REAL, "1", "running gain of the peak drift, coupled over bare"),
    Field("uncertainty", Kind.REAL, "1", "expanded uncertainty of alpha_2 (k = 2)"),
    Field("predicted", Kind.REAL, "1", "predicted alpha_2"),
)


@dataclass(frozen=True)
class Skeleton:
    """What the file is to hold; checked before it is created."""

    title: str
    channels: Sequence[Channel]
    sample_rate: float
    point_type: type[Parameters]
    metadata: Mapping[str, str]
    tables: Mapping[str, Table]

    def check(self) -> None:
        """Raise InvalidInput for what could not be stored."""
        if not self.channels:
            raise InvalidInput("channels", 0, "a record needs at least one")
        if not self.sample_rate > 0.0:
            raise InvalidInput("sample_rate", self.sample_rate, "it must be positive samples per second")
        _check_names("channel", [channel.name for channel in self.channels], FIXED_INSTRUMENTS)
        _check_names("metadata entry", list(self.metadata), ())
        _check_names("table", list(self.tables), (*FIXED_GROUPS, *FIXED_ENTRIES))
        for name, table in self.tables.items():
            _check_names(f"column of table {name}", list(table), ())
            tables.check(name, table)
        fields_of(self.point_type)


@dataclass(frozen=True)
class Parts:
    """The parts of a new file that grow or change."""

    samples: Samples
    blocks: Rows
    events: Rows
    estimates: Rows
    points: Rows
    alignments: Rows
    complete: hdf5.Dataset
    status: hdf5.Dataset
    summary: hdf5.Dataset
    end_time: hdf5.Dataset


def build(file: hdf5.File, skeleton: Skeleton) -> Parts:
    """Create every group and dataset of a checked skeleton."""
    file.attrs["NX_class"], file.attrs["default"] = "NXroot", "entry"
    file.attrs["format"], file.attrs["format_version"] = FORMAT, FORMAT_VERSION
    entry = hdf5.create_group(file, "entry", "NXentry")
    entry.attrs["default"] = "data"
    hdf5.write_text(entry, "title", skeleton.title)
    hdf5.write_text(entry, "start_time", now(), description="wall clock at the creation of this file, ISO 8601")
    hdf5.write_text(entry, "program_name", "rocking-bench").attrs["version"] = software_version()

    metadata = hdf5.create_group(entry, "metadata", "NXcollection")
    for name, text in skeleton.metadata.items():
        hdf5.write_text(metadata, name, text)
    for name, table in skeleton.tables.items():
        tables.write(entry, name, table)

    instrument = hdf5.create_group(entry, "instrument", "NXinstrument")
    hdf5.write_numbers(
        instrument, "sample_rate", skeleton.sample_rate, unit="Hz", description="samples per second of every channel"
    )
    samples = Samples(instrument, skeleton.channels, skeleton.sample_rate)
    _create_default_plot(entry, [channel.name for channel in skeleton.channels])
    return Parts(
        samples=samples,
        blocks=Rows(instrument, "blocks", BLOCKS),
        events=Rows(entry, "events", EVENTS),
        estimates=Rows(entry, "estimates", ESTIMATES),
        points=Rows(entry, "points", fields_of(skeleton.point_type)),
        alignments=Rows(instrument, "alignments", ALIGNMENTS),
        complete=hdf5.write_numbers(
            entry, "complete", np.zeros(len(COUNTED), dtype=np.int64), unit="1", description=f"rows of {COUNTED}"
        ),
        status=hdf5.write_text(entry, "status", Status.RUNNING, width=STATUS_WIDTH),
        summary=hdf5.write_text(entry, "summary", "", width=SUMMARY_WIDTH, description="how the campaign ended"),
        end_time=hdf5.write_text(
            entry, "end_time", "", width=TIME_WIDTH, description="wall clock at its end, ISO 8601; empty while running"
        ),
    )


def now() -> str:
    """The wall clock as ISO 8601 with the zone."""
    return datetime.now().astimezone().isoformat(timespec="milliseconds")


def software_version() -> str:
    """The installed version of this software."""
    try:
        return version("rocking-bench")
    except PackageNotFoundError:
        return "unknown"


def _create_default_plot(entry: hdf5.Group, names: Sequence[str]) -> None:
    """All channels against the row number: links only, because a time axis would weigh more than all the counts."""
    data = hdf5.create_group(entry, "data", "NXdata")
    data.attrs["signal"], data.attrs["axes"] = names[0], ["."]
    if len(names) > 1:
        data.attrs["auxiliary_signals"] = list(names[1:])
    data.attrs["title"] = "counts of all channels against the row number"
    for name in names:
        hdf5.link(data, name, f"/entry/instrument/{name}/counts")


def _check_names(item: str, names: Sequence[str], taken: Sequence[str]) -> None:
    for name in names:
        if not name or "/" in name or "\0" in name or name.strip(".") == "":
            raise InvalidInput(item, name, "a name in the file must not be empty, be only dots, or contain '/'")
        if name in taken or names.count(name) > 1:
            raise InvalidInput(item, name, "this name is already used in the file")
