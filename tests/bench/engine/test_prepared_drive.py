"""A prepared drive: played to the sample, watched in order, ended by anybody, refused before it can go wrong."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bench.control.oscillator import DriveCalibration, Segment
from bench.engine.interface import Ending
from bench.engine.steps import (
    Arm,
    Calibrate,
    Done,
    Fallen,
    OperatorAction,
    Outcome,
    Play,
    Played,
    RampOut,
    Step,
    Sweep,
)
from bench.events import Acquired, Event, LimitExceeded, Progress, State, StateChanged
from bench.guard.limits import Limits
from bench.testing.loopback import COUNTS_PER_UNIT, LoopbackBench, LoopbackRig
from drivers.rig import OperatorTask, Rig
from drivers.simulated import SimulatedRig
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters

Array = NDArray[np.float64]

RATE = 1000.0

LIMITS = Limits(velocity=50.0)
"""The loopback's table moves in steps of a millimetre, which look fast."""


def rig_that(lead: int = 100, **response: Callable[[Array], Array]) -> LoopbackRig:
    """Its table accelerates by 1 m/s2 per volt unless `response` says otherwise."""
    rig = LoopbackRig(lead=lead)
    # more than a count, so that nothing looks stuck
    rig.response |= {"laser_1": lambda volts: 0.01 * volts, "laser_2": lambda volts: 0.02 * volts, **response}
    return rig


def burst(n: int = 1537, peak: float = 0.8) -> Array:
    """A chirp that swells and fades: no two samples that follow each other are alike."""
    t = np.arange(n) / RATE
    volts = peak * np.sin(np.pi * t / t[-1]) ** 2 * np.sin(2.0 * np.pi * (2.0 + 2.0 * t) * t)
    volts[[0, -1]] = 0.0
    return volts


class Bench(LoopbackBench):
    def __init__(self, rig: Rig, block: int = 100, listener: Callable[[Event], None] | None = None) -> None:
        super().__init__(rig, listener, LIMITS, block)

    def run(self, *steps: Step) -> tuple[Ending, list[Outcome]]:
        self.outcomes = []
        return self.run_steps(*steps), self.outcomes


def played(outcomes: list[Outcome]) -> list[Played]:
    return [outcome for outcome in outcomes if isinstance(outcome, Played)]


@pytest.mark.parametrize("lead", [0, 1, 100, 260])
@pytest.mark.parametrize("block", [1, 64, 100, 2000])
def test_row_i_is_what_sample_i_did_whatever_block_and_lead(block: int, lead: int) -> None:
    # blocks of one sample are many
    rig, volts = rig_that(lead), burst(151 if block == 1 else 1537)
    watched: list[Array] = []
    ending, outcomes = Bench(rig, block).run(Arm(0.2), Play(volts, watched.append), Play(-volts), RampOut())
    assert ending.status == "completed"
    first, second = played(outcomes)
    np.testing.assert_array_equal(first.drive, volts)
    assert np.abs(first.signals[:, 0] - volts).max() <= 0.5 / COUNTS_PER_UNIT + 1e-12
    assert np.abs(second.signals[:, 0] + volts).max() <= 0.5 / COUNTS_PER_UNIT + 1e-12
    assert first.signals.shape == (volts.size, 6)
    np.testing.assert_array_equal(np.concatenate(watched), first.signals)
    assert max(map(len, watched)) <= block
    # nothing but the two drives went out
    assert np.flatnonzero(rig.played).size == 2 * np.flatnonzero(volts).size


def test_the_virtual_bench_moves_as_it_does_without_an_engine_whatever_the_block() -> None:
    """The same bench, seed and drive, given to the plant in one piece: not a count differs."""
    parameters, volts = VirtualBenchParameters(sample_rate=2000.0), burst(3001, 1.0)
    found: list[Array] = []
    for block in (100, 128):
        rig = SimulatedRig(parameters, Specimen(), seed=3, lead=50)
        _, outcomes = Bench(rig, block).run(Arm(1.28), Play(volts), RampOut())
        found.append(played(outcomes)[0].signals)
    plant = VirtualBench(parameters, Specimen(), 3)
    # what the rig lets pass before it counts samples, the rest, and the lead
    plant.run(np.zeros(round(0.5 * 2000.0)))
    silence = round(1.28 * 2000.0)
    counts = plant.run(np.concatenate((np.zeros(silence + 50), volts)))
    names = [channel.name for channel in plant.channels]
    at = names.index("table_acceleration")
    values = plant.channels[at].to_unit(counts[:, at])
    expected = values[silence + 50 :] - values[:silence].mean()
    np.testing.assert_allclose(found[1][:, 0], expected, rtol=0.0, atol=1e-12)
    # a rest of 1.28 s is 26 blocks of 100, a little longer than 20 of 128: other noise, the same motion
    assert np.std(found[0][:, 0] - found[1][:, 0]) < 0.02 * np.std(expected)


