"""A file as a recording that a rig can play again."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from bench.config.model import BenchConfiguration
from bench.config.twin import Twin
from bench.events import TwinEstimate
from bench.record.reader import Record
from drivers.rig import Channel, Counts
from sim.errors import InvalidInput

_AHEAD = 10.0
"""How much is read from the file at once [s]: a look at it costs the same for one sample as for thousands."""


@dataclass(frozen=True)
class _Stretch:
    """Consecutive samples: index of the first, how many, and the row of the first in the file."""

    first: int
    length: int
    row: int


class ReplayedRun:
    """A run of a file; its samples are read when they are asked for."""

    def __init__(self, record: Record, stretches: Sequence[_Stretch]) -> None:
        self._record, self._stretches = record, stretches
        self._firsts = np.array([stretch.first for stretch in stretches])
        self._held_first = 0
        self._held: Counts = np.zeros((0, len(record.channels)), dtype=np.int16)

    @property
    def stretches(self) -> Sequence[tuple[int, int]]:
        """First sample and length of each stretch without a gap."""
        return [(stretch.first, stretch.length) for stretch in self._stretches]

    def counts(self, first: int, n: int) -> Counts:
        """Counts at `n` samples from `first` on, shape (n, n_channels). Raises InvalidInput where none are."""
        begin = first - self._held_first
        if not 0 <= begin <= begin + n <= len(self._held):
            self._fetch(first, n)
            begin = 0
        return self._held[begin : begin + n]

    def _fetch(self, first: int, n: int) -> None:
        place = int(np.searchsorted(self._firsts, first, side="right")) - 1
        stretch = self._stretches[max(place, 0)]
        left = stretch.first + stretch.length - first
        if place < 0 or n > left:
            raise InvalidInput("sample", first, f"the file does not hold {n} samples without a gap from there")
        row = stretch.row + first - stretch.first
        rows = slice(row, row + min(left, max(n, round(_AHEAD * self._record.sample_rate))))
        self._held = np.column_stack([self._record.counts(c.name, rows) for c in self._record.channels])
        self._held_first = first


class ReplayedRecord:
    """An open file as a `drivers.replay.Recording`; it stays the caller's to close.

    Raises InvalidInput for a file without the configuration of its bench, or one that this software cannot read.
    """

    def __init__(self, record: Record) -> None:
        self._record = record
        self._configuration = _configuration(record)

    @property
    def configuration(self) -> BenchConfiguration:
        """How the bench was configured."""
        return self._configuration

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The inputs."""
        return self._record.channels

    @property
    def sample_rate(self) -> float:
        """Samples per second and channel [1/s]."""
        return self._record.sample_rate

    @property
    def drive_range(self) -> float:
        """Largest magnitude of the drive [V] by the configuration of the bench."""
        given = self._configuration
        if given.backend == "simulated":
            return given.simulation.bench.shaker.drive_range
        return given.hardware.daq.output_range

    @property
    def lead(self) -> int:
        """Drive samples that had to wait, by the configuration of the bench."""
        return self._configuration.lead_samples

    @property
    def description(self) -> dict[str, str]:
        """What was recorded, when and with what."""
        record = self._record
        devices = {channel.name: channel.device for channel in record.channels}
        return {"recorded": f"{record.title}, {record.start_time}", "software": record.software, **devices}

    @property
    def runs(self) -> tuple[ReplayedRun, ...]:
        """The runs in their order, as far as they were in the file when they were first asked for."""
        return self._runs

    @cached_property
    def _runs(self) -> tuple[ReplayedRun, ...]:
        blocks = self._record.blocks
        ends = np.append(blocks["row"][1:], self._record.rows)
        return tuple(
            ReplayedRun(self._record, _stretches(blocks, ends, np.flatnonzero(blocks["run"] == run)))
            for run in np.unique(blocks["run"])
        )


def _stretches(blocks: dict[str, NDArray[Any]], ends: NDArray[np.int64], chosen: NDArray[np.intp]) -> list[_Stretch]:
    """The blocks of one run, joined where one begins where the other ends."""
    row, first, end = blocks["row"][chosen], blocks["first"][chosen], ends[chosen]
    length = end - row
    follows = first[1:] == first[:-1] + length[:-1]
    begins = np.concatenate(([0], np.flatnonzero(~follows) + 1))
    finishes = np.concatenate((begins[1:], [row.size])) - 1
    return [_Stretch(int(first[a]), int(end[b] - row[a]), int(row[a])) for a, b in zip(begins, finishes, strict=True)]


def _configuration(record: Record) -> BenchConfiguration:
    stored = record.metadata.get("configuration")
    if stored is None:
        raise InvalidInput("record", record.title, "it does not say how its bench was configured: not replayable")
    try:
        configuration = BenchConfiguration.model_validate_json(stored)
    except ValidationError as error:
        allowed = "its configuration is of another version of this software; replay it with that one"
        raise InvalidInput("record", record.title, allowed) from error
    # a file from before there was a twin has no place for what it says
    if record.columns_of(TwinEstimate):
        return configuration
    return configuration.model_copy(update={"twin": Twin(enabled=False)})
