"""Reads the file of a campaign: finished, still being written, or left by a killed writer."""

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from bench.record import hdf5, tables
from bench.record.errors import RecordError, reason
from bench.record.fields import decode
from bench.record.layout import COUNTED, FIXED_GROUPS, FORMAT, FORMAT_VERSION
from bench.record.tables import Column
from drivers.rig import Alignment, Channel, Counts
from sim.errors import InvalidInput

ALL = slice(None)


@dataclass(frozen=True)
class RecordedEvent:
    """An entry of the journal: bench time [s], the name of the event, and one line of text."""

    time: float
    kind: str
    text: str


def open_record(path: Path) -> "Record":
    """Open the file of a campaign; use it in a `with` statement.

    Raises InvalidInput when there is no such file or it is not one of ours, RecordError when it cannot be read.
    """
    if not path.is_file():
        raise InvalidInput("record", str(path), "there is no such file")
    try:
        file = hdf5.open_to_read(path)
    except OSError as error:
        if not hdf5.is_hdf5(path):
            raise InvalidInput("record", str(path), "it is not an HDF5 file") from error
        raise RecordError(
            f"{path} cannot be read ({reason(error)}): another program holds it, or it is damaged"
        ) from error
    if file.attrs.get("format") != FORMAT:
        file.close()
        raise InvalidInput("record", str(path), "it is an HDF5 file but no record of rocking-bench")
    if int(file.attrs["format_version"]) > FORMAT_VERSION:
        version = int(file.attrs["format_version"])
        file.close()
        raise InvalidInput("record", str(path), f"its format {version} is newer than this software reads: update it")
    return Record(file)


