"""Recorded course of a run: journal with typed columns, requests to end the run, open safety inputs and alignments."""

from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.datafile.declared import ENTRY_TABLES
from bench.datafile.opening import INTERVALS, WORDING, columns_from
from bench.datafile.reader import DataFile
from bench.datafile.tables import as_rows
from bench.events import Event, SpecimenMounted, State, StateChanged, Warned
from bench.live_values import TwinEstimate
from drivers.rig import Alignment
from sim.errors import CauseCode

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
    """Request to end the run, with the numbers of blocks and of journal entries before it; it may have `halted` the
    bench.
    """

    blocks: int
    entries: int
    kind: str
    reason: str
    code: CauseCode
    halted: bool


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
        self._own: dict[str, list[Row]] = {}
        members = {row["members"] for row in self.rows_of(TwinEstimate.table) or () if "members" in row}
        self.twin_in_time = len(members) <= 1 and not any(each.columns.get("realtime") for each in entries)
        """Whether the live model kept up with the samples. If it did not, the estimates of the replay differ, because a
        replay waits for its live model.
        """
        self.in_place: tuple[str, ...] = ()
        self.journal = self._without_timing(entries)
        kinds = {each.kind for each in self.journal}
        self._unknown = () if SpecimenMounted.__name__ in kinds else (SpecimenMounted,)
        self._opened: dict[int, tuple[int, list[str]]] = {}
        armed_at = 0
        for entry in self.journal:
            if entry.columns.get("after") == State.ARMED:
                armed_at = entry.blocks
            opened = entry.columns.get("code") == CauseCode.SAFETY_INPUT and entry.columns["after"] == State.HALTED
            # an arming that was refused has no block: the last one belongs to the run before it
            if opened and entry.blocks > armed_at:
                run = int(np.searchsorted(self._numbers, int(blocks["run"][entry.blocks - 1])))
                self._opened[run] = int(ends[entry.blocks - 1]), entry.columns["subject"].split(", ")

    def rows_of(self, path: str) -> Sequence[Mapping[str, Any]] | None:
        """Rows of the table at `path`, whose event a replay reproduces; None if the file has no such table."""
        for kind, table in ENTRY_TABLES.items():
            if table.path == path:
                return self._rows.get(kind.__name__)
        if path not in self._own:
            columns = self._record.growing(path)
            if not columns:
                return None
            self._own[path] = as_rows({field.name: values for field, values in columns.items()})
        return self._own[path]

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
        """Names of the safety inputs that were open after `samples` samples of `run`."""
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
                halted = columns.get("after") == State.HALTED
                yield _Request(entry.blocks, index, columns["subject"], reason, CauseCode(columns["code"]), halted)

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
