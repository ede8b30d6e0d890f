"""The samples of all channels and of the drive with their times, appended in whole chunks.

Rewriting a compressed chunk leaves its first copy as unused space. Rows are therefore buffered until a chunk is full,
unless they must be written immediately.
"""

import json
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bench.datafile import hdf5
from bench.datafile.hdf5_reading import reading
from bench.datafile.rows import Growing, Packer
from drivers.rig import Channel, Counts

PLOT, TIME = "data", "time"


def create_plot(entry: hdf5.Group, channels: Sequence[Channel], chunk: int) -> hdf5.Dataset:
    """Create the plot of the first channel, and of all channels of the same kind, against time, with links to the other
    channels. Returns its empty time axis, to which the writer appends.

    The counts are not converted: by the NXdata standard, values are (counts + `<name>_offset`) *
    `<name>_scaling_factor`.
    """
    data = hdf5.create_group(entry, PLOT, "NXdata")
    first, *others = channels
    data.attrs["signal"], data.attrs["axes"] = first.name, [TIME]
    data.attrs[f"{TIME}_indices"] = 0
    # channels of another kind have a different scale and would flatten the plot
    alike = [channel.name for channel in others if (channel.quantity, channel.unit) == (first.quantity, first.unit)]
    if alike:
        data.attrs["auxiliary_signals"] = alike
    data.attrs["title"] = f"{first.quantity}, raw counts"
    time = hdf5.grow_numbers(
        data,
        TIME,
        "<f8",
        unit="s",
        description="bench time of each row, for plots; the table of blocks contains the exact sample indices",
        chunk=chunk,
        compress=True,
    )
    hdf5.describe(time, long_name="bench time [s]")
    for channel in channels:
        hdf5.link(data, channel.name, f"/entry/instrument/{channel.name}/counts")
        factor, offset = companions(channel.name)
        hdf5.write_numbers(data, factor, channel.scale, unit=channel.unit, description="value per count (NXdata)")
        hdf5.write_numbers(
            data,
            offset,
            channel.offset / channel.scale,
            unit="counts",
            description="offset added to the counts before scaling (NXdata)",
        )
    return time


def companions(name: str) -> tuple[str, str]:
    """Names of a channel's scaling factor and offset in the plot."""
    return f"{name}_scaling_factor", f"{name}_offset"


class Timeline:
    """Times that rise by one sample period within a run, and jump where samples are missing.

    The time at which the first block of a run was read determines the origin of the run, so that all its times include
    the delay of that read.
    """

    def __init__(self, sample_rate: float) -> None:
        self._rate = sample_rate
        self._run: int | None = None
        self._origin = 0.0
        self._last = -np.inf

    def seconds(self, time: float, run: int, first: int, n: int) -> NDArray[np.float64]:
        """Times [s], shape (n,), of a block that begins with sample `first` of `run` and was read at `time` [s]."""
        if run != self._run:
            # whole microseconds compress better; `max` prevents overlapping runs even if the bench clock is wrong
            begin = max(time - n / self._rate, self._last + 1.0 / self._rate)
            self._run, self._origin = run, round(begin - first / self._rate, 6)
        times = self._origin + np.arange(first, first + n) / self._rate
        self._last = float(times[-1]) if n else self._last
        return times


CHUNK_TIME = 0.5
"""Duration of a chunk of samples [s]; in a real-time run, the longest time for which samples are buffered."""

VIRTUAL_CHUNK_TIME = 2.0
"""Duration of a chunk of samples in virtual time [s], which can be a hundred times faster than real time: compressing
these larger chunks takes about half the time.
"""