class Record:
    """What a file holds. Samples are read when asked for; `refresh` looks again at a file that is being written."""

    def __init__(self, file: hdf5.File) -> None:
        self._file = file
        self._entry = hdf5.group(file, "entry")
        self._instrument = hdf5.group(file, "entry/instrument")

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
        for path in self._growing:
            hdf5.dataset(self._entry, path).refresh()

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
        return f"{hdf5.read_text(self._entry, 'program_name')} {name.attrs['version']}"

    @cached_property
    def metadata(self) -> dict[str, str]:
        """The texts that were given to the recorder."""
        group = hdf5.group(self._entry, "metadata")
        return {name: hdf5.read_text(group, name) for name in group}

    @cached_property
    def sample_rate(self) -> float:
        """Samples per second and channel [1/s]."""
        return float(hdf5.dataset(self._instrument, "sample_rate")[()])

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """The inputs, in the order of the rig."""
        return tuple(self._channel(name) for name in self._instrument if f"{name}/counts" in self._instrument)

    @property
    def rows(self) -> int:
        """How many samples every channel and the drive have."""
        stored = [self._counts(channel.name) for channel in self.channels]
        stored.append(hdf5.dataset(self._instrument, "drive/voltage"))
        return min(self._complete("samples"), *(data.shape[0] for data in stored))

    def counts(self, name: str, rows: slice = ALL) -> Counts:
        """Counts of a channel as converted. Raises InvalidInput for an unknown channel."""
        return self._cut(self._counts(self._channel_named(name).name), rows)

    def values(self, name: str, rows: slice = ALL) -> NDArray[np.float64]:
        """Values of a channel in its unit; NaN where the counts are not a measurement."""
        return self._channel_named(name).to_unit(self.counts(name, rows))

    def drive(self, rows: slice = ALL) -> NDArray[np.float32]:
        """The drive as sent [V]."""
        return self._cut(hdf5.dataset(self._instrument, "drive/voltage"), rows)

    @property
    def blocks(self) -> dict[str, NDArray[Any]]:
        """Where the blocks begin: arrays `row`, `run`, `first` (sample index in the run) and `time` [s] when read."""
        columns = {
            name: hdf5.dataset(self._instrument, f"blocks/{name}")[:] for name in ("row", "run", "first", "time")
        }
        whole = min(self._complete("blocks"), *(len(values) for values in columns.values()))
        # the samples of the last blocks may still be to come
        count = int(np.searchsorted(columns["row"][:whole], self.rows))
        return {name: values[:count] for name, values in columns.items()}

    def time(self, rows: slice = ALL) -> NDArray[np.float64]:
        """Seconds since the rig was armed, per row: sample index over sample rate. Runs follow one another."""
        index = np.arange(*rows.indices(self.rows))
        blocks = self.blocks
        block = np.searchsorted(blocks["row"], index, side="right") - 1
        return (blocks["first"][block] + index - blocks["row"][block]) / self.sample_rate

    @property
    def events(self) -> list[RecordedEvent]:
        """The journal."""
        columns = self._decoded("events")
        return [RecordedEvent(*row) for row in zip(columns["time"], columns["kind"], columns["text"], strict=True)]

    @property
    def points(self) -> list[dict[str, Any]]:
        """The results, one dict per point with the fields of its type; enumerations are texts, absent values None."""
        columns = self._decoded("points")
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    @property
    def estimates(self) -> dict[str, list[Any]]:
        """The running estimates, one list per column; an absent value is None, an unknown one NaN."""
        return self._decoded("estimates")

    @property
    def alignments(self) -> dict[int, tuple[Alignment, ...]]:
        """How sensors with clocks of their own were placed on the sample clock, by run; empty where there are none."""
        if "alignments" not in self._instrument:
            return {}
        columns = self._decoded("alignments", self._instrument)
        runs = columns.pop("run")
        found = [Alignment(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)]
        return {run: tuple(one for of, one in zip(runs, found, strict=True) if of == run) for run in sorted({*runs})}

    @cached_property
    def tables(self) -> dict[str, dict[str, Column]]:
        """The tables that were stored before the run, such as "prediction"."""
        others = {name: hdf5.group(self._entry, name) for name in self._entry if name not in FIXED_GROUPS}
        return {name: tables.read(group) for name, group in others.items() if "NX_class" in group.attrs}

    @cached_property
    def _growing(self) -> list[str]:
        """Paths of the datasets that change while the file is written."""
        paths = [f"instrument/{channel.name}/counts" for channel in self.channels]
        folders = ["instrument/blocks", "events", "estimates", "points"]
        folders += ["instrument/alignments"] if "alignments" in self._instrument else []
        paths += [f"{folder}/{name}" for folder in folders for name in hdf5.group(self._entry, folder)]
        return ["complete", *paths, "instrument/drive/voltage", "status", "summary", "end_time"]

    def _decoded(self, name: str, parent: hdf5.Group | None = None) -> dict[str, list[Any]]:
        """The columns of a table that grew, in the order in which they were declared."""
        group = hdf5.group(parent or self._entry, name)
        columns = {column: decode(hdf5.dataset(group, column)) for column in group}
        whole = min(self._complete(name), *(len(values) for values in columns.values()))
        return {column: values[:whole] for column, values in columns.items()}

    def _complete(self, name: str) -> int:
        """How many rows of a part are whole, whatever the length of its datasets."""
        return int(hdf5.dataset(self._entry, "complete")[COUNTED.index(name)])

    def _counts(self, name: str) -> hdf5.Dataset:
        return hdf5.dataset(self._instrument, f"{name}/counts")

    def _cut(self, stored: hdf5.Dataset, rows: slice) -> NDArray[Any]:
        start, stop, step = rows.indices(self.rows)
        if step < 1:
            raise InvalidInput("step of the rows", step, "it must be positive")
        return stored[start : max(start, stop) : step]

    def _channel_named(self, name: str) -> Channel:
        for channel in self.channels:
            if channel.name == name:
                return channel
        raise InvalidInput("channel", name, "one of " + ", ".join(channel.name for channel in self.channels))

    def _channel(self, name: str) -> Channel:
        attrs = self._counts(name).attrs
        low, high = (int(end) for end in attrs["valid"])
        return Channel(
            name=name,
            quantity=str(attrs["quantity"]),
            unit=str(attrs["value_units"]),
            scale=float(attrs["scale"]),
            offset=float(attrs["offset"]),
            valid=(low, high),
            device=str(attrs["device"]),
            higher=tuple(float(term) for term in attrs.get("higher", ())),
            faults={int(count): text for count, text in json.loads(attrs.get("faults", "{}")).items()},
        )
