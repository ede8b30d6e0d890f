"""The engine: steps in, events out, and the output at zero whatever happens."""

import itertools
import threading
import time
from collections.abc import Callable, Generator
from math import tau

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.control.oscillator import DriveCalibration, Segment
from bench.engine.engine import Ending
from bench.engine.output import TRANSITIONS, StateMachine
from bench.engine.steps import (
    Arm,
    Calibrate,
    Dwell,
    Fallen,
    Measured,
    OperatorAction,
    Outcome,
    Plan,
    Publish,
    RampOut,
    Scheduled,
    SetHarmonics,
    Step,
    Sweep,
)
from bench.events import Acquired, Event, LimitExceeded, OperatorAsked, State, StateChanged, StepStarted, Warned
from bench.guard.limits import Limits
from bench.testing.loopback import LoopbackBench, LoopbackRig
from drivers.errors import ConnectionLost, DriveUnderflow, EnableLineCut, SafetyInputOpened
from drivers.rig import Block, OperatorTask, RigError
from sim.errors import Cause, RockbenchError
from sim.specimen import Specimen
from tests.bench.engine.bench import OMEGA, Bench
from tests.patience import LONG

COUPLED = Specimen().coupled(0.4)
MOUNT = OperatorAction(OperatorTask.MOUNT_SPRING, COUPLED, "mount the spring")


def _plan(*steps: Step, outcomes: list[Outcome] | None = None) -> Plan:
    for step in steps:
        outcome = yield step
        if outcomes is not None:
            outcomes.append(outcome)


RUN: tuple[Step, ...] = (
    MOUNT,
    Arm(0.5),
    Calibrate(DriveCalibration.flat(1.0)),
    Sweep((Segment(2.0, 1.0, OMEGA),)),
    Dwell(6),
    RampOut(),
)


def test_a_whole_test_goes_through_its_states_and_ends_at_zero() -> None:
    bench = Bench()
    assert bench.run(_plan(*RUN)).status == "completed"
    assert bench.states() == [
        State.WAITING,
        State.IDLE,
        State.ARMED,
        State.RUNNING,
        State.STOPPING,
        State.IDLE,
        State.CLOSED,
    ]
    assert bench.rig.done == [OperatorTask.MOUNT_SPRING]
    assert bench.ends_at_zero()


def test_a_dwell_measures_the_cycles_of_the_motion_that_was_asked_for() -> None:
    bench, outcomes = Bench(), list[Outcome]()
    bench.run(_plan(*RUN, outcomes=outcomes))
    measured = outcomes[4]
    assert isinstance(measured, Measured)
    assert len(measured.cycles) == 6
    for cycle in measured.cycles:
        assert np.abs(cycle.fundamental[0]) == pytest.approx(1.0, rel=1e-3)
        assert np.abs(cycle.fundamental[6]) == pytest.approx(1.0, rel=1e-9)


def test_dwells_follow_each_other_without_a_gap() -> None:
    bench, outcomes = Bench(), list[Outcome]()
    bench.run(_plan(*RUN[:5], Dwell(3), SetHarmonics((1.1,)), Dwell(4), RampOut(), outcomes=outcomes))
    indices = [cycle.index for outcome in outcomes if isinstance(outcome, Measured) for cycle in outcome.cycles]
    assert indices == list(range(len(indices)))
    assert np.abs(outcomes[-2].cycles[-1].fundamental[0]) == pytest.approx(1.1, rel=1e-3)  # type: ignore[union-attr]


