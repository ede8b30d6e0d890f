"""Data file as the recording for a replay: configuration of the bench, channels, and samples of every run."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from bench.config.model import BenchConfiguration
from bench.config.sections import Twin
from bench.config.validation import dotted, former_names, with_present_names
from bench.datafile.reader import DataFile
from bench.live_values import TwinEstimate
from drivers.border import LONGEST_LEAD
from drivers.rig import Channel, Counts
from sim.errors import InvalidInput

_AHEAD = 10.0
"""Duration of the samples read in one access [s]: reading thousands of samples takes hardly longer than reading one."""


@dataclass(frozen=True)
class _Stretch:
    """Consecutive samples: index of the first sample, number of samples, and row of the first sample in the file."""

    first: int
    length: int
    row: int


class RunRecording:
    """Run in a data file; its samples are read on access."""

    def __init__(self, record: DataFile, stretches: Sequence[_Stretch]) -> None:
        self._record, self._stretches = record, stretches
        self._firsts = np.array([stretch.first for stretch in stretches])
        self._held_first = 0
        self._held: Counts = np.zeros((0, len(record.channels)), dtype=np.int16)

    @property
    def stretches(self) -> Sequence[tuple[int, int]]:
        """Index of the first sample and number of samples of each section without gaps."""
        return [(stretch.first, stretch.length) for stretch in self._stretches]

    def counts(self, first: int, n: int) -> Counts:
        """Counts of `n` samples from `first` on, shape (n, n_channels). Raises InvalidInput if a sample is missing."""
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
            raise InvalidInput("sample", first, f"the file does not have {n} consecutive samples from this one on")
        row = stretch.row + first - stretch.first
        rows = slice(row, row + min(left, max(n, round(_AHEAD * self._record.sample_rate))))
        self._held = np.column_stack([self._record.counts(c.name, rows) for c in self._record.channels])
        self._held_first = first


class DataFileRecording:
    """Open file as a `drivers.replay.Recording`; the caller closes the file.

    Raises InvalidInput if the file has no configuration of its bench, or one that this software cannot read.
    """

    def __init__(self, record: DataFile) -> None:
        self._record = record
        self._configuration = _configuration(record)

    @property
    def configuration(self) -> BenchConfiguration:
        """Configuration of the bench."""
        return self._configuration

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Input channels."""
        return self._record.channels

    @property
    def sample_rate(self) -> float:
        """Samples per second per channel [1/s]."""
        return self._record.sample_rate

    @property
    def drive_range(self) -> float:
        """Largest magnitude of the drive [V], from the configuration of the bench."""
        return self._configuration.settings.drive_range

    @property
    def lead(self) -> int:
        """Number of drive samples queued ahead: that of the open rig, which may have added delays of its inputs to the
        configured one. Files of earlier versions contain only the latter.
        """
        stored = self._record.metadata.get("lead")
        if stored is None:
            return self._configuration.lead_samples
        longest = round(LONGEST_LEAD * self.sample_rate)
        if not (stored.isascii() and stored.isdigit() and len(stored) < 10 and int(stored) <= longest):
            allowed = f"it must be a number of samples from 0 to {longest}; {self._record.title} cannot be replayed"
            raise InvalidInput("lead", stored, allowed)
        return int(stored)

    @property
    def description(self) -> dict[str, str]:
        """Title and start time, software, and device of each channel, by name."""
        record = self._record
        devices = {channel.name: channel.device for channel in record.channels}
        return {"recorded": f"{record.title}, {record.start_time}", "software": record.software, **devices}

    @property
    def runs(self) -> tuple[RunRecording, ...]:
        """Runs in order, as the file contained them at the first access."""
        return self._runs

    @cached_property
    def _runs(self) -> tuple[RunRecording, ...]:
        blocks = self._record.blocks
        ends = np.append(blocks["row"][1:], self._record.rows)
        return tuple(
            RunRecording(self._record, _stretches(blocks, ends, np.flatnonzero(blocks["run"] == run)))
            for run in np.unique(blocks["run"])
        )


def _stretches(blocks: dict[str, NDArray[Any]], ends: NDArray[np.int64], chosen: NDArray[np.intp]) -> list[_Stretch]:
    """Gap-free sections of one run, in which consecutive blocks are joined."""
    row, first, end = blocks["row"][chosen], blocks["first"][chosen], ends[chosen]
    length = end - row
    follows = first[1:] == first[:-1] + length[:-1]
    begins = np.concatenate(([0], np.flatnonzero(~follows) + 1))
    finishes = np.concatenate((begins[1:], [row.size])) - 1
    return [_Stretch(int(first[a]), int(end[b] - row[a]), int(row[a])) for a, b in zip(begins, finishes, strict=True)]


def former_keys(record: DataFile) -> str:
    """Notice of keys that have names of an earlier version in the recorded configuration; empty if there are none."""
    stored = json.loads(record.metadata.get("configuration", "{}"))
    found = [f"{dotted(old)} (now {new})" for old, new in former_names(BenchConfiguration, stored)]
    return f"the file uses former names of keys: {', '.join(found)}" if found else ""


def _configuration(record: DataFile) -> BenchConfiguration:
    stored = record.metadata.get("configuration")
    if stored is None:
        raise InvalidInput("record", record.title, "the file has no bench configuration and cannot be replayed")
    try:
        content = with_present_names(BenchConfiguration, json.loads(stored))
        configuration = BenchConfiguration.model_validate_json(json.dumps(content))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        if first["loc"] == ("backend",):
            allowed = f"{first['msg']}; {record.title} was recorded with this backend"
            raise InvalidInput("backend", first["input"], allowed) from error
        allowed = "this version cannot read the recorded configuration: replay the file with the version that wrote it"
        raise InvalidInput("record", record.title, allowed) from error
    # files of versions without a live model have no table of its estimates
    if record.has_table_of(TwinEstimate):
        return configuration
    return configuration.model_copy(update={"twin": Twin(enabled=False)})
