"""Lazy arrays of a file's samples: channels, drive and time, by row and by run."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.datafile import hdf5
from bench.datafile.hdf5_reading import DataFileError, reading
from bench.datafile.opening import counts
from bench.datafile.samples import read_channels
from drivers.border import HIGHEST_RATE, LOWEST_RATE
from drivers.rig import Channel, Counts, RawValues
from sim.errors import InvalidInput

RAW = "instrument/raw_values"

ROWS_AT_ONCE = 2**18


@dataclass(frozen=True)
class Series:
    """A one-dimensional array in the file: `series[i]`, `series[a:b]`, `series[:]` and `numpy.asarray(series)`.

    `unit` and `quantity` describe its values. No values are kept in memory.
    """

    name: str
    quantity: str
    unit: str
    read: Callable[[slice], NDArray[Any]]
    rows: range

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, key: int | slice) -> Any:
        if isinstance(key, slice):
            part = self.rows[key]
            if part.step < 0:
                return self.read(slice(part[-1], part[0] + 1, -part.step))[::-1] if part else self.read(slice(0, 0))
            return self.read(slice(part.start, max(part.start, part.stop), part.step))
        row = self.rows[key]
        return self.read(slice(row, row + 1))[0]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        if copy is False:
            raise ValueError("an array of a file's values is always a copy: use copy=True or omit it")
        return np.asarray(self[:], dtype=dtype)

    def pieces(self, size: int = ROWS_AT_ONCE) -> Iterator[NDArray[Any]]:
        """Yields the values in order, in arrays of at most `size` values."""
        for start in range(0, len(self), size):
            yield self[start : start + size]


@dataclass(frozen=True)
class RecordedRun:
    """One run, from arming to stopping: its `number`, counted from 1, its `rows` in the file and its arrays by channel.

    `time` is in seconds since the rig was armed; it jumps where samples are missing.
    """

    number: int
    rows: range
    channels: Mapping[str, Series]
    drive: Series
    time: Series


ALL = slice(None)


class SampleReader:
    """The samples of an open file, read on access."""

    def __init__(self, entry: hdf5.Group) -> None:
        self._entry = entry
        self._instrument = hdf5.group(entry, "instrument")
        self._refresh_counts()

    @cached_property
    def sample_rate(self) -> float:
        """Samples per second per channel [1/s]."""
        rate = hdf5.read(hdf5.dataset(self._instrument, "sample_rate"))
        with reading(f"{self._instrument.name}/sample_rate"):
            rate = float(rate)
        if not LOWEST_RATE <= rate <= HIGHEST_RATE:
            allowed = f"it must be between {LOWEST_RATE:g}/s and {HIGHEST_RATE:g}/s"
            raise DataFileError(f"{self._instrument.name}/sample_rate is {rate:g}, but {allowed}: the file is damaged")
        return rate

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """The input channels, in the order of the rig."""
        return read_channels(self._instrument)

    @property
    def rows(self) -> int:
        """Number of complete samples, the same for every channel and the drive."""
        stored = [self._counts(channel.name) for channel in self.channels]
        stored.append(hdf5.dataset(self._instrument, "drive/voltage"))
        return min(self._complete("samples"), *(data.shape[0] for data in stored))

    def counts(self, name: str, rows: slice = ALL) -> Counts:
        """Raw counts of a channel. Raises InvalidInput for an unknown channel."""
        return self._cut(self._counts(self._channel_named(name).name), rows)

    def values(self, name: str, rows: slice = ALL) -> NDArray[np.float64]:
        """Values of a channel, in its unit; NaN where the counts are invalid."""
        return self._channel_named(name).to_unit(self.counts(name, rows))

    def drive(self, rows: slice = ALL) -> NDArray[np.float32]:
        """The drive as sent to the amplifier [V]."""
        return self._cut(hdf5.dataset(self._instrument, "drive/voltage"), rows)

    @cached_property
    def blocks(self) -> dict[str, NDArray[Any]]:
        """Start of each block, as the arrays `row`, `run`, `first` (sample index in the run) and `time` (when the block
        was read [s]).
        """
        stored = {name: hdf5.dataset(self._instrument, f"blocks/{name}") for name in ("row", "run", "first", "time")}
        columns = {name: hdf5.read(each, slice(None)) for name, each in stored.items()}
        whole = min(self._complete("blocks"), *(len(values) for values in columns.values()))
        # the samples of the last blocks may not have been written yet
        count = int(np.searchsorted(columns["row"][:whole], self.rows))
        return {name: values[:count] for name, values in columns.items()}

    def time(self, rows: slice = ALL) -> NDArray[np.float64]:
        """Seconds since the rig was armed, for each row: sample index divided by sample rate. Runs are concatenated."""
        index = np.arange(*rows.indices(self.rows))
        blocks = self.blocks
        block = np.searchsorted(blocks["row"], index, side="right") - 1
        return (blocks["first"][block] + index - blocks["row"][block]) / self.sample_rate

    @property
    def runs(self) -> tuple[RecordedRun, ...]:
        """The runs in the file so far, in order, with their channels as arrays."""
        blocks, rows = self.blocks, self.rows
        begins = np.flatnonzero(np.diff(blocks["run"], prepend=-1))
        ends = [*blocks["row"][begins[1:]].tolist(), rows][: len(begins)]
        return tuple(
            self._run(int(blocks["run"][block]), range(int(blocks["row"][block]), end))
            for block, end in zip(begins, ends, strict=True)
        )

    def _run(self, number: int, rows: range) -> RecordedRun:
        series = {
            channel.name: Series(
                channel.name,
                channel.quantity,
                channel.unit,
                lambda part, name=channel.name: self.values(name, part),
                rows,
            )
            for channel in self.channels
        }
        drive = Series("drive", "drive as sent to the amplifier", "V", self.drive, rows)
        return RecordedRun(number, rows, series, drive, Series("time", "time since arming", "s", self.time, rows))

    def raw_values(self, name: str, run: int) -> RawValues:
        """The values received in `run` from the sensor of channel `name`, if its clock is free-running; otherwise
        empty.
        """
        sensor = self._number_of(name)
        columns = ("index", "time", "code", "arrival")
        found = {column: [np.zeros(0, np.int64)] for column in columns}
        if hdf5.has(self._entry, RAW):
            table = hdf5.group(self._entry, RAW)
            for begin in range(0, (rows := self._complete("raw_values")), ROWS_AT_ONCE):
                part = slice(begin, min(begin + ROWS_AT_ONCE, rows))
                chosen = hdf5.read(hdf5.dataset(table, "run"), part) == run
                chosen &= hdf5.read(hdf5.dataset(table, "sensor"), part) == sensor
                for column in columns if chosen.any() else ():
                    found[column].append(hdf5.read(hdf5.dataset(table, column), part)[chosen])
        return RawValues(name, *(np.concatenate(found[column]) for column in columns))

    def _number_of(self, name: str) -> int:
        """Number of a channel in the rig. A recovered file has the groups of all channels of the rig, but no counts of
        a channel whose conversion is lost.
        """
        known = self._channel_named(name).name
        rig = [each for each in hdf5.names(self._instrument) if hdf5.has(self._instrument, f"{each}/measurement")]
        channels = [channel.name for channel in self.channels]
        return (rig if known in rig else channels).index(known)

    @cached_property
    def counted(self) -> Mapping[str, int]:
        """Number of complete rows of each part, which may be less than the length of its datasets; older files have
        fewer parts.

        Read once, before the data, for a consistent view of a growing file.
        """
        return counts(self._entry)

    def _refresh_counts(self) -> None:
        hdf5.dataset(self._entry, "complete").refresh()
        self.__dict__.pop("counted", None)
        self.__dict__.pop("blocks", None)
        _ = self.counted

    def _complete(self, name: str) -> int:
        return self.counted[name]

    def _counts(self, name: str) -> hdf5.Dataset:
        return hdf5.dataset(self._instrument, f"{name}/counts")

    def _cut(self, stored: hdf5.Dataset, rows: slice) -> NDArray[Any]:
        start, stop, step = rows.indices(self.rows)
        if step < 1:
            raise InvalidInput("step of the rows", step, "it must be positive")
        return hdf5.read(stored, slice(start, max(start, stop), step))

    def _channel_named(self, name: str) -> Channel:
        for channel in self.channels:
            if channel.name == name:
                return channel
        raise InvalidInput("channel", name, "one of " + ", ".join(channel.name for channel in self.channels))
