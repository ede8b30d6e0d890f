"""Acquisition with the output at zero, and the alignment of the sensors' clocks after a run."""

from collections.abc import Callable

import numpy as np
import pytest

from bench.control.oscillator import DriveCalibration, Segment
from bench.engine.steps import AcquireAtRest, Arm, Calibrate, Dwell, Plan, RampOut, RestSamples, Sweep
from bench.events import Acquired, Event, LimitExceeded, SensorsAligned, State, Warned
from bench.testing.loopback import LoopbackRig
from drivers.rig import Alignment, Block, RigError
from sim.errors import RockbenchError
from tests.bench.engine.bench import OMEGA, Bench

LISTENED = [State.ARMED, State.STOPPING, State.IDLE, State.CLOSED]
ALIGNED = (Alignment("laser_1", 0.1, 1.00003, 2e-6, 0.0035, 4000, 1),)


def _plan(*steps: object, outcomes: list[object] | None = None) -> Plan:
    for step in steps:
        outcome = yield step  # type: ignore[misc]
        if outcomes is not None:
            outcomes.append(outcome)


TEST = (Arm(0.5), Calibrate(DriveCalibration.flat(1.0)), Sweep((Segment(1.0, 1.0, OMEGA),)), Dwell(2), RampOut())


def _heard(rig: LoopbackRig) -> tuple[Bench, RestSamples]:
    bench, outcomes = Bench(rig), list[object]()
    assert bench.run(_plan(AcquireAtRest(0.5), outcomes=outcomes)).status == "completed"
    (heard,) = outcomes
    assert isinstance(heard, RestSamples)
    return bench, heard


def _with(**changed: Callable[[np.ndarray], np.ndarray]) -> LoopbackRig:
    rig = LoopbackRig()
    return LoopbackRig(rig.response | changed)


def test_listening_takes_counts_of_all_channels_with_the_output_at_zero() -> None:
    bench, heard = _heard(LoopbackRig())
    assert heard.counts.shape == (500, 4)
    assert heard.violation is None
    assert heard.channels == bench.rig.channels
    assert not bench.rig.played.any()
    assert bench.states() == LISTENED
    assert sum(len(event.block) for event in bench.events if isinstance(event, Acquired)) == 500


def test_a_sensor_without_values_ends_the_listening_but_not_the_plan() -> None:
    bench, heard = _heard(_with(laser_1=lambda volts: np.full(volts.shape, np.nan)))
    assert heard.violation is not None
    assert "laser_1" in str(heard.violation)
    assert (heard.counts[:, 2] == -32768).all()
    assert bench.rig.halted
    assert not bench.rig.armed
    assert not any(isinstance(event, LimitExceeded) for event in bench.events)


def test_a_table_that_moves_without_drive_is_cut_at_once() -> None:
    bench, heard = _heard(_with(table_displacement=lambda volts: np.full(volts.shape, 0.07)))
    assert heard.violation is not None
    assert heard.violation.quantity == "table displacement"
    assert heard.counts.shape[0] == 100
    assert bench.rig.halted


def test_a_test_can_follow_what_was_heard() -> None:
    bench = Bench()
    assert bench.run(_plan(AcquireAtRest(0.2), *TEST)).status == "completed"
    assert [event.run for event in bench.events if isinstance(event, Acquired)][-1] == 2


@pytest.mark.parametrize("asked", ["stop", "abort", "halt"])
def test_an_end_that_is_asked_for_while_listening_is_heeded(asked: str) -> None:
    def listener(event: Event) -> None:
        if isinstance(event, Acquired):
            getattr(bench.requests, asked)()

    bench = Bench(subscriber=listener)
    ended = {"stop": "stopped", "abort": "aborted", "halt": "halted"}[asked]
    assert bench.run(_plan(AcquireAtRest(0.5))).status == ended
    assert not bench.rig.played.any()


def _aligned(bench: Bench) -> list[SensorsAligned]:
    return [event for event in bench.events if isinstance(event, SensorsAligned)]


def test_alignments_are_told_once_for_each_run_after_the_rig_was_disarmed() -> None:
    armed: list[bool] = []

    def listener(event: Event) -> None:
        if isinstance(event, SensorsAligned):
            armed.append(bench.rig.armed)

    bench = Bench(subscriber=listener)
    bench.rig.alignments = ALIGNED
    bench.run(_plan(*TEST, AcquireAtRest(0.2)))
    assert [event.run for event in _aligned(bench)] == [1, 2]
    assert _aligned(bench)[0].alignments == ALIGNED
    assert armed == [False, False]


def test_a_rig_without_clocks_of_its_own_tells_nothing() -> None:
    bench = Bench()
    bench.run(_plan(*TEST))
    assert _aligned(bench) == []


@pytest.mark.parametrize("asked", ["abort", "halt"])
def test_alignments_are_told_after_a_bad_end_too(asked: str) -> None:
    def listener(event: Event) -> None:
        if isinstance(event, Acquired) and event.block.first > 1000:
            getattr(bench.requests, asked)()

    bench = Bench(subscriber=listener)
    bench.rig.alignments = ALIGNED
    assert bench.run(_plan(*TEST)).status == {"abort": "aborted", "halt": "halted"}[asked]
    assert len(_aligned(bench)) == 1


class Forgetful(LoopbackRig):
    """Cannot say how its sensors were placed, and stops giving blocks after a while."""

    def __init__(self) -> None:
        self.dies = False
        super().__init__()

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        raise RigError("the lasers are gone")

    @alignments.setter
    def alignments(self, value: tuple[Alignment, ...]) -> None:
        del value

    def read(self, n: int) -> Block:
        if self.dies and self.played.size > 1000:
            raise RigError("the device was unplugged")
        return super().read(n)


def test_a_rig_that_cannot_tell_is_a_warning_and_no_end() -> None:
    bench = Bench(Forgetful())
    assert bench.run(_plan(*TEST)).status == "completed"
    assert [event.text for event in bench.events if isinstance(event, Warned)] == [
        "the alignment of the sensors' clocks in run 1 is unknown: the lasers are gone"
    ]


def test_what_ended_a_run_is_told_although_the_alignments_cannot_be() -> None:
    rig = Forgetful()
    rig.dies = True
    ending = Bench(rig).run(_plan(*TEST))
    assert (ending.status, ending.reason) == ("failed", "the device was unplugged")


def test_a_subscriber_that_fails_at_the_alignments_does_not_mask_a_halt() -> None:
    def listener(event: Event) -> None:
        if isinstance(event, Acquired) and event.block.first > 1000:
            bench.requests.halt()
        if isinstance(event, SensorsAligned):
            raise RockbenchError("the disk is full")

    bench = Bench(subscriber=listener)
    bench.rig.alignments = ALIGNED
    assert bench.run(_plan(*TEST)).status == "halted"