def test_cycles_begin_at_the_phase_asked_for_and_a_change_with_its_cycle() -> None:
    bench, outcomes = Bench(), list[Outcome]()
    phase = 2.0
    changes = (SetHarmonics((1.2,), cycle=4, blend=0.1), Dwell(8))
    bench.run(_plan(*RUN[:5], Dwell(2, phase), *changes, RampOut(), outcomes=outcomes))
    first, second = (each for each in outcomes[-4:] if isinstance(each, Measured))
    assert [cycle.index for cycle in (*first.cycles, *second.cycles)] == list(range(10))
    sizes = [abs(cycle.fundamental[6]) for cycle in (*first.cycles, *second.cycles)]
    assert sizes[:4] == pytest.approx([sizes[0]] * 4, rel=1e-9)
    assert sizes[5:] == pytest.approx([1.2 * sizes[0]] * 5, rel=1e-9)
    # the change lasts a tenth of cycle 4
    assert 1.1 < sizes[4] / sizes[0] < 1.2
    drive = np.concatenate([event.drive for event in bench.events if isinstance(event, Acquired)])
    step = OMEGA / bench.rig.sample_rate
    end = drive.size // 2
    held = slice(end - 300, end)
    basis = np.exp(1j * step * np.arange(drive.size))
    sine, cosine = np.linalg.lstsq(np.stack((basis.imag[held], basis.real[held]), axis=1), drive[held], rcond=None)[0]
    expected = sine * basis.imag + cosine * basis.real
    departed = held.start + int(np.argmax(np.abs(drive - expected)[held.start :] > 1e-9))
    reached = (step * (departed - 1) + np.arctan2(cosine, sine) - phase) % tau
    # the first changed sample follows the one at which the cycle begins, and differs little from the sine
    assert min(reached, tau - reached) < 3.0 * step


@pytest.mark.parametrize(("lead", "late"), [(100, 0.0), (900, 900.0 - 2.0 * tau / OMEGA * 1000.0)])
def test_a_change_that_comes_too_late_for_its_cycle_says_by_how_much(lead: int, late: float) -> None:
    """Two cycles before its own, as soon as the block with their last sample has been read."""
    bench = Bench(LoopbackRig(lead=lead))
    bench.run_steps(*RUN[:5], Dwell(2, 2.0), SetHarmonics((1.2,), cycle=4), RampOut())
    (told,) = (each for each in bench.outcomes if isinstance(each, Scheduled))
    least = max(late, 0.0) / 1000.0
    assert least <= told.late <= least + (0.1 if late else 0.0)


def test_blocks_are_contiguous_within_a_run_and_counted_anew_in_the_next() -> None:
    bench = Bench()
    bench.run(_plan(*RUN, Arm(0.3), RampOut()))
    acquired = [event for event in bench.events if isinstance(event, Acquired)]
    for run, blocks in itertools.groupby(acquired, key=lambda event: event.run):
        ends = 0
        for event in blocks:
            assert event.block.first == ends
            ends += len(event.block)
            assert event.drive.size == len(event.block)
        assert run in (1, 2)


def test_a_fallen_block_ends_the_step_and_leaves_the_rest_to_the_plan() -> None:
    offset = np.zeros(1)

    def laser(volts: np.ndarray) -> np.ndarray:
        return 0.001 * volts + offset[0]

    rig = LoopbackRig(
        {
            "table_displacement": lambda v: 0.01 * v,
            "table_acceleration": lambda v: v,
            "laser_1": laser,
            "laser_2": laser,
        }
    )

    def plan() -> Plan:
        yield from _plan(*RUN[:4])
        offset[0] = 0.03
        assert isinstance((yield Dwell(40)), Fallen)
        yield RampOut(fast=True)
        yield OperatorAction(OperatorTask.STAND_BLOCK_UP, COUPLED, "stand it up")

    bench = Bench(rig)
    assert bench.run(plan()).status == "completed"
    assert State.ABORTING in bench.states()
    assert bench.rig.done[-1] is OperatorTask.STAND_BLOCK_UP
    assert bench.ends_at_zero()