def test_what_the_watch_returns_is_published_in_order_and_on_time() -> None:
    seen = 0

    def watch(signals: Array) -> Event | None:
        nonlocal seen
        seen += len(signals)
        return Progress(seen / 1537, 0.0, "playing") if seen > 800 else None

    bench = Bench(rig_that())
    bench.run(Arm(0.2), Play(burst(), watch), RampOut())
    told = [event for event in bench.events if isinstance(event, Progress)]
    assert [event.fraction for event in told] == sorted(event.fraction for event in told)
    assert told[-1].fraction == 1.0
    assert 0.0 < told[0].time < told[-1].time == pytest.approx(0.2 + 0.1 + 1.6)


@pytest.mark.parametrize(
    ("volts", "says"),
    [
        (np.zeros((3, 2)), "one-dimensional"),
        (np.zeros(0), "one-dimensional"),
        (np.array([0.0, np.nan, 0.0]), "sample 1"),
        (np.array([0.0, np.inf, 0.0]), "finite"),
        (np.array([0.1, 0.2, 0.0]), "begin and end at 0 V"),
        (np.array([0.0, 0.2, 0.1]), "begin and end at 0 V"),
        (np.array([0.0, 10.1, 0.0]), "drive range"),
        (11.0 * np.sin(np.linspace(0.0, np.pi, 900)) * np.r_[np.ones(899), 0.0], "drive range"),
        (9.0 * np.sin(np.linspace(0.0, np.pi, 900)) * np.r_[np.ones(899), 0.0], "drive command at sample"),
        (np.array([0.0, 0.5, 0.0]), "drive slew at sample 1"),
    ],
)
def test_what_cannot_be_played_is_refused_before_a_sample_of_it_moves(volts: Array, says: str) -> None:
    rig = rig_that()
    ending, _ = Bench(rig).run(Arm(0.2), Play(volts), RampOut())
    assert ending.status == "failed"
    assert "is refused" in ending.reason
    assert says in ending.reason
    assert not rig.played.any()
    assert not rig.halted


def test_a_play_on_a_sine_or_on_a_bench_at_rest_is_refused() -> None:
    sine = (Calibrate(DriveCalibration.flat(1.0)), Sweep((Segment(0.5, 0.5, 16.0),)))
    ending, _ = Bench(rig_that()).run(Arm(0.2), *sine, Play(burst()))
    assert "ramp the sine to zero" in ending.reason
    silent = Sweep((Segment(0.5, 0.0, 16.0),))
    assert Bench(rig_that()).run(Arm(0.2), *sine, silent, Play(burst()), RampOut())[0].status == "completed"
    ending, _ = Bench(rig_that()).run(Play(burst()))
    assert ending.status == "failed"
    assert "arm the bench first" in ending.reason


@pytest.mark.parametrize(("way", "status"), [("stop", "stopped"), ("abort", "aborted"), ("halt", "halted")])
@pytest.mark.parametrize("after", [3, 9, 17])
def test_a_person_ends_a_play_anywhere(way: str, status: str, after: int) -> None:
    blocks = 0

    def listener(event: Event) -> None:
        nonlocal blocks
        blocks += isinstance(event, Acquired)
        if isinstance(event, Acquired) and blocks == after:
            getattr(bench.requests, way)()

    rig, volts = rig_that(), burst()
    bench = Bench(rig, listener=listener)
    ending, outcomes = bench.run(Arm(0.2), Play(volts), RampOut())
    assert ending.status == status
    assert not played(outcomes)
    assert rig.halted is (way == "halt")
    drive = np.concatenate([event.drive for event in bench.events if isinstance(event, Acquired)])
    if way != "halt":
        # the drive goes on under the ramp: half a cosine over its length, from the block after the request
        length = {"stop": 1000, "abort": 200}[way]
        asked = np.concatenate((np.zeros(300), volts, np.zeros(drive.size)))[: drive.size]
        x = np.clip((np.arange(drive.size) + 1 - 100 * (after + 1)) / length, 0.0, 1.0)
        faded = asked * np.where(x < 1.0, 0.5 * (1.0 + np.cos(np.pi * x)), 0.0)
        np.testing.assert_allclose(drive, faded, rtol=0.0, atol=1e-12)
        assert drive[-1] == 0.0


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 30), st.sampled_from(["stop", "abort", "halt"]), st.sampled_from([30, 100, 333]))
def test_any_cut_of_plays_leaves_the_rig_stopped_and_within_limits(after: int, way: str, block: int) -> None:
    blocks = 0

    def listener(event: Event) -> None:
        nonlocal blocks
        blocks += isinstance(event, Acquired)
        if blocks == after:
            getattr(bench.requests, way)()

    rig = rig_that()
    bench = Bench(rig, block, listener)
    bench.run(Arm(0.2), Play(burst(800)), RampOut(), Arm(0.2), Play(burst(400)))
    assert not rig.armed
    assert np.abs(np.diff(rig.played, prepend=0.0)).max(initial=0.0) <= LIMITS.drive_slew / RATE + 1e-12
    assert way == "halt" or rig.played.size == 0 or rig.played[-1] == 0.0


