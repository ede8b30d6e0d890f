"""Comparison of a replay with its recording: every drive sample, journal entry and result."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.datafile.declared import ENTRY_PATHS, EVENT_TABLES, event_table
from bench.datafile.fields import TEXT_WIDTH
from bench.datafile.hdf5 import clip_text
from bench.datafile.reader import DataFile
from bench.document.typography import counted
from bench.events import Acquired, Event, PointFinished, SensorsAligned
from bench.findings import FitFinished, SpecimenIdentified
from bench.live_values import TwinEstimate
from bench.replay.course import RecordedCourse
from bench.replay.fits import differences_of_columns, parameter_rows, property_rows
from sim.identified import Identified

ROUNDING = 1e-9
"""Largest difference of results that is attributed to rounding on another processor or by another library, relative to
the largest magnitude in the recorded column: a signal that crosses zero has no meaningful relative difference there.
"""

TWIN_ROUNDING = 1e-6
"""Like `ROUNDING`, but for the results of the live model, whose impacts amplify differences."""

DRIVE_ROUNDING = 1e-6
"""Largest difference of the drive [V] that is attributed to rounding: far below the step of a 16-bit converter."""

ROWS_AT_ONCE = 2**16

OF_INTERVALS = (
    *("uncertainty", "dominating", "degrees_of_freedom", "agrees"),
    *("alpha_1_low", "alpha_1_high", "alpha_2_low", "alpha_2_high", "alpha_2_least", "alpha_2_mean"),
    *("alpha_2_greatest_low", "alpha_2_greatest_high", "falls_predicted", "repeats_cycles"),
)
"""Parts of the names of columns that depend on `bench.datafile.opening.INTERVALS`."""

DRIVE, JOURNAL, POINTS, ENDING, FITS = "drive samples", "journal entries", "points", "ending", "fits"
"""Parts of a recording that are compared in addition to its other tables."""


@dataclass(frozen=True)
class Difference:
    """Difference from the recording in `part`; `rounding` is True if numbers differ only to within rounding."""

    text: str
    part: str
    rounding: bool = False


@dataclass
class Found:
    """Number of compared values per part, and all differences."""

    compared: dict[str, int] = field(default_factory=dict[str, int])
    differences: list[Difference] = field(default_factory=list[Difference])


class Comparison:
    """Subscriber that collects the events of a replay and compares the drive block by block."""

    def __init__(self, record: DataFile, course: RecordedCourse) -> None:
        self._record, self._course = record, course
        self._drive = _DriveComparison(record)
        self._journal: list[tuple[str, str, int]] = []
        self._blocks = 0
        self._points: list[Mapping[str, Any]] = []
        paths = (*(table.path for table in EVENT_TABLES.values()), *record.own_tables)
        self._own: dict[str, list[Mapping[str, Any]]] = {path: [] for path in paths}
        self._fits: list[FitFinished] = []
        self._identified: Identified | None = None
        self._entries = {path: kind for kind, path in ENTRY_PATHS.items()}
        """Kind of the journal entries of each table that has one row per entry, by the table's path."""

    def __call__(self, event: Event) -> None:
        if isinstance(event, Acquired):
            self._drive.push(event)
            self._blocks += 1
            return
        if isinstance(event, FitFinished):
            self._fits.append(event)
        elif isinstance(event, SpecimenIdentified):
            self._identified = event.identified
        if (table := event_table(type(event))) is not None:
            if event.journalled and table.single:
                self._entries[table.path] = type(event).__name__
            names = [each.name for each in table.fields]
            self._own.setdefault(table.path, []).extend(dict(zip(names, row, strict=True)) for row in table.rows(event))
        if not self._course.journalled(event):
            return
        text = event.line
        if isinstance(event, PointFinished):
            text = f"row {len(self._points)} of points"
            self._points.append({name: getattr(event.point, name) for name in type(event.point).model_fields})
        self._journal.append((type(event).__name__, _clipped(text), self._blocks))

    @property
    def drive_played(self) -> int:
        """Number of compared drive samples."""
        return self._drive.played

    def finish(self, broken_off: str | None) -> Found:
        """Compare the replay with the recording and return the findings.

        For an incomplete recording, `broken_off` is a part of the text of the replay's journal entry before which the
        comparison of the journals ends.
        """
        found = Found()
        self._drive.report(found)
        entries = Counter(kind for kind, *_ in self._compare_journal(found, broken_off))
        same = self._course.same_wording, self._course.same_intervals
        _compare_rows(found, POINTS, self._record.points, self._points, *same)
        for path, rows in self._own.items():
            if path == TwinEstimate.table and not (self._course.twin_in_time and self._course.same_intervals):
                continue
            stored = self._course.rows_of(path)
            if stored is None:
                continue
            common = max(len(stored), len(rows))
            if broken_off is not None and path in (TwinEstimate.table, SensorsAligned.table):
                # a killed program may lose its last samples but not the live model's estimates from them, and it has
                # not published the end of its run
                common = min(len(stored), len(rows))
            elif broken_off is not None and path in self._entries:
                common = entries[self._entries[path]]
            name = path.rpartition("/")[2].replace("_", " ")
            rounding = TWIN_ROUNDING if path == TwinEstimate.table else ROUNDING
            _compare_rows(found, name, stored[:common], rows[:common], *same, rounding)
        if broken_off is None and self._course.same_intervals:
            self._compare_fits(found)
        return found

    def _compare_fits(self, found: Found) -> None:
        """Compare fitted models and identified properties; those of another evaluation differ."""
        stored, identified = self._record.fits, self._record.identified
        if stored or self._fits:
            _compare_rows(found, "fit parameters", parameter_rows(stored), parameter_rows(self._fits), True, True)
        if identified or self._identified:
            rows = property_rows(identified), property_rows(self._identified)
            _compare_rows(found, "identified properties", *rows, True, True)
        largest = 0.0
        for name, apart in differences_of_columns(stored, self._fits):
            if apart > ROUNDING:
                found.differences.append(Difference(f"{name} differs by {apart:.1e} of the largest value", FITS))
            else:
                largest = max(largest, apart)
        if largest > 0.0:
            said = f"{FITS} differ by at most {largest:.1e} of the largest value"
            found.differences.append(Difference(said, FITS, rounding=True))

    def _compare_journal(self, found: Found, broken_off: str | None) -> list[tuple[str, str, int]]:
        """Compare the entries in order: kind and text, or kind and number of preceding blocks if the wording differs.

        Returns the entries of the replay that were compared.
        """
        begin, same_wording = self._course.begin, self._course.same_wording
        stored = [(entry.kind, entry.text, entry.blocks) for entry in self._course.journal]
        came = self._journal
        if broken_off is not None:
            end = next((k for k, (_, text, _) in enumerate(came) if broken_off in text), len(came))
            came = came[: min(end, len(stored))]
        found.compared[JOURNAL] = len(came)
        for index, (kind, text, blocks) in enumerate(came):
            was_kind, was_text, was_blocks = stored[index] if index < len(stored) else ("nothing", "", 0)
            same = was_text == text if same_wording else was_blocks == blocks
            if index >= begin and not (was_kind == kind and same):
                was, now = f"{was_kind} {was_text!r}", f"{kind} {text!r}"
                if not same_wording:
                    was, now = f"{was} after {counted(was_blocks, 'block')}", f"{now} after {blocks}"
                found.differences.append(Difference(f"journal entry {index + 1} was {was} and is {now}", JOURNAL))
                return came
        if broken_off is None and len(stored) > len(came):
            kind, text, _ = stored[len(came)]
            said = f"journal entry {len(came) + 1} is missing in the replay: {kind} {text!r}"
            found.differences.append(Difference(said, JOURNAL))
        return came