@pytest.mark.parametrize(("way", "status"), [("stop", "stopped"), ("abort", "aborted"), ("halt", "halted")])
@pytest.mark.parametrize("after", [0, 3, 20, 45])
def test_a_person_ends_the_run_in_any_state(way: str, status: str, after: int) -> None:
    bench = Bench()
    seen = 0

    def listener(event: Event) -> None:
        nonlocal seen
        seen += isinstance(event, Acquired)
        if seen == after and isinstance(event, Acquired | OperatorAsked):
            getattr(bench.requests, way)()

    bench = Bench(subscriber=listener)
    assert bench.run(_plan(*RUN, *RUN)).status == status
    if way == "halt":
        assert bench.rig.halted
    else:
        assert bench.ends_at_zero()


def test_a_limit_is_published_and_the_run_aborted() -> None:
    bench = Bench(LoopbackRig({"table_displacement": lambda v: 0.1 * v, **_others()}))
    ending = bench.run(_plan(*RUN))
    assert ending.status == "aborted"
    assert "table velocity" in ending.reason  # 0.1 m at 16 rad/s: 1.6 m/s passes 0.6 m/s first
    assert sum(isinstance(event, LimitExceeded) for event in bench.events) == 1
    assert bench.ends_at_zero()


def _reasons(bench: Bench) -> list[str]:
    return [event.reason for event in bench.events if isinstance(event, StateChanged)]


def _others() -> dict[str, Callable[[np.ndarray], np.ndarray]]:
    return {
        "table_acceleration": lambda v: v,
        "laser_1": lambda v: 0.001 * v,
        "laser_2": lambda v: 0.002 * v,
    }


def test_a_table_that_runs_away_without_a_drive_loses_its_enable_line() -> None:
    away = np.zeros(1)

    def displacement(volts: np.ndarray) -> np.ndarray:
        away[0] += 0.004
        return np.full(volts.size, away[0])

    bench = Bench(LoopbackRig({"table_displacement": displacement, **_others()}))
    ending = bench.run(_plan(*RUN))
    assert ending.status == "halted"
    assert "after the drive was ramped to zero" in ending.reason
    assert bench.rig.halted


class _Failing(LoopbackRig):
    """Fails at its 30th block."""

    def read(self, n: int) -> Block:
        if self.played.size >= 3000:
            raise RigError("the device is gone: check its power and its cable")
        return super().read(n)


def test_a_lost_device_is_a_failed_run_with_the_enable_line_cut() -> None:
    bench = Bench(_Failing())
    ending = bench.run(_plan(*RUN))
    assert ending == Ending("failed", "the device is gone: check its power and its cable")
    assert bench.rig.halted
    assert bench.states()[-2:] == [State.HALTED, State.CLOSED]


def test_an_exception_in_the_plan_cuts_the_output_and_is_not_swallowed() -> None:
    def plan() -> Plan:
        yield from _plan(*RUN[:4])
        raise ZeroDivisionError("a mistake in the lab sheet")

    bench = Bench()
    with pytest.raises(ZeroDivisionError):
        bench.engine.run(plan())
    assert bench.rig.halted
    assert not bench.rig.armed


def test_an_error_that_is_not_the_rigs_ends_with_the_fast_ramp() -> None:
    def plan() -> Plan:
        yield from _plan(*RUN[:4])
        raise RockbenchError("the record gave up: the disk is full")

    bench = Bench()
    ending = bench.engine.run(plan())
    assert ending == Ending("failed", "the record gave up: the disk is full")
    assert State.ABORTING in bench.states()
    assert not bench.rig.halted
    assert bench.ends_at_zero()


def test_a_plan_that_forgets_its_ramp_is_ramped_out() -> None:
    bench = Bench()
    assert bench.run(_plan(*RUN[:4])).status == "completed"
    assert bench.ends_at_zero()
    assert not bench.rig.halted


@pytest.mark.parametrize(("way", "status"), [("abort", "completed"), ("halt", "halted")])
def test_what_is_asked_in_the_last_ramp_of_a_plan_that_forgot_it_is_an_ending(way: str, status: str) -> None:
    """The ramp is the fast one already: an abort finds nothing left to end."""

    def listener(event: Event) -> None:
        if isinstance(event, StateChanged) and event.after is State.ABORTING:
            getattr(bench.requests, way)()

    bench = Bench(subscriber=listener)
    assert bench.run(_plan(*RUN[:4])).status == status