def test_a_limit_that_is_exceeded_ends_a_play() -> None:
    rig = rig_that(table_acceleration=lambda volts: 10.0 * volts)
    bench = Bench(rig)
    ending, _ = bench.run(Arm(0.2), Play(burst()), RampOut())
    assert ending.status == "aborted"
    assert sum(isinstance(event, LimitExceeded) for event in bench.events) == 1
    assert rig.played[-1] == 0.0


class _Falls(LoopbackRig):
    """The block falls when so many samples have been played."""

    at = 900

    def __init__(self) -> None:
        super().__init__()
        self.response["laser_1"] = lambda volts: 0.01 * volts + 0.03 * (self.played.size >= self.at)


def test_a_fall_comes_with_the_signals_so_far_and_the_drive_goes_on_until_it_is_ramped_out() -> None:
    coupled, volts, rig = Specimen().coupled(0.4), burst(3001), _Falls()
    bench, shown = Bench(rig), list[Array]()
    mount = OperatorAction(OperatorTask.MOUNT_SPRING, coupled, "mount the spring")
    again = OperatorAction(OperatorTask.STAND_BLOCK_UP, coupled, "stand it up")
    steps = (mount, Arm(0.2), Play(volts, shown.append), RampOut(fast=True), again)
    ending, outcomes = bench.run(*steps)
    assert ending.status == "completed"
    fallen = outcomes[2]
    assert isinstance(fallen, Fallen)
    assert fallen.signals is not None
    n = len(fallen.signals)
    assert 600 < n < volts.size
    assert np.abs(fallen.signals[:, 0] - volts[:n]).max() <= 0.5 / COUNTS_PER_UNIT + 1e-12
    np.testing.assert_array_equal(np.concatenate(shown), fallen.signals)
    assert State.ABORTING in [event.after for event in bench.events if isinstance(event, StateChanged)]
    # two samples wait in the rig for each one read: the ramp begins after them, on the running drive
    assert rig.played[300 + n : 300 + n + 100] == pytest.approx(volts[n : n + 100])
    assert rig.played[-1] == 0.0


@pytest.mark.parametrize("then", [Play(burst()), Sweep((Segment(1.0, 0.5, 16.0),))])
def test_nothing_else_is_driven_after_a_fall_before_the_ramp(then: Step) -> None:
    mount = OperatorAction(OperatorTask.MOUNT_SPRING, Specimen().coupled(0.4), "mount the spring")
    bench = Bench(_Falls())
    ending, outcomes = bench.run(mount, Arm(0.2), Calibrate(DriveCalibration.flat(1.0)), Play(burst(3001)), then)
    assert isinstance(outcomes[-1], Fallen)
    assert ending.status == "failed"
    assert "ramp the prepared drive out first" in ending.reason
    assert State.ABORTING in [event.after for event in bench.events if isinstance(event, StateChanged)]


def test_samples_that_a_sensor_did_not_give_are_nan() -> None:
    def laser(volts: Array) -> Array:
        return np.where(np.abs(volts) > 0.7, np.nan, 0.02 * volts)

    volts = burst()
    _, outcomes = Bench(rig_that(laser_2=laser)).run(Arm(0.2), Play(volts), RampOut())
    (first,) = played(outcomes)
    np.testing.assert_array_equal(np.isnan(first.signals[:, 3]), np.abs(volts) > 0.7)
    assert isinstance(outcomes[-1], Done)