class _DriveComparison:
    """Compares the drive of the replay with the recorded drive at the stored precision."""

    def __init__(self, record: DataFile) -> None:
        self._record = record
        self._held: NDArray[np.float32] = np.zeros(0, dtype=np.float32)
        self._held_row = 0
        self.played = 0
        self._exact = 0
        self._largest = 0.0
        self._first: str | None = None

    def push(self, event: Acquired) -> None:
        n = event.drive.size
        begin = self.played - self._held_row
        if begin + n > self._held.size:
            rows = slice(self.played, self.played + max(n, ROWS_AT_ONCE))
            self._held, self._held_row, begin = self._record.drive(rows), self.played, 0
        stored, came = self._held[begin : begin + n], event.drive.astype(np.float32)
        self.played += n
        same = stored == came[: stored.size]
        self._exact += int(np.count_nonzero(same))
        if same.all():
            return
        distance = np.abs(stored.astype(np.float64) - came[: stored.size])
        # samples of a drive that was lost and could not be recovered
        distance[np.isnan(distance)] = np.inf
        self._largest = max(self._largest, float(distance.max()))
        if self._first is None and (distance > DRIVE_ROUNDING).any():
            at = int(np.argmax(distance > DRIVE_ROUNDING))
            where = f"sample {event.block.first + at} of run {event.run}"
            self._first = f"the drive first differs at {where}: recorded {stored[at]:.7g} V, replayed {came[at]:.7g} V"

    def report(self, found: Found) -> None:
        found.compared[DRIVE] = self.played
        if self._first is not None:
            said = f"{self._first}; largest difference {self._largest:.3g} V"
            said = f"{said}; later recorded samples are not the response to the replayed drive"
            found.differences.append(Difference(said, DRIVE))
        elif self._exact < self.played:
            said = f"drive samples that differ: {self.played - self._exact}, by at most {self._largest:.2g} V"
            found.differences.append(Difference(said, DRIVE, rounding=True))