def test_an_ending_that_grows_worse_names_both_reasons() -> None:
    def listener(event: Event) -> None:
        if isinstance(event, StateChanged) and event.after is State.RUNNING:
            bench.requests.stop()
        if isinstance(event, StateChanged) and event.after is State.STOPPING:
            bench.requests.abort()

    bench = Bench(subscriber=listener)
    assert bench.run(_plan(*RUN)) == Ending("aborted", "stop requested; then abort requested")
    assert bench.ends_at_zero()


def test_a_limit_that_is_exceeded_in_the_fast_ramp_of_a_test_ends_the_campaign() -> None:
    lost = [False]

    def laser(volts: np.ndarray) -> np.ndarray:
        return np.full(volts.size, np.nan) if lost[0] else 0.002 * volts

    def listener(event: Event) -> None:
        lost[0] |= isinstance(event, StateChanged) and event.after is State.ABORTING

    limits = Limits(sensor_loss=0.1)
    bench = Bench(LoopbackRig({**LoopbackRig().response, "laser_2": laser}), subscriber=listener, limits=limits)
    ending = bench.run(_plan(*RUN[:5], RampOut(fast=True), *RUN))
    assert ending.status == "aborted"
    assert "valid sample from laser_2" in ending.reason
    assert sum(isinstance(event, LimitExceeded) for event in bench.events) == 1


def test_missing_samples_are_a_failed_run() -> None:
    class Leaky(LoopbackRig):
        def read(self, n: int) -> Block:
            block = super().read(n)
            return Block(block.first + (10 if block.first > 2000 else 0), block.counts)

    bench = Bench(Leaky())
    ending = bench.run(_plan(*RUN))
    assert ending.status == "failed"
    assert "samples are missing" in ending.reason


def test_a_fall_while_the_test_is_ramped_out_is_told_to_the_plan() -> None:
    offset = np.zeros(1)
    rig = LoopbackRig({**LoopbackRig().response, "laser_1": lambda v: 0.001 * v + offset[0]})
    seen: list[Outcome] = []

    def plan() -> Plan:
        yield from _plan(*RUN[:5])
        offset[0] = 0.03
        seen.append((yield RampOut()))

    Bench(rig).run(plan())
    assert [type(outcome) for outcome in seen] == [Fallen]


def test_an_exception_in_a_subscriber_cuts_the_output() -> None:
    def listener(event: Event) -> None:
        if isinstance(event, Acquired) and event.block.first > 2000:
            raise OSError("disk full")

    bench = Bench(subscriber=listener)
    with pytest.raises(OSError, match="disk full"):
        bench.engine.run(_plan(*RUN))
    assert bench.rig.halted


def test_the_plan_is_told_that_it_is_over() -> None:
    closed = []

    def plan() -> Generator[Step, Outcome, None]:
        try:
            yield from _plan(*RUN)
        finally:
            closed.append(True)

    bench = Bench()
    bench.requests.abort()
    bench.run(plan())
    assert closed == [True]


def test_an_operator_who_declines_aborts_the_campaign() -> None:
    class Declines:
        name = "somebody"

        def confirm(self, request: str) -> bool:
            return "spring" not in request

    bench = Bench()
    bench.engine._operator = Declines()  # pyright: ignore[reportPrivateUsage]
    assert bench.run(_plan(*RUN)).status == "aborted"
    assert bench.rig.done == []


