"""A short real campaign, on the virtual bench unless told, into which a fault is put at a chosen place."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from bench.analysis.signals import SignalMap
from bench.control.oscillator import Segment
from bench.datafile.recorder import PATIENCE, Recorder
from bench.engine.engine import Engine
from bench.engine.interface import Ending, EventStream, Requests
from bench.engine.steps import Arm, Calibrate, Dwell, OperatorAction, Plan, RampOut, Step, Sweep
from bench.events import Event, State, StateChanged
from bench.guard.guard import Guard
from drivers.rig import OperatorTask
from drivers.simulated import SimulatedRig
from tests.faults.disk import Disk, spoil, wait_until_broken
from tests.faults.places import Place
from tests.faults.rig import FaultyRig
from tests.faults.setup import BARE, COUPLED, MOVER, PARAMETERS, NoPoint, Setting


class Person:
    """Whoever is asked: says yes, says no, or breaks down."""

    name = "a person of the tests"

    def __init__(self, struck: list[str]) -> None:
        self._struck = struck
        self.agrees = True
        self.error: BaseException | None = None

    def confirm(self, request: str) -> bool:
        assert request
        if self.error is not None:
            self._struck.append("operator")
            raise self.error
        return self.agrees


class FaultyBench:
    """Rig, guard, engine and recorder as a session puts them together, and the place at which a fault begins.

    `begin` is called once, when the engine comes to `place`; `begun` says whether it did.
    """

    def __init__(
        self,
        path: Path | None,
        place: Place | None = None,
        begin: "Begin | None" = None,
        requests: Requests | None = None,
        *,
        setting: Setting | None = None,
        rig: FaultyRig | None = None,
    ) -> None:
        self.place, self._begin = place, begin
        self.setting = setting or Setting()
        self.begun = False
        self.recovers = False
        """Whether a disk that hangs comes back when the run is over."""
        self.state, self.visits, self.turn = State.IDLE, dict.fromkeys(State, 0), 0
        self.rig = rig or FaultyRig(SimulatedRig(PARAMETERS, BARE, seed=1, lead=self.setting.lead))
        self.rig.before_read = self._next_turn
        self.person, self.requests, self.disk = Person(self.rig.struck), requests or Requests(), Disk()
        self.raising: BaseException | None = None
        """What a subscriber raises at the next event, once unless `raises_always`."""
        self.raises_always = False
        self._turns = 0
        self._later: list[tuple[int, Callable[[], object]]] = []
        self.extra: list[Step | Exception] = []
        """What the plan does next, out of turn."""
        self.events: list[Event] = []
        self.recorder: Recorder | None = None
        subscribers: list[Callable[[Event], None]] = [self._watch]
        if path is not None:
            self.recorder = recorder = Recorder(
                path,
                channels=self.rig.channels,
                sample_rate=self.setting.rate,
                point_type=NoPoint,
                metadata={},
                hold_up=PATIENCE if isinstance(self.rig.inner, SimulatedRig) else 0.0,
            )
            spoil(recorder, self.disk)
            subscribers.append(recorder)
        self.stream = EventStream(self.rig.clock, [*subscribers, self._fail])
        self.guard = Guard(
            self.rig, self.setting.limits, self.setting.ramps, MOVER, SignalMap(self.rig.channels, "ground")
        )
        self.engine = Engine(
            self.rig,
            self.guard,
            self.stream,
            self.requests,
            self.person,
            self.setting.block,
        )

    def start(self) -> None:
        """Begin the fault if it is there from the start."""
        if self.place is not None and self.place.visit == 0:
            self._begin_now()

    def plan(self) -> Plan:
        """Two tests; between any two steps `extra` comes first."""
        of = self.setting
        tests: list[list[Step]] = [
            [
                OperatorAction(work, specimen, work.value),
                Arm(of.rest, patience=2.0 * of.rest),
                Calibrate(of.calibration),
                Sweep((Segment(of.glide, of.amplitude, of.omega),)),
                *dwells,
                RampOut(fast=fast),
            ]
            for work, specimen, dwells, fast in (
                (OperatorTask.MOUNT_SPRING, COUPLED, [Dwell(1), Dwell(1)], False),
                (OperatorTask.STAND_BLOCK_UP, COUPLED, [Dwell(1)], True),
            )
        ]
        for step in (step for test in tests for step in test):
            if isinstance(step, Dwell | RampOut):
                yield from self._extra()
            yield step

    def _extra(self) -> Plan:
        while self.extra:
            one = self.extra.pop(0)
            self.rig.struck.append("step")
            if isinstance(one, Exception):
                raise one
            yield one

    def later(self, turns: int, act: Callable[[], object]) -> None:
        """Do something that many turns from now."""
        self._later.append((self._turns + turns, act))

    def _next_turn(self) -> None:
        self.turn += 1
        self._turns += 1
        self._look()
        for due in [one for one in self._later if one[0] <= self._turns]:
            self._later.remove(due)
            due[1]()

    def _watch(self, event: Event) -> None:
        self.events.append(event)
        if isinstance(event, StateChanged):
            self.state, self.turn = event.after, 0
            self.visits[event.after] += 1
            self._look()

    def _look(self) -> None:
        place = self.place
        if place is None:
            return
        here = (self.state, self.visits[self.state])
        if place.asked is not None and (*here, self.turn) == (State.RUNNING, 1, place.asked_in):
            getattr(self.requests, place.asked)()
        if here == (place.state, place.visit) and self.turn >= place.turn and not self.begun:
            self._begin_now()

    def _begin_now(self) -> None:
        self.begun = True
        if self._begin is not None:
            self._begin(self)

    def _fail(self, _event: Event) -> None:
        if self.recorder is not None and self.disk.error is not None:
            # the thread that writes is not the one that tells: without this, virtual time would run ahead of it
            wait_until_broken(self.recorder)
        if (error := self.raising) is not None:
            self.rig.struck.append("subscriber")
            if not self.raises_always:
                self.raising = None
            raise error


Begin = Callable[[FaultyBench], None]


@dataclass
class Story:
    """What came of one run."""

    bench: FaultyBench
    ending: Ending | None
    raised: BaseException | None
    close_error: Exception | None
    armed: bool
    """Whether the enable line was closed when the engine had ended."""

    @property
    def status(self) -> str:
        """As a session records it."""
        return "failed" if self.ending is None else self.ending.status

    @property
    def reason(self) -> str:
        """As a session records it; the words of what was raised where it was raised."""
        if self.ending is not None:
            return self.ending.reason
        return f"{type(self.raised).__name__}: {self.raised}"


def run(bench: FaultyBench, plan: Plan | None = None) -> Story:
    """Run a campaign to its end, and close everything as a session does."""
    ending: Ending | None = None
    raised: BaseException | None = None
    bench.start()
    try:
        ending = bench.engine.run(plan or bench.plan())
    except BaseException as error:
        raised = error
    story = Story(bench, ending, raised, None, bench.rig.armed)
    if bench.recovers:
        bench.disk.free.set()
    try:
        if bench.recorder is not None:
            bench.recorder.close(story.status, story.reason)
    except Exception as error:
        story.close_error = error
    return story


@contextmanager
def released(bench: FaultyBench) -> Iterator[None]:
    """Let go of whatever hangs, and of the rig."""
    try:
        yield
    finally:
        bench.disk.free.set()
        bench.rig.close()