class Samples:
    """Datasets of the counts of each channel, the drive as float32 and the time as float64, always of equal length.

    `time` is the dataset of the times, with chunks of `chunk` rows.
    """

    def __init__(self, instrument: hdf5.Group, channels: Sequence[Channel], chunk: int, time: hdf5.Dataset) -> None:
        self.chunk = chunk
        stored = [_create_channel(instrument, channel, self.chunk) for channel in channels]
        stored += [create_drive(instrument, self.chunk), time]
        self.packer = Packer()
        self.grown = [Growing(instrument, each.name, self.packer) for each in stored]
        self._pending: list[tuple[Counts, NDArray[np.float32], NDArray[np.float64]]] = []
        self._waiting = 0
        self._written = 0

    def __len__(self) -> int:
        return self._written + self._waiting

    @property
    def written(self) -> int:
        """Number of rows passed to the file."""
        return self._written

    @property
    def full_chunks(self) -> int:
        """Number of complete chunks among the pending rows."""
        return len(self) // self.chunk - self._written // self.chunk

    def add(self, counts: Counts, drive: NDArray[np.float32], seconds: NDArray[np.float64]) -> None:
        """Append rows: counts of shape (n_channels, n), drive [V] and bench time [s] of shape (n,)."""
        self._pending.append((counts, drive, seconds))
        self._waiting += len(drive)

    def write(self, *, partial: bool) -> None:
        """Write the pending rows to the file: all of them, or only complete chunks."""
        end = len(self) if partial else len(self) // self.chunk * self.chunk
        count = end - self._written
        if count <= 0:
            return
        blocks, drives, times = zip(*self._pending, strict=True)
        counts, drive, seconds = np.concatenate(blocks, axis=1), np.concatenate(drives), np.concatenate(times)
        for stored, values in zip(self.grown, (*counts, drive, seconds), strict=True):
            stored.append(values[:count])
        self._written = end
        self._waiting -= count
        self._pending = [(counts[:, count:], drive[count:], seconds[count:])] if self._waiting else []

    def close(self) -> None:
        """Release the compression threads."""
        self.packer.close()


def chunk_of(sample_rate: float, duration: float = CHUNK_TIME) -> int:
    """Number of rows in a chunk that holds `duration` [s] of samples."""
    return max(1, round(duration * sample_rate))


def read_channels(instrument: hdf5.Group) -> tuple[Channel, ...]:
    """The input channels, in the order of the rig. Raises DataFileError if one is damaged."""
    names = [name for name in hdf5.names(instrument) if hdf5.has(instrument, f"{name}/counts")]
    return tuple(read_channel(instrument, name) for name in names)


def read_channel(instrument: hdf5.Group, name: str) -> Channel:
    """The channel `name`, with its conversion and valid range. Raises DataFileError if they are damaged."""
    stored = hdf5.dataset(instrument, f"{name}/counts")
    with reading(f"the conversion of {stored.name}"):
        value, named = partial(hdf5.attribute_value, stored), stored.attrs
        low, high = (int(end) for end in value("valid"))
        return Channel(
            name=name,
            quantity=str(value("quantity")),
            unit=str(value("value_units")),
            scale=float(value("scale")),
            offset=float(value("offset")),
            valid=(low, high),
            device=str(value("device")),
            higher=tuple(float(term) for term in (value("higher") if "higher" in named else ())),
            faults={
                int(count): text for count, text in json.loads(value("faults") if "faults" in named else "{}").items()
            },
            delay=float(value("delay") if "delay" in named else 0.0),
            delay_uncertainty=float(value("delay_uncertainty") if "delay_uncertainty" in named else 0.0),
        )


def _create_channel(instrument: hdf5.Group, channel: Channel, chunk: int) -> hdf5.Dataset:
    sensor = hdf5.create_group(instrument, channel.name, "NXsensor")
    hdf5.write_text(sensor, "measurement", channel.quantity)
    hdf5.write_text(sensor, "model", channel.device)
    description = f"raw counts; counts * scale + offset is the {channel.quantity} in {channel.unit}"
    counts = hdf5.grow_numbers(
        sensor, "counts", channel.storage, unit="counts", description=description, chunk=chunk, compress=True
    )
    hdf5.describe(counts, long_name=f"{channel.name} [counts]", scale=channel.scale, offset=channel.offset)
    if channel.higher:
        counts.attrs["higher"] = np.array(channel.higher)
    if channel.faults:
        hdf5.describe(counts, faults=json.dumps({str(count): text for count, text in channel.faults.items()}))
    if channel.delay or channel.delay_uncertainty:
        hdf5.describe(counts, delay=channel.delay, delay_uncertainty=channel.delay_uncertainty)
    hdf5.describe(counts, value_units=channel.unit)
    counts.attrs["valid"] = np.array(channel.valid, dtype=np.int64)
    hdf5.describe(counts, quantity=channel.quantity, device=channel.device)
    return counts


def create_drive(instrument: hdf5.Group, chunk: int) -> hdf5.Dataset:
    """The empty dataset of the drive, with chunks of `chunk` rows."""
    # float32 preserves the output: its 24-bit mantissa resolves full scale 256 times more finely than a 16-bit
    # converter
    drive = hdf5.create_group(instrument, "drive", "NXcollection")
    voltage = hdf5.grow_numbers(
        drive, "voltage", np.float32, unit="V", description="drive as sent to the amplifier", chunk=chunk, compress=True
    )
    hdf5.describe(voltage, long_name="drive [V]")
    return voltage
