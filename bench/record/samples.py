"""The samples of all channels and of the drive with their times, appended in whole chunks.

A compressed chunk that is written twice leaves its first copy behind as dead space, so rows wait until a chunk is
full unless they must reach the file now.
"""

import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bench.record import hdf5
from bench.record.errors import reading
from bench.record.growing import Growing
from bench.record.packing import Packer
from drivers.rig import Channel, Counts

CHUNK_TIME = 0.5
"""Seconds of samples in a chunk: what waits in memory in a run at real time."""


class Samples:
    """Counts per channel, the drive as float32 and the time as float64, always of one length.

    `time` is the dataset of the times, made with chunks of `chunk_of(sample_rate)` rows.
    """

    def __init__(
        self, instrument: hdf5.Group, channels: Sequence[Channel], sample_rate: float, time: hdf5.Dataset
    ) -> None:
        self.chunk = chunk_of(sample_rate)
        stored = [_create_channel(instrument, channel, self.chunk) for channel in channels]
        stored += [create_drive(instrument, self.chunk), time]
        self._packer = Packer()
        self.grown = [Growing(each, self._packer) for each in stored]
        self._pending: list[tuple[Counts, NDArray[np.float32], NDArray[np.float64]]] = []
        self._waiting = 0
        self._written = 0

    def __len__(self) -> int:
        return self._written + self._waiting

    @property
    def written(self) -> int:
        """Rows that have been given to the file."""
        return self._written

    @property
    def full_chunks(self) -> int:
        """How many chunks could be completed with the rows that wait."""
        return len(self) // self.chunk - self._written // self.chunk

    def add(self, counts: Counts, drive: NDArray[np.float32], seconds: NDArray[np.float64]) -> None:
        """Append rows: counts of shape (n_channels, n), drive [V] and bench time [s] of shape (n,)."""
        self._pending.append((counts, drive, seconds))
        self._waiting += len(drive)

    def write(self, *, partial: bool) -> None:
        """Put the waiting rows into the file: all of them, or as many as complete a chunk."""
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
        """Let go of the threads that compress."""
        self._packer.close()


def chunk_of(sample_rate: float) -> int:
    """Rows in a chunk of the samples."""
    return max(1, round(CHUNK_TIME * sample_rate))


def read_channels(instrument: hdf5.Group) -> tuple[Channel, ...]:
    """The inputs, in the order of the rig. Raises RecordError where one is damaged."""
    names = [name for name in hdf5.names(instrument) if hdf5.has(instrument, f"{name}/counts")]
    return tuple(read_channel(instrument, name) for name in names)


def read_channel(instrument: hdf5.Group, name: str) -> Channel:
    """The channel as it was when its counts were stored."""
    stored = hdf5.dataset(instrument, f"{name}/counts")
    with reading(f"the conversion of {stored.name}"):
        attrs = stored.attrs
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


def _create_channel(instrument: hdf5.Group, channel: Channel, chunk: int) -> hdf5.Dataset:
    sensor = hdf5.create_group(instrument, channel.name, "NXsensor")
    hdf5.write_text(sensor, "measurement", channel.quantity)
    hdf5.write_text(sensor, "model", channel.device)
    description = f"{channel.quantity} as converted: counts * scale + offset is in {channel.unit}"
    counts = hdf5.grow_numbers(
        sensor, "counts", channel.storage, unit="counts", description=description, chunk=chunk, compress=True
    )
    counts.attrs["long_name"] = f"{channel.name} [counts]"
    counts.attrs["scale"], counts.attrs["offset"] = channel.scale, channel.offset
    if channel.higher:
        counts.attrs["higher"] = np.array(channel.higher)
    if channel.faults:
        counts.attrs["faults"] = json.dumps({str(count): text for count, text in channel.faults.items()})
    counts.attrs["value_units"] = channel.unit
    counts.attrs["valid"] = np.array(channel.valid, dtype=np.int64)
    counts.attrs["quantity"], counts.attrs["device"] = channel.quantity, channel.device
    return counts


def create_drive(instrument: hdf5.Group, chunk: int) -> hdf5.Dataset:
    """The empty dataset of the drive, with chunks of so many rows."""
    # a 24 bit mantissa resolves full scale 256 times finer than a 16 bit converter: nothing that was played is lost
    drive = hdf5.create_group(instrument, "drive", "NXcollection")
    voltage = hdf5.grow_numbers(
        drive, "voltage", np.float32, unit="V", description="drive as sent to the amplifier", chunk=chunk, compress=True
    )
    voltage.attrs["long_name"] = "drive [V]"
    return voltage
