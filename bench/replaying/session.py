"""A recorded campaign through the same engine, guard and analysis once more, led along the same path by its data."""

from collections.abc import Sequence
from dataclasses import dataclass

from bench.analysis.signals import SignalMap
from bench.config.model import BenchConfiguration
from bench.engine.engine import Engine
from bench.engine.requests import Requests
from bench.engine.steps import Plan
from bench.engine.stream import Stream
from bench.events import Event, PointFinished, Subscriber, Warned
from bench.guard.guard import Guard
from bench.provenance import revision, software
from bench.record.reader import Record
from bench.record.replayed import ReplayedRecord
from bench.replaying.compare import DRIVE, ENDING, Comparison, Difference, Found
from bench.replaying.course import AskingAgain, RecordedCourse, RecordedOperator
from bench.twin.beside import twin_beside
from drivers.clock import Clock
from drivers.replay import ReplayRig
from sim.parameters import Parameters

UNFINISHED = "running"
"""Status of a file whose writer was killed."""


@dataclass(frozen=True)
class Replayed:
    """What a replay came to.

    `ended` says where the recording broke off, if the plan wanted more than there is: at an error of the rig or a
    killed program, which no data can show again. `in_place` are violations that are in no sample either, for which an
    abort was asked for in their place. `played` of `rows` samples were asked for. `returned` is
    what the plan returned, None where it broke off.
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
    returned: object = None

    def parted(self, part: str) -> str | None:
        """The first difference in a part that rounding does not explain."""
        return next((each.text for each in self.found.differences if each.part == part and not each.rounding), None)

    @property
    def identical(self) -> bool:
        """Whether everything came as recorded, to the last bit."""
        return not self.found.differences

    @property
    def agrees(self) -> bool:
        """Whether nothing but rounding differs."""
        return all(difference.rounding for difference in self.found.differences)


def stored_configuration(record: Record) -> BenchConfiguration:
    """The configuration of the bench that was recorded. Raises InvalidInput where there is none, or an unknown one."""
    return ReplayedRecord(record).configuration


def replay(
    record: Record,
    plan: Plan,
    configuration: BenchConfiguration,
    *,
    clock: Clock,
    subscribers: Sequence[Subscriber],
) -> Replayed:
    """Carry out `plan` on the samples of an open file, on the `configuration` that was recorded, and compare.

    `clock` begins at 0. Raises InvalidInput when
    the file cannot be played.
    """
    recording, course = ReplayedRecord(record), RecordedCourse(record)
    comparison, points = Comparison(record, course), list[Parameters]()

    def keep(event: Event) -> None:
        if isinstance(event, PointFinished):
            points.append(event.point)

    requests = Requests()
    with ReplayRig(recording, clock=clock, course=course) as rig:
        # who asks comes last: what was said before is with everybody by then
        heard = [comparison, keep, *subscribers, AskingAgain(course, requests)]
        stream = Stream(clock, heard)
        signals = SignalMap(rig.channels, configuration.laser_reference, configuration.calibrated)
        engine = Engine(
            rig,
            Guard(rig, configuration.limits, configuration.ramps, configuration.mover, signals, configuration.channels),
            stream,
            requests,
            RecordedOperator(course),
            configuration.block_samples,
        )
        for warning in course.first_warnings:
            stream.publish(Warned(warning))
        with twin_beside(stream, rig, configuration, requests, patient=True):
            ending = engine.run(plan)
        over = rig.over
    broke_off = _broke_off(record, over)
    found = comparison.finish(ending.reason.partition("; then ")[0] if broke_off else None)
    if broke_off is None and (record.status, course.as_replayed(record.summary)) != (ending.status, ending.reason):
        was = f"{record.status} ({record.summary})"
        said = f"the run was {was}; the replay was {ending.status} ({ending.reason})"
        found.differences.append(Difference(said, ENDING))
    played, rows = comparison.drive_played, record.rows
    # of a block that was cut short nothing is played
    if rows - played >= (configuration.block_samples if broke_off else 1):
        found.differences.append(Difference(f"{played} of {rows} recorded samples were asked for", DRIVE))
    return Replayed(
        status=ending.status,
        reason=ending.reason,
        points=tuple(points),
        ended=broke_off,
        in_place=course.in_place,
        played=played,
        rows=rows,
        found=found,
        changed=_changed(record.metadata),
        returned=engine.returned,
    )


def _broke_off(record: Record, over: str | None) -> str | None:
    """Where the recording ends although its plan would go on, and why; None when the replay ended by itself."""
    if record.status == UNFINISHED:
        return f"{over or 'it ends'}: the program that wrote it was killed, or still writes"
    if over is None or record.status not in ("failed", "halted", "interrupted"):
        return None
    return f"{over}: the run {record.status} there, {record.summary}"


def _changed(metadata: dict[str, str]) -> tuple[str, ...]:
    """Software that numbers depend on and that is another than when the file was written: by version or git hash."""
    now = software()
    known = {name: metadata.get(name, "unknown") for name in now}
    versions = (f"{name} was {known[name]} and is {now[name]}" for name in now if known[name] != now[name])
    return (*versions, *_changed_files(metadata.get("git", "unknown"), revision()))


def _changed_files(was: str, now: str) -> tuple[str, ...]:
    """What the git hashes tell: nothing where a file had been changed since its hash ("+") or there is none."""
    if was != now:
        return (f"git was {was} and is {now}",)
    if now == "unknown" or now.endswith("+"):
        return (f"git is {now} as it was, which does not tell whether the files are the same",)
    return ()
