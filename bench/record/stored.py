"""The samples of a file: channels, drive and time, by row and by run."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.record import hdf5
from bench.record.opening import counts
from bench.record.samples import read_channels
from bench.record.series import RecordedRun, Series
from drivers.rig import Channel, Counts
from sim.errors import InvalidInput

ALL = slice(None)


class StoredSamples:
    """What an open file holds of the samples. Everything is read when it is asked for."""

    def __init__(self, entry: hdf5.Group) -> None:
        self._entry = entry
        self._instrument = hdf5.group(entry, "instrument")
        self._count_again()

    @cached_property
    def sample_rate(self) -> float:
        """Samples per second and channel [1/s]."""
        return float(hdf5.read(hdf5.dataset(self._instrument, "sample_rate")))

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """The inputs, in the order of the rig."""
        return read_channels(self._instrument)

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

    @cached_property
    def blocks(self) -> dict[str, NDArray[Any]]:
        """Where the blocks begin: arrays `row`, `run`, `first` (sample index in the run) and `time` [s] when read."""
        stored = {name: hdf5.dataset(self._instrument, f"blocks/{name}") for name in ("row", "run", "first", "time")}
        columns = {name: hdf5.read(each, slice(None)) for name, each in stored.items()}
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
    def runs(self) -> tuple[RecordedRun, ...]:
        """The runs in their order, with their channels as arrays; as far as they are in the file now."""
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
        drive = Series("drive", "drive as sent", "V", self.drive, rows)
        return RecordedRun(number, rows, series, drive, Series("time", "time since arming", "s", self.time, rows))

    @cached_property
    def counted(self) -> Mapping[str, int]:
        """How many rows of every part are whole, whatever the length of its datasets; older files have fewer parts.

        It is read once and ahead of what it counts, so that all that is read of a living file is of one moment.
        """
        return counts(self._entry)

    def _count_again(self) -> None:
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