def test_the_question_says_of_which_kind_the_work_is_before_it_is_asked() -> None:
    bench, known = Bench(), list[OperatorTask | None]()

    class Watches:
        name = "somebody"

        def confirm(self, request: str) -> bool:  # noqa: ARG002
            known.extend(event.work for event in bench.events if isinstance(event, OperatorAsked))
            return True

    bench.engine._operator = Watches()  # pyright: ignore[reportPrivateUsage]
    bench.run(_plan(MOUNT, OperatorAction(OperatorTask.LOCK_FRAME, COUPLED, "clamp it")))
    assert known == [OperatorTask.MOUNT_SPRING, OperatorTask.MOUNT_SPRING, OperatorTask.LOCK_FRAME]


def test_what_a_plan_says_is_stamped_with_the_time_of_the_bench() -> None:
    bench = Bench()
    bench.run(_plan(MOUNT, Arm(1.0), Publish(StepStarted("now")), RampOut()))
    said = next(event for event in bench.events if isinstance(event, StepStarted))
    assert said.time == pytest.approx(1.0)


def test_illegal_transitions_are_refused() -> None:
    for before, after in itertools.product(State, State):
        machine = StateMachine(lambda *_: None)
        machine._state = before  # pyright: ignore[reportPrivateUsage]
        if after in TRANSITIONS[before]:
            machine.go(after, "")
            assert machine.state is after
        else:
            with pytest.raises(RuntimeError, match="cannot go"):
                machine.go(after, "")


@settings(max_examples=30, deadline=None)
@given(
    st.lists(
        st.sampled_from([Dwell(2), SetHarmonics((1.2,)), SetHarmonics((0.5, 0.1j)), Sweep((Segment(0.5, 2.0, 20.0),))]),
        max_size=6,
    ),
    st.integers(0, 60),
    st.sampled_from(["stop", "abort", "halt"]),
)
def test_any_plan_cut_anywhere_leaves_the_rig_stopped_and_within_limits(
    middle: list[Step], after: int, way: str
) -> None:
    count = itertools.count()

    def listener(event: Event) -> None:
        if isinstance(event, Acquired) and next(count) == after:
            getattr(bench.requests, way)()

    bench = Bench(subscriber=listener)
    bench.run(_plan(*RUN[:4], *middle, RampOut()))
    assert np.abs(bench.rig.played).max(initial=0.0) <= Limits().drive_voltage
    assert way == "halt" or bench.ends_at_zero()


def test_the_zero_is_taken_when_the_storeys_are_still_or_with_a_warning_when_they_never_are() -> None:
    sway = iter(np.linspace(1.0, -1.0, 40))

    def laser(volts: np.ndarray) -> np.ndarray:
        return np.full(volts.size, max(next(sway, 0.0), 0.0) * 0.01) + 0.02

    calm = LoopbackRig({"table_displacement": lambda v: 0.0 * v, **_others(), "laser_2": laser})
    bench = Bench(calm)
    bench.run(_plan(MOUNT, Arm(0.5), RampOut()))
    assert bench.rig.clock.now() > 2.0
    assert not any(isinstance(event, Warned) for event in bench.events)
    assert "storeys at rest, signals tared" in _reasons(bench)

    shaking = LoopbackRig(
        {"table_displacement": lambda v: 0.0 * v, **_others(), "laser_2": lambda v: 0.02 * np.sin(np.arange(v.size))}
    )
    bench = Bench(shaking)
    bench.run(_plan(MOUNT, Arm(0.5, patience=2.0), RampOut()))
    (warning,) = [event for event in bench.events if isinstance(event, Warned)]
    assert "still moving after 2 s" in warning.text
    assert "storeys still moving, signals tared" in _reasons(bench)
    assert not any("at rest" in reason for reason in _reasons(bench))


@pytest.mark.parametrize(
    ("error", "code"),
    [(ConnectionLost("cDAQ1 is gone"), "connection_lost"), (DriveUnderflow("too late"), "drive_underflow")],
)
def test_the_cause_of_an_ending_is_that_of_the_drivers_error(error: RigError, code: str) -> None:
    def fail(event: Event) -> None:
        if isinstance(event, Acquired) and event.time > 1.5:
            raise error

    bench = Bench(subscriber=fail)
    ending = bench.run(_plan(*RUN))
    assert (ending.status, ending.cause) == ("failed", Cause(code))


