"""Data file as the recording for a replay: samples, times of blocks, safety inputs, requests and answers."""

import json
from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from bench.config.model import BenchConfiguration
from bench.config.sections import Twin
from bench.config.validation import dotted, former_names, with_present_names
from bench.datafile.declared import ENTRY_TABLES
from bench.datafile.opening import INTERVALS, WORDING, columns_from
from bench.datafile.reader import DataFile
from bench.datafile.tables import as_rows
from bench.events import Event, SpecimenMounted, State, StateChanged, Warned
from bench.live_values import TwinEstimate
from drivers.rig import Alignment, Channel, Counts
from sim.errors import CauseCode, InvalidInput

_AHEAD = 10.0
"""Duration read in one access [s]: reading thousands of samples takes no longer than reading one."""


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
        """First sample and length of each gap-free section."""
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

    Raises InvalidInput for a file without the configuration of its bench, or one that this software cannot read.
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
        """Number of drive samples queued ahead, from the configuration of the bench."""
        return self._configuration.lead_samples

    @property
    def description(self) -> dict[str, str]:
        """Metadata of the recording."""
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
        raise InvalidInput("record", record.title, "it has no bench configuration and cannot be replayed")
    try:
        content = with_present_names(BenchConfiguration, json.loads(stored))
        configuration = BenchConfiguration.model_validate_json(json.dumps(content))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        if first["loc"] == ("backend",):
            allowed = f"{first['msg']}; {record.title} was recorded with this backend"
            raise InvalidInput("backend", first["input"], allowed) from error
        allowed = "its configuration was written by another version of this software: replay it with that version"
        raise InvalidInput("record", record.title, allowed) from error
    # files of versions without a twin have no table of its estimates
    if record.columns_of(TwinEstimate):
        return configuration
    return configuration.model_copy(update={"twin": Twin(enabled=False)})


_REQUESTS = (CauseCode.REQUEST, CauseCode.CLIENT_LOST)
"""Causes of requests, which a replay cannot reproduce from recorded samples."""

Row = dict[str, Any]


@dataclass(frozen=True)
class Entry:
    """Journal entry: `columns` is the table row of its event, `blocks` the number of blocks before it."""

    kind: str
    text: str
    columns: Row
    blocks: int


@dataclass(frozen=True)
class _Request:
    """Request to end the run, with the number of blocks and journal entries before it."""

    blocks: int
    entries: int
    kind: str
    reason: str
    code: CauseCode


