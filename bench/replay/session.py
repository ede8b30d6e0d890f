"""Replay of a recorded campaign with the engine, guard and analysis of live runs."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from bench.config.model import BenchConfiguration
from bench.datafile.reader import DataFile
from bench.engine.engine import configured_engine
from bench.engine.interface import EventStream, Requests
from bench.engine.steps import Plan
from bench.events import Acquired, Event, OperatorAnswered, OperatorAsked, Subscriber, Warned
from bench.provenance import revision, software
from bench.replay.compare import DRIVE, ENDING, Comparison, Difference, Found
from bench.replay.course import RecordedCourse
from bench.replay.recording import DataFileRecording
from bench.twin.live import live_twin
from drivers.clock import Clock, now
from drivers.replay import ReplayRig
from sim import waiting
from sim.parameters import Parameters

LONGEST_WAIT = 1.0
"""Longest pause that a paced replay reproduces [s of bench time]; longer ones, as for operator actions, are shortened
to it.
"""


class PacedClock:
    """Clock that shows the recorded time and runs at `speed` times real time. No block is late, however slow the
    computer is.

    With a real-time clock, blocks that were recorded in time could be late for the guard.
    """

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._now = 0.0
        self._due = now()

    def now(self) -> float:
        """Bench time [s]."""
        return self._now

    def wait_until(self, instant: float) -> None:
        """Wait until bench time `instant` [s] is due, and set the clock to this time."""
        ahead = instant - self._now
        if ahead <= 0.0:
            return
        self._now = instant
        # do not make up for delays caused by slow computations
        self._due = max(self._due + min(ahead, LONGEST_WAIT) / self._speed, now())
        while (remaining := self._due - now()) > 0.0:
            waiting.sleep(remaining)


class RequestReplay:
    """Subscriber that repeats the recorded requests to end the run."""

    def __init__(self, course: RecordedCourse, requests: Requests) -> None:
        self._waiting = deque(course.requests)
        self._course, self._requests = course, requests
        self._blocks = self._entries = 0

    def __call__(self, event: Event) -> None:
        self._blocks += isinstance(event, Acquired)
        self._entries += self._course.journalled(event)
        while self._waiting:
            request = self._waiting[0]
            if self._blocks < request.blocks or self._entries < request.entries:
                return
            self._waiting.popleft()
            self._requests.cuts_while_arming = request.halted
            make = {"stop": self._requests.stop, "abort": self._requests.abort, "halt": self._requests.halt}
            make[request.kind](request.reason, request.code)


class RecordedOperator:
    """Operator that answers as recorded and declines a request without a recorded answer."""

    def __init__(self, course: RecordedCourse) -> None:
        self._answers: deque[str | None] = deque()
        for entry in course.journal:
            if entry.kind == OperatorAsked.__name__:
                self._answers.append(None)
            elif entry.kind == OperatorAnswered.__name__ and self._answers:
                self._answers[-1] = entry.columns.get("by", "operator")
        self.name = "operator"

    def confirm(self, request: str) -> bool:  # noqa: ARG002 - the request is compared with the journal elsewhere
        """Return the recorded answer and set `name` to its author."""
        answer = self._answers.popleft() if self._answers else None
        self.name = answer or self.name
        return answer is not None


UNFINISHED = "running"
"""Status of a file whose writer was killed."""


@dataclass(frozen=True)
class Replayed:
    """Result of a replay.

    `ended` states where and why the recording broke off before the end of the plan: an error of the rig, or the end of
    a killed program, neither of which recorded data can reproduce. `in_place` lists violations that the samples do not
    contain; the replay makes abort requests in their place. `played` of `rows` samples were requested. `same_wording`
    is False for a file with other message texts, and `same_intervals` for one with another evaluation of uncertainties;
    texts or uncertainties are then not compared. `beyond` states what the plan requested after the end of a complete
    recording, or is None. `returned` is the result of the plan, or None if the plan did not end by itself.
    """

    status: str
    reason: str
    points: tuple[Parameters, ...]
    ended: str | None
    in_place: tuple[str, ...]
    played: int
    rows: int
    found: Found
    changed: tuple[str, ...]
    same_wording: bool
    same_intervals: bool
    returned: object = None
    beyond: str | None = None

    def first_difference(self, part: str) -> str | None:
        """First difference in `part` that is larger than rounding, or None."""
        return next((each.text for each in self.found.differences if each.part == part and not each.rounding), None)

    @property
    def identical(self) -> bool:
        """Whether all compared values are identical."""
        return not self.found.differences

    @property
    def agrees(self) -> bool:
        """Whether replay and recording agree to within rounding."""
        return all(difference.rounding for difference in self.found.differences)


def stored_configuration(record: DataFile) -> BenchConfiguration:
    """Recorded configuration of the bench. Raises InvalidInput if there is none or it cannot be read."""
    return DataFileRecording(record).configuration


def replay(
    record: DataFile,
    plan: Plan,
    configuration: BenchConfiguration,
    *,
    clock: Clock,
    subscribers: Sequence[Subscriber],
) -> Replayed:
    """Carry out `plan` on the samples of an open file, with the recorded `configuration`, and compare the results.

    `clock` begins at 0. Raises InvalidInput if the file cannot be replayed.
    """
    recording, course = DataFileRecording(record), RecordedCourse(record)
    comparison, requests = Comparison(record, course), Requests()
    with ReplayRig(recording, clock=clock, course=course) as rig:
        # last, so that all other subscribers have received an event before the request that follows it is made
        stream = EventStream(clock, [comparison, *subscribers, RequestReplay(course, requests)])
        engine = configured_engine(rig, configuration, stream, requests, RecordedOperator(course))
        for warning in course.first_warnings:
            stream.publish(Warned(warning))
        with live_twin(stream, rig, configuration, requests, patient=True):
            ending = engine.run(plan)
        over = rig.overrun
    broke_off = _early_end(record, over)
    found = comparison.finish(ending.reason.partition("; then ")[0] if broke_off else None)
    same_summary = not course.same_wording or record.summary == ending.reason
    if broke_off is None and not (record.status == ending.status and same_summary):
        was = f"{record.status} ({record.summary})"
        said = f"the run was {was}; the replay was {ending.status} ({ending.reason})"
        found.differences.append(Difference(said, ENDING))
    played, rows = comparison.drive_played, record.rows
    # an incomplete last block is not replayed
    if rows - played >= (configuration.block_samples if broke_off else 1):
        found.differences.append(Difference(f"{played} of {rows} recorded samples were requested", DRIVE))
    return Replayed(
        status=ending.status,
        reason=ending.reason,
        points=tuple(stream.points),
        ended=broke_off,
        in_place=course.in_place,
        played=played,
        rows=rows,
        found=found,
        changed=_changed(record.metadata),
        same_wording=course.same_wording,
        same_intervals=course.same_intervals,
        returned=engine.returned,
        beyond=over if broke_off is None else None,
    )


def _early_end(record: DataFile, over: str | None) -> str | None:
    """Text that states where and why the recording ends before the end of its plan; None if the plan ended."""
    if record.status == UNFINISHED:
        return f"{over or 'the file ends'}: the program that wrote the file was killed, or is still writing"
    if record.status == "interrupted":
        # a recovered file may end without a lack of samples, for example at a question to the operator
        over = over or "the file ends"
    if over is None or record.status not in ("failed", "halted", "interrupted"):
        return None
    return f"{over}: the run ended there ({record.status}), {record.summary}"


def _changed(metadata: dict[str, str]) -> tuple[str, ...]:
    """Changes in the software on which results depend, by version or git hash, since the file was written."""
    now = software()
    known = {name: metadata.get(name, "unknown") for name in now}
    versions = (f"{name} was {known[name]} and is {now[name]}" for name in now if known[name] != now[name])
    return (*versions, *_changed_files(metadata.get("git", "unknown"), revision()))


def _changed_files(was: str, now: str) -> tuple[str, ...]:
    """Notice about the git hashes; empty if both are known, equal and without uncommitted changes ("+")."""
    if was != now:
        return (f"git was {was} and is {now}",)
    if now == "unknown" or now.endswith("+"):
        return (f"git is {now} in both, which does not prove that the sources are identical",)
    return ()