@pytest.mark.parametrize("ask", ["stop", "abort", "halt"])
def test_the_cause_of_an_ending_that_was_asked_for_is_the_request(ask: str) -> None:
    bench = Bench()
    getattr(bench.requests, ask)("words that nobody looks at")
    assert bench.run(_plan(*RUN)).cause == Cause("request", ask)


def test_the_cause_of_a_limit_is_its_quantity_and_of_a_safety_input_its_name() -> None:
    over = Bench(limits=Limits(displacement=0.001))
    assert over.run(_plan(*RUN)).cause == Cause("limit", "table displacement")
    opened = Bench()
    opened.rig.safety = {"emergency stop": False}
    assert opened.run(_plan(*RUN)).cause == Cause("safety_input", "emergency stop")


def test_a_safety_input_that_opens_before_the_first_block_halts_the_bench() -> None:
    class Opened(LoopbackRig):
        def read(self, n: int) -> Block:  # noqa: ARG002
            raise SafetyInputOpened("emergency stop opened before the first sample of the run", ["emergency stop"])

    bench = Bench(Opened())
    ending = bench.run(_plan(*RUN))
    assert (ending.status, ending.cause) == ("halted", Cause("safety_input", "emergency stop"))
    assert bench.rig.halted
    assert bench.states()[-2:] == [State.HALTED, State.CLOSED]


def test_a_limit_that_cuts_opens_the_enable_line_without_a_ramp() -> None:
    ramped = Bench(limits=Limits(displacement=0.001))
    cut = Bench(limits=Limits(displacement=0.001, cut=("displacement",)))
    assert ramped.run(_plan(*RUN)).status == "aborted"
    ending = cut.run(_plan(*RUN))
    assert (ending.status, ending.cause) == ("halted", Cause("limit", "table displacement"))
    assert ending.reason.endswith("the enable line was cut")
    assert cut.rig.halted
    assert not ramped.rig.halted
    assert cut.rig.played.size < ramped.rig.played.size
    assert sum(isinstance(event, LimitExceeded) for event in cut.events) == 1
    assert cut.states()[-2:] == [State.HALTED, State.CLOSED]


class SlowToArm(LoopbackRig):
    """Its amplifier takes time to be armed, and is not enabled after a cut."""

    def __init__(self) -> None:
        super().__init__()
        self.arming, self.enabled = threading.Event(), False

    def arm(self) -> None:
        self.arming.set()
        for _ in range(500):
            if self.halted:
                raise EnableLineCut
            time.sleep(0.01)
        self.enabled = True
        super().arm()


@pytest.mark.parametrize(("end", "status"), [("stop", "stopped"), ("abort", "aborted"), ("halt", "halted")])
def test_a_request_while_the_rig_is_being_armed_enables_nothing(end: str, status: str) -> None:
    rig = SlowToArm()
    bench = LoopbackBench(rig)

    def request() -> None:
        rig.arming.wait(LONG)
        getattr(bench.requests, end)("somebody is at the table")

    thread = threading.Thread(target=request)
    thread.start()
    ending = bench.run_steps(Arm(0.5), RampOut())
    thread.join()
    assert (ending.status, ending.reason) == (status, "somebody is at the table")
    assert rig.halted
    assert not rig.enabled
    assert rig.played.size == 0
    assert bench.states() == [State.ARMED, State.HALTED, State.CLOSED]


def test_an_error_while_the_rig_is_being_armed_is_told_beside_a_request() -> None:
    class Unreachable(LoopbackRig):
        def arm(self) -> None:
            bench.requests.stop("somebody is waiting")
            raise RigError("the output could not be set: no network")

    bench = LoopbackBench(Unreachable())
    ending = bench.run_steps(Arm(0.5), RampOut())
    assert ending.status == "failed"
    assert ending.reason == "somebody is waiting; then the output could not be set: no network"