class RecordedCourse:
    """`drivers.replay.Course` of an open file, with the entries of its journal in `journal`.

    In a replay, no block is late. If the guard ended the recorded run because of late blocks, an abort request with the
    same reason ends the replay; `in_place` lists the reasons of such requests.
    """

    def __init__(self, record: DataFile) -> None:
        self._record = record
        blocks = record.blocks
        self._numbers: NDArray[np.int64] = np.unique(blocks["run"])
        rows: NDArray[np.int64] = np.concatenate((blocks["row"], [record.rows]))
        ends: NDArray[np.int64] = blocks["first"] + (rows[1:] - rows[:-1])
        firsts = np.searchsorted(blocks["run"], self._numbers).tolist()
        self._begun = [(int(ends[first]), float(blocks["time"][first])) for first in firsts]
        self._rate = record.sample_rate
        self._alignments = record.alignments
        self._block_times = blocks["time"]
        self.same_wording = record.wording == WORDING
        """Whether the sentences in the file can be compared with those of this version."""
        self.same_intervals = record.intervals == INTERVALS
        """Whether the uncertainties in the file can be compared with those of this version."""
        self._rows = {kind.__name__: as_rows(columns) for kind in ENTRY_TABLES if (columns := record.columns_of(kind))}
        entries = self._entries()
        members = record.columns_of(TwinEstimate).get("members", ())
        self.twin_in_time = len({*members}) <= 1 and not any(each.columns.get("realtime") for each in entries)
        """Whether the live twin kept up with the samples. If it did not, the estimates of the replay differ, because a
        replay waits for its twin.
        """
        self.in_place: tuple[str, ...] = ()
        self.journal = self._without_timing(entries)
        kinds = {each.kind for each in self.journal}
        self._unknown = () if SpecimenMounted.__name__ in kinds else (SpecimenMounted,)
        self._opened: dict[int, tuple[int, list[str]]] = {}
        for entry in self.journal:
            opened = entry.columns.get("code") == CauseCode.SAFETY_INPUT and entry.columns["after"] == State.HALTED
            if opened and entry.blocks > 0:
                run = int(np.searchsorted(self._numbers, int(blocks["run"][entry.blocks - 1])))
                self._opened[run] = int(ends[entry.blocks - 1]), entry.columns["subject"].split(", ")

    def rows_of(self, path: str) -> Sequence[Mapping[str, Any]] | None:
        """Rows of the table at `path`, which is that of a reproducible event; None if the file has no such table."""
        for kind, table in ENTRY_TABLES.items():
            if table.path == path:
                return self._rows.get(kind.__name__)
        columns = self._record.growing(path)
        return as_rows({field.name: values for field, values in columns.items()}) if columns else None

    @property
    def first_warnings(self) -> list[str]:
        """Warnings of the session before the start of the engine."""
        return [entry.text for entry in self.journal[: self.begin]]

    @property
    def begin(self) -> int:
        """Number of journal entries before the first one by the engine."""
        kinds = (entry.kind != Warned.__name__ for entry in self.journal)
        return next((index for index, other in enumerate(kinds) if other), len(self.journal))

    def in_hand(self, run: int, samples: int) -> float:
        """Bench time [s] at which `samples` samples of `run` were available, extrapolated from its first block."""
        end, time = self._begun[run]
        return time + (samples - end) / self._rate

    def opened(self, run: int, samples: int) -> Collection[str]:
        """Safety inputs open after `samples` samples of `run`."""
        since, names = self._opened.get(run, (0, []))
        return names if samples >= since else ()

    def journalled(self, event: Event) -> bool:
        """Whether the file's journal includes events of this kind; journals of older files have fewer kinds."""
        return event.journalled and not isinstance(event, self._unknown)

    def alignments(self, run: int) -> tuple[Alignment, ...]:
        """Alignments of the free-running sensors in `run`."""
        return self._alignments.get(int(self._numbers[run]), ())

    @property
    def requests(self) -> Iterator[_Request]:
        """Requests to end the run, in order."""
        for index, entry in enumerate(self.journal):
            columns = entry.columns
            if columns.get("code") in _REQUESTS:
                # errors during the ramp-down are appended to the reason of the request
                reason = columns["reason"].partition("; then ")[0]
                yield _Request(entry.blocks, index, columns["subject"], reason, CauseCode(columns["code"]))

    def _entries(self) -> list[Entry]:
        waiting = {kind: deque(rows) for kind, rows in self._rows.items()}
        entries: list[Entry] = []
        for each in self._record.events:
            # on a virtual clock, a block and the entries that it causes have equal times; preceding entries are earlier
            blocks = int(np.searchsorted(self._block_times, each.time, side="right"))
            rows = waiting.get(each.kind)
            columns = columns_from(each.kind, each.text) if rows is None else rows.popleft() if rows else {}
            entries.append(Entry(each.kind, each.text, columns, blocks))
        return entries

    def _without_timing(self, entries: list[Entry]) -> list[Entry]:
        """Remove entries that depend on the computer's speed, and turn endings that follow from them into requests."""
        kept: list[Entry] = []
        replaced: str | None = None
        for before, entry in zip([None, *entries], entries, strict=False):
            columns = entry.columns
            if columns.get("realtime") or columns.get("timing"):
                if (rows := self._rows.get(entry.kind)) is not None:
                    self._rows[entry.kind] = [row for row in rows if row is not columns]
                continue
            follows = entry.kind == StateChanged.__name__ and before is not None and before.columns.get("timing")
            if follows and columns.get("after") == State.ABORTING:
                replaced = str(columns["reason"])
                self.in_place = (*self.in_place, replaced)
            if replaced is not None and str(columns.get("reason", "")).startswith(replaced):
                columns.update(code=CauseCode.REQUEST, subject="abort")
            kept.append(entry)
        return kept
