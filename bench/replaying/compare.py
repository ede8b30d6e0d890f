"""Whether a replay came to what is recorded: every drive sample, journal entry and result, and where they part."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.events import Acquired, Event, PointFinished, SensorsAligned, TwinEstimate
from bench.record.declared import EVENT_TABLES
from bench.record.fields import TEXT_WIDTH
from bench.record.hdf5 import clip_text
from bench.record.reader import Record
from bench.replaying.course import RecordedCourse

ROUNDING = 1e-9
"""Relative difference of results that a processor's or a library's last bits can make."""

DRIVE_ROUNDING = 1e-6
"""Difference of a drive [V] that they can make: far below the step of a 16 bit converter."""

ROWS_AT_ONCE = 2**16

DRIVE, JOURNAL, POINTS, ENDING = "drive samples", "journal entries", "points", "ending"
"""What is compared, besides the other tables."""


@dataclass(frozen=True)
class Difference:
    """Something in `part` that did not come out as recorded; `rounding` when the last bits of a number explain it."""

    text: str
    part: str
    rounding: bool = False


@dataclass
class Found:
    """What was compared, by part and with how many values, and every difference."""

    compared: dict[str, int] = field(default_factory=dict[str, int])
    differences: list[Difference] = field(default_factory=list[Difference])


class Comparison:
    """A subscriber that keeps what a replay says; the drive is compared as it comes."""

    def __init__(self, record: Record, course: RecordedCourse) -> None:
        self._record, self._course = record, course
        self._drive = _DriveComparison(record)
        self._journal: list[tuple[str, str]] = []
        self._points: list[Mapping[str, Any]] = []
        self._own: dict[type[Event], list[Mapping[str, Any]]] = {kind: [] for kind in EVENT_TABLES}

    def __call__(self, event: Event) -> None:
        if isinstance(event, Acquired):
            self._drive.push(event)
            return
        if (table := EVENT_TABLES.get(type(event))) is not None:
            names = [each.name for each in table.fields]
            self._own[type(event)] += (dict(zip(names, row, strict=True)) for row in table.rows(event))
        if not self._course.journalled(event):
            return
        text = event.line
        if isinstance(event, PointFinished):
            text = f"row {len(self._points)} of points"
            self._points.append(event.point.model_dump(mode="json"))
        self._journal.append((type(event).__name__, _clipped(text)))

    @property
    def drive_played(self) -> int:
        """Samples of drive that were compared."""
        return self._drive.played

    def finish(self, broken_off: str | None) -> Found:
        """Compare what came with what is recorded. Where the recording is `broken_off`, the journals only as far as
        both go, up to the replay's entry that says so with these words.
        """
        found = Found()
        self._drive.report(found)
        self._compare_journal(found, broken_off)
        record = self._record
        _compare_rows(found, POINTS, record.points, self._points)
        for kind, rows in self._own.items():
            if kind is TwinEstimate and not self._course.twin_in_time:
                continue
            stored = record.rows_of(kind)
            if broken_off is not None and kind in (TwinEstimate, SensorsAligned):
                # a killed program's last samples may be lost, although what the twin published of them is not; and
                # the end of its run was not published at all
                common = min(len(stored), len(rows))
                stored, rows = stored[:common], rows[:common]
            _compare_rows(found, EVENT_TABLES[kind].name.replace("_", " "), stored, rows)
        return found

    def _compare_journal(self, found: Found, broken_off: str | None) -> None:
        begin = self._course.begin
        stored = [(entry.kind, entry.text) for entry in self._course.journal]
        came = self._journal
        if broken_off is not None:
            end = next((k for k, (_, text) in enumerate(came) if broken_off in text), len(came))
            came = came[: min(end, len(stored))]
        found.compared[JOURNAL] = len(came)
        for index, (kind, text) in enumerate(came):
            was = stored[index] if index < len(stored) else ("nothing", "")
            if index >= begin and was != (kind, text):
                found.differences.append(
                    Difference(f"journal entry {index + 1} was {was[0]} {was[1]!r} and is {kind} {text!r}", JOURNAL)
                )
                return
        if broken_off is None and len(stored) > len(came):
            kind, text = stored[len(came)]
            said = f"journal entry {len(came) + 1} does not come: {kind} {text!r}"
            found.differences.append(Difference(said, JOURNAL))


class _DriveComparison:
    """The drive of the replay beside the recorded one, as that is stored."""

    def __init__(self, record: Record) -> None:
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
        self._largest = max(self._largest, float(distance.max()))
        if self._first is None and (distance > DRIVE_ROUNDING).any():
            at = int(np.argmax(distance > DRIVE_ROUNDING))
            where = f"sample {event.block.first + at} of run {event.run}"
            self._first = f"the drive parts at {where}: {stored[at]:.7g} V was played, {came[at]:.7g} V comes now"

    def report(self, found: Found) -> None:
        found.compared[DRIVE] = self.played
        if self._first is not None:
            said = f"{self._first}; largest difference {self._largest:.3g} V"
            said = f"{said}; what was recorded after it does not answer the drive of now"
            found.differences.append(Difference(said, DRIVE))
        elif self._exact < self.played:
            said = f"{self.played - self._exact} samples of the drive differ by at most {self._largest:.2g} V"
            found.differences.append(Difference(said, DRIVE, rounding=True))


def _compare_rows(
    found: Found, what: str, stored: Sequence[Mapping[str, Any]], came: Sequence[Mapping[str, Any]]
) -> None:
    """Rows of a table, field by field; bench times say when, not what."""
    found.compared[what] = len(came)
    if len(stored) != len(came):
        found.differences.append(Difference(f"{len(stored)} rows of {what} are recorded, {len(came)} come", what))
    largest = 0.0
    for number, (was, now) in enumerate(zip(stored, came, strict=False), 1):
        for name in (now.keys() & was.keys()) - {"time"}:
            apart = _apart(was.get(name), now[name])
            if apart > ROUNDING:
                text = f"row {number} of {what}: {name} was {was.get(name)!r} and is {now[name]!r}"
                found.differences.append(Difference(text, what))
            else:
                largest = max(largest, apart)
    if largest > 0.0:
        said = f"{what} differ by at most {largest:.1e} of a value"
        found.differences.append(Difference(said, what, rounding=True))


def _apart(was: Any, now: Any) -> float:
    """Relative difference of two values; infinite where they are not numbers and not the same."""
    was, now = (None if each is None or each != each else each for each in (was, now))
    if isinstance(now, str):
        return 0.0 if was == _clipped(now) or (was is None and not now) else np.inf
    if was is None or now is None or isinstance(was, str):
        return 0.0 if was is now else np.inf
    return 0.0 if was == now else abs(was - now) / max(abs(was), abs(now))


def _clipped(text: str) -> str:
    return clip_text(text, TEXT_WIDTH).decode()