def _compare_rows(
    found: Found,
    what: str,
    stored: Sequence[Mapping[str, Any]],
    came: Sequence[Mapping[str, Any]],
    same_wording: bool,
    same_intervals: bool,
    rounding: float = ROUNDING,
) -> None:
    """Compare the rows of a table field by field, except bench times and, for an older file, fields that depend on the
    wording or on the evaluation of uncertainties.
    """
    found.compared[what] = len(came)
    if len(stored) != len(came):
        found.differences.append(
            Difference(f"{counted(len(stored), 'row')} of {what} recorded, {len(came)} replayed", what)
        )
    largest, scales = 0.0, _scales(stored)
    for number, (was, now) in enumerate(zip(stored, came, strict=False), 1):
        for name in (now.keys() & was.keys()) - {"time"}:
            if not (same_wording and same_intervals) and _is_wording(was[name], now[name]):
                continue
            if not same_intervals and any(part in name for part in OF_INTERVALS):
                continue
            apart = _relative_difference(was[name], now[name], scales.get((name, was.get("unit")), 0.0))
            if apart > rounding:
                text = f"row {number} of {what}: {name} was {was[name]!r} and is {_plain(now[name])!r}"
                found.differences.append(Difference(text, what))
            else:
                largest = max(largest, apart)
    if largest > 0.0:
        said = f"{what} differ by at most {largest:.1e} of the largest value"
        found.differences.append(Difference(said, what, rounding=True))


def _plain(value: Any) -> Any:
    return value.value if isinstance(value, Enum) else value


def _is_wording(was: Any, now: Any) -> bool:
    """Whether both values are sentences, which depend on the wording version, and not names, codes or JSON."""
    if isinstance(now, Enum) or not (isinstance(was, str) and isinstance(now, str) and was and now):
        return False
    return any(" " in text and text[0] not in "{[" for text in (was, now))


def _scales(rows: Sequence[Mapping[str, Any]]) -> dict[tuple[str, Any], float]:
    """Largest finite magnitude of each field with numbers, separately for each unit where rows state one."""
    scales: dict[tuple[str, Any], float] = {}
    for row in rows:
        for name, value in row.items():
            if isinstance(value, int | float) and isfinite(value):
                key = name, row.get("unit")
                scales[key] = max(scales.get(key, 0.0), abs(value))
    return scales


def _relative_difference(was: Any, now: Any, scale: float) -> float:
    """Difference of two values relative to the largest of `scale` and their magnitudes; infinite for unequal values
    that are not numbers.
    """
    was, now = (None if each is None or each != each else each for each in (was, now))
    if isinstance(now, str):
        return 0.0 if was == _clipped(now) or (was is None and not now) else np.inf
    if was is None or now is None or isinstance(was, str):
        return 0.0 if was is now else np.inf
    if was == now:
        return 0.0
    apart = abs(was - now) / max(abs(was), abs(now), scale)
    # infinite and finite values differ
    return apart if apart == apart else np.inf


def _clipped(text: str) -> str:
    return clip_text(text, TEXT_WIDTH).decode()
