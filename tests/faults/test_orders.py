"""Searches for orders of steps, faults, requests and answers that break an invariant of engine and guard."""

import threading
from collections.abc import Callable
from queue import Queue

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from bench.control.oscillator import Segment
from bench.engine.steps import Arm, Calibrate, Dwell, OperatorAction, Outcome, Plan, RampOut, SetHarmonics, Step, Sweep
from bench.events import State
from drivers.rig import OperatorTask
from sim.specimen import Specimen
from tests.faults.audit import output_rules
from tests.faults.bench import FaultyBench, Story, run
from tests.faults.catalogue import catalogue
from tests.faults.fault import Fault, never
from tests.faults.setup import BARE, CALIBRATION, COUPLED
from tests.patience import LONG

FAULTS = [fault for fault in catalogue() if not (fault.disk or fault.disobeys or "enable line" in fault.name)]
DRIVEN = (State.ARMED, State.RUNNING, State.STOPPING, State.ABORTING)


class Orders(RuleBasedStateMachine):
    """Plays the plan of an engine that runs in a thread of its own; one of the two works at a time."""

    def __init__(self) -> None:
        super().__init__()
        self.bench = FaultyBench(None)
        self.faults: list[Fault] = []
        self.steps: Queue[Step | None] = Queue()
        self.outcomes: Queue[Outcome | Story] = Queue()
        self.story: Story | None = None
        self.thread = threading.Thread(target=lambda: self.outcomes.put(run(self.bench, self._plan())))
        self.thread.start()

    def _plan(self) -> Plan:
        while (step := self.steps.get(timeout=LONG)) is not None:
            self.outcomes.put((yield step))

    def _do(self, step: Step | None) -> None:
        self.steps.put(step)
        outcome = self.outcomes.get(timeout=LONG)
        if isinstance(outcome, Story):
            self.story = outcome

    @property
    def state(self) -> State | None:
        """What the engine is doing between two steps; None when it has ended."""
        return self.bench.engine.state if self.story is None else None

    @precondition(lambda self: self.state is State.IDLE)
    @rule(work=st.sampled_from([(OperatorTask.MOUNT_SPRING, COUPLED), (OperatorTask.REMOVE_BLOCK, BARE)]))
    def handle(self, work: tuple[OperatorTask, Specimen]) -> None:
        self._do(OperatorAction(*work, "as it is"))

    @precondition(lambda self: self.state is State.IDLE)
    @rule()
    def arm(self) -> None:
        self._do(Arm(0.2, patience=0.4))
        if self.state is State.RUNNING:
            self._do(Calibrate(CALIBRATION))

    @precondition(lambda self: self.state is State.RUNNING)
    @rule(amplitude=st.sampled_from([0.0, 0.4, 1.0]), omega=st.sampled_from([20.0, 25.0, 40.0]))
    def follow(self, amplitude: float, omega: float) -> None:
        self._do(Sweep((Segment(0.3, amplitude, omega),)))

    @precondition(lambda self: self.state is State.RUNNING)
    @rule(cycles=st.integers(1, 3))
    def dwell(self, cycles: int) -> None:
        self._do(Dwell(cycles))

    @precondition(lambda self: self.state is State.RUNNING)
    @rule(factor=st.sampled_from([0.5, 0.9, 1.1]))
    def trim(self, factor: float) -> None:
        self._do(SetHarmonics((factor,)))

    @precondition(lambda self: self.state is State.RUNNING)
    @rule(fast=st.booleans())
    def ramp_out(self, fast: bool) -> None:
        self._do(RampOut(fast=fast))

    @precondition(lambda self: self.state is not None)
    @rule(way=st.sampled_from(["stop", "abort", "halt"]), turns=st.integers(0, 6))
    def ask(self, way: str, turns: int) -> None:
        self._later(turns, getattr(self.bench.requests, way))

    @precondition(lambda self: self.state is not None)
    @rule(fault=st.sampled_from(FAULTS), turns=st.integers(0, 6))
    def spoil(self, fault: Fault, turns: int) -> None:
        self.faults.append(fault)
        self._later(turns, lambda: fault.begin(self.bench))

    @precondition(lambda self: self.state is not None)
    @rule()
    def end_the_plan(self) -> None:
        self._do(None)

    @precondition(lambda self: self.state is None)
    @rule()
    def nothing_more(self) -> None:
        """What has ended has ended."""

    @invariant()
    def armed_only_where_the_engine_says_so(self) -> None:
        if self.state in (State.IDLE, State.WAITING) or self.story is not None:
            assert not self.bench.rig.armed

    def _later(self, turns: int, act: Callable[[], object]) -> None:
        if turns == 0:
            act()
        else:
            self.bench.later(turns, act)

    def teardown(self) -> None:
        if self.story is None:
            self._do(None)
        self.thread.join(LONG)
        assert not self.thread.is_alive()
        assert self.story is not None
        assert not self.story.armed
        # a false or missing sample may hide a motion, and so may an amplifier that gives more
        moves = any(fault.moves for fault in self.faults) or "samples" in self.bench.rig.struck
        assert not list(output_rules(self.story, Fault("any", lambda _: None, "", "", never, moves=moves)))


def _settings(examples: int) -> settings:
    return settings(
        max_examples=examples, stateful_step_count=14, deadline=None, suppress_health_check=list(HealthCheck)
    )


TestOrders = Orders.TestCase
TestOrders.settings = _settings(60)


@pytest.mark.soak
class TestManyOrders(Orders.TestCase):
    """The same with more examples."""

    settings = _settings(1000)
