"""How a recorded campaign went besides its samples: when blocks came, what opened, what was asked and answered."""

import re
from collections import deque
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.engine.requests import Requests
from bench.events import (
    Acquired,
    Event,
    LimitExceeded,
    OperatorAnswered,
    OperatorAsked,
    SpecimenMounted,
    StateChanged,
    TwinEstimate,
    Warned,
)
from bench.record.reader import Record, RecordedEvent
from bench.twin.beside import BEHIND
from drivers.rig import Alignment

_ASKED = re.compile(r"-> [^:]+: (stop|abort|halt) was asked for")
_OPENED = re.compile(r"-> halted: (.+?) opened(?:;|$)")
_TIMING = ("delay of a block of samples", "difference of the clocks")
"""What `bench.guard.timing` finds: it is in no sample, and the file says when a block was published, not taken."""
_ANSWER = re.compile(r"\(answered by (.+)\)$")


@dataclass(frozen=True)
class _Place:
    """A moment: after so many blocks and so many entries of the journal."""

    blocks: int
    entries: int


class RecordedCourse:
    """A `drivers.replay.Course` of an open file. `journal` is what was recorded of it.

    Blocks come in time. A run that the guard ended because they did not is ended by an abort that is asked for in its
    place, and so the journal has it; `in_place` says what was replaced.
    """

    def __init__(self, record: Record) -> None:
        blocks = record.blocks
        self._numbers: NDArray[np.int64] = np.unique(blocks["run"])
        rows: NDArray[np.int64] = np.concatenate((blocks["row"], [record.rows]))
        ends: NDArray[np.int64] = blocks["first"] + (rows[1:] - rows[:-1])
        firsts = np.searchsorted(blocks["run"], self._numbers).tolist()
        self._begun = [(int(ends[first]), float(blocks["time"][first])) for first in firsts]
        self._rate = record.sample_rate
        self._alignments = record.alignments
        self.in_place: tuple[str, ...] = ()
        events = [each for each in record.events if not _twin_behind(each)]
        members = record.columns_of(TwinEstimate).get("members", ())
        self.twin_in_time = len(events) == len(record.events) and len({*members}) <= 1
        """Whether the model beside the test kept up; else it said what a replay, which waits for it, does not say."""
        self.journal = self._without_timing(events)
        kinds = {each.kind for each in self.journal}
        self._unknown = () if SpecimenMounted.__name__ in kinds else (SpecimenMounted,)
        self._block_times = blocks["time"]
        self._opened: dict[int, tuple[int, list[str]]] = {}
        for entry in self.journal:
            found = _OPENED.search(entry.text) if entry.kind == StateChanged.__name__ else None
            last = self._blocks_before(entry) - 1
            if found and last >= 0:
                run = int(np.searchsorted(self._numbers, int(blocks["run"][last])))
                self._opened[run] = int(ends[last]), found.group(1).split(", ")

    @property
    def first_warnings(self) -> list[str]:
        """What the session warned of before the engine began."""
        return [entry.text for entry in self.journal[: self.begin]]

    @property
    def begin(self) -> int:
        """Entries of the journal that are not the engine's: the warnings before it began."""
        kinds = (entry.kind != Warned.__name__ for entry in self.journal)
        return next((index for index, other in enumerate(kinds) if other), len(self.journal))

    def in_hand(self, run: int, samples: int) -> float:
        """Bench time [s] at which the samples of `run` before number `samples` had been read: as its first block."""
        end, time = self._begun[run]
        return time + (samples - end) / self._rate

    def opened(self, run: int, samples: int) -> Collection[str]:
        """The safety inputs that were not good then."""
        since, names = self._opened.get(run, (0, []))
        return names if samples >= since else ()

    def journalled(self, event: Event) -> bool:
        """Whether what was recorded has an entry for such an event: older files know of fewer kinds."""
        return event.journalled and not isinstance(event, self._unknown)

    def alignments(self, run: int) -> tuple[Alignment, ...]:
        """How sensors with clocks of their own were placed in `run`."""
        return self._alignments.get(int(self._numbers[run]), ())

    @property
    def requests(self) -> list[tuple[_Place, str]]:
        """When "stop", "abort" or "halt" was asked for."""
        asked: list[tuple[_Place, str]] = []
        for index, entry in enumerate(self.journal):
            if entry.kind == StateChanged.__name__ and (found := _ASKED.search(entry.text)):
                asked.append((_Place(self._blocks_before(entry), index), found.group(1)))
        return asked

    def as_replayed(self, text: str) -> str:
        """A recorded text with the abort in place of what the guard found of the blocks' time."""
        for reason in self.in_place:
            text = text.replace(reason, "abort was asked for")
        return text

    def _without_timing(self, events: list[RecordedEvent]) -> list[RecordedEvent]:
        found = [k for k, each in enumerate(events) if each.kind == LimitExceeded.__name__ and _is_timing(each)]
        nexts = (events[k + 1].text for k in found if k + 1 < len(events))
        self.in_place = tuple(text.partition("-> aborting: ")[2] for text in nexts if "-> aborting: " in text)
        kept = (each for k, each in enumerate(events) if k not in found)
        return [RecordedEvent(each.time, each.kind, self.as_replayed(each.text)) for each in kept]

    def _blocks_before(self, entry: RecordedEvent) -> int:
        """A block and what followed from it have one time on a virtual clock; what came before it is earlier."""
        return int(np.searchsorted(self._block_times, entry.time, side="right"))


def _twin_behind(entry: RecordedEvent) -> bool:
    return entry.kind == Warned.__name__ and entry.text.startswith(BEHIND)


def _is_timing(entry: RecordedEvent) -> bool:
    return entry.text.startswith(_TIMING)


class AskingAgain:
    """A subscriber that asks for an end where somebody did."""

    def __init__(self, course: RecordedCourse, requests: Requests) -> None:
        self._waiting = deque(course.requests)
        self._course, self._requests = course, requests
        self._blocks = self._entries = 0

    def __call__(self, event: Event) -> None:
        self._blocks += isinstance(event, Acquired)
        self._entries += self._course.journalled(event)
        while self._waiting:
            place, word = self._waiting[0]
            if self._blocks < place.blocks or self._entries < place.entries:
                return
            self._waiting.popleft()
            {"stop": self._requests.stop, "abort": self._requests.abort, "halt": self._requests.halt}[word]()


class RecordedOperator:
    """Answers as the journal says; a question without an answer is declined."""

    def __init__(self, course: RecordedCourse) -> None:
        self._answers: deque[str | None] = deque()
        for entry in course.journal:
            if entry.kind == OperatorAsked.__name__:
                self._answers.append(None)
            elif entry.kind == OperatorAnswered.__name__ and self._answers:
                found = _ANSWER.search(entry.text)
                self._answers[-1] = found.group(1) if found else "operator"
        self.name = "operator"

    def confirm(self, request: str) -> bool:  # noqa: ARG002 - what is asked is compared with the journal elsewhere
        """The recorded answer; `name` is who gave it."""
        answer = self._answers.popleft() if self._answers else None
        self.name = answer or self.name
        return answer is not None
