"""The live twin on a virtual bench: what it says of the specimen, when it says it, and what it never does to a test."""

import subprocess
import sys
import threading
from dataclasses import replace
from itertools import pairwise
from unittest.mock import Mock

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.config.sections import Twin
from bench.datafile.reader import open_datafile
from bench.engine.steps import OperatorAction, Plan
from bench.events import Acquired, Event, SpecimenMounted, State, StateChanged
from bench.live_values import RunningGain, TwinEstimate
from bench.replay.session import replay
from bench.twin.ensemble import draw_members
from bench.twin.estimator import Estimator, Setting
from bench.twin.twin import Applicability
from drivers.clock import VirtualClock
from drivers.rig import OperatorTask
from drivers.simulated import SimulatedRig
from sim.excitation import SampledRecord
from sim.rocking import simulate
from sim.specimen import Frame, Specimen
from tests.bench.twin.twin_bench import COUPLED, MOUNT, RATE, REMOVE, Beside, configuration, shaken
from tests.patience import LONG
from tests.recorded import recorded

Array = NDArray[np.float64]

SENSORS = SensorUncertainty(SensorAccuracy(laser_linearity=5e-4), (0.2, 0.2))
STAND_UP = OperatorAction(OperatorTask.STAND_BLOCK_UP, COUPLED, "stand the block up")


def off(**factors: float) -> Specimen:
    """The specimen with values of its frame times the factors."""
    frame = Frame()
    return Specimen(frame=Frame(**{name: getattr(frame, name) * by for name, by in factors.items()}))


def trace(estimates: list[TwinEstimate]) -> Array:
    return np.concatenate([estimate.trace for estimate in estimates])


@pytest.mark.parametrize(("handle", "volts", "allowed"), [(REMOVE, 1.0, 0.03), (MOUNT, 2.5, 0.015)])
def test_it_moves_as_the_solver_does_under_the_real_motion_of_the_table(
    handle: OperatorAction, volts: float, allowed: float
) -> None:
    bench = Beside(configuration(members=0))
    bench.run(shaken(3.0, volts, handle=handle))
    truth = np.concatenate(bench.truth)
    moments = np.arange(len(truth)) / RATE
    real = simulate(handle.specimen, SampledRecord(truth[:, 0], 1.0 / RATE), sample_times=moments[:-1]).samples
    assert real is not None
    came = trace(bench.estimates)
    # the real acceleration is that halfway from the tick before; a sample has gone through filter card and laser
    moments -= 0.5 / RATE
    parameters = bench.configuration.simulation.bench
    seen = came[:, 0] - parameters.filter_unit.delay(RATE) - 2.5 / parameters.laser_1.rate
    rocked = float(np.abs(real[:, 4]).max())
    assert (rocked > 0.01) == (handle is MOUNT)
    for column, of in ((1, 0), (2, 1), (3, 4))[: 3 if handle is MOUNT else 2]:
        expected = np.interp(seen, moments[:-1], real[:, of])
        largest = np.abs(real[:, :2] if of < 2 else expected).max()
        assert np.abs(came[:, column] - expected).max() <= allowed * largest
    assert np.diff(came[:, 0]) == pytest.approx(0.01)


def test_measured_values_are_those_of_the_same_moment() -> None:
    """The lasers are 0.6 ms behind the table's sensors: uncorrected they would be 1 % off."""
    bench, omega = Beside(configuration(members=0)), 16.3
    bench.run(shaken(8.0, 1.0, omega, REMOVE))
    late = [estimate for estimate in bench.estimates if estimate.seconds > 4.0]
    phase = omega * np.array([estimate.seconds for estimate in late])
    waves = np.column_stack((np.cos(phase), np.sin(phase), np.ones(len(late))))
    for name in ("u1", "u2", "drift"):
        measured, model = (
            complex(*np.linalg.lstsq(waves, np.array([getattr(one, f"{name}{end}") for one in late]))[0][:2])
            for end in ("_measured", "")
        )
        assert abs(measured) == pytest.approx(abs(model), rel=0.015)
        assert np.angle(measured / model) / omega == pytest.approx(0.0, abs=1.5e-4)
    assert late[-1].residual < 0.005


def test_the_band_holds_a_specimen_within_what_is_left_open_of_it() -> None:
    truth = off(k1=1.04, k2=0.97, xi1=1.2, xi2=0.8)
    for plan in (shaken(6.0, 1.0, 16.3, REMOVE), shaken(6.0, 1.3)):
        bench = Beside(configuration(truth))
        bench.run(plan)
        held = [one.drift_low <= one.drift_measured <= one.drift_high for one in bench.estimates]
        assert np.mean(held) > 0.95
        residuals = [one.residual for one in bench.estimates if np.isfinite(one.residual)]
        # the nominal model is far off
        assert max(residuals) > 0.2
        assert bench.warnings == []


def test_how_the_samples_are_cut_into_blocks_changes_no_motion() -> None:
    bench = Beside(configuration(enabled=False))
    bench.run(shaken(3.0))
    signals = np.concatenate([event.signals for event in bench.events if isinstance(event, Acquired)])
    setting = Setting(RATE, True, (1e-4, 6e-4), SENSORS)
    ends: list[TwinEstimate] = []
    traces: list[Array] = []
    for size in (7, 37, 500):
        estimator = Estimator(1, setting, draw_members(COUPLED, configuration(members=3)))
        blocks = [signals[first : first + size] for first in range(0, len(signals), size)]
        ends_at = np.cumsum([len(block) for block in blocks]).tolist()
        taken = [estimator.take(0.0, end, block, None) for end, block in zip(ends_at, blocks, strict=True)]
        came = [one for one in taken if one is not None]
        traces.append(trace(came))
        ends.append(came[-1])
    for other, end in zip(traces[1:], ends[1:], strict=True):
        assert np.array_equal(other[:, 1:], traces[0][:, 1:], equal_nan=True)
        assert other[:, 0] == pytest.approx(traces[0][:, 0], abs=1e-9)
        for name in (
            "u1",
            "u2",
            "drift",
            "drift_low",
            "drift_high",
            "drift_measured",
            "drift_peak",
            "theta",
            "standing",
        ):
            assert getattr(end, name) == getattr(ends[0], name)
    assert np.abs(traces[0][:, 3]).max() > 0.01


def test_a_specimen_that_is_another_warns_once_and_where_a_limit_says_so_ends_the_run() -> None:
    truth = off(k1=1.5)
    bench = Beside(configuration(truth))
    twice = (shaken(6.0, 1.0, 16.3, REMOVE) for _ in range(2))
    assert bench.run(*twice).status == "completed"
    (warning,) = bench.warnings
    assert warning.startswith("drift outside the twin's band: rms over 1 s")
    assert warning.endswith("limit 0.15: check which specimen is mounted")

    bench = Beside(configuration(truth, residual_warn=None, residual_stop=0.2, persistence=1.0))
    ending = bench.run(shaken(6.0, 1.0, 16.3, REMOVE))
    assert ending.status == "stopped"
    assert ending.reason.startswith("drift outside the twin's band")
    assert ending.reason.endswith("limit 0.2")
    assert bench.warnings == []
    over = [one for one in bench.estimates if one.excess > 0.2]
    asked = next(event for event in bench.events if isinstance(event, StateChanged) and event.after is State.STOPPING)
    first = next(one.time for one in over)
    assert asked.time == pytest.approx(first + 1.1, abs=0.15)


def test_a_fallen_block_is_told_and_the_next_test_begins_anew() -> None:
    bench = Beside(configuration())
    bench.run(shaken(6.0, 3.0, 14.0), shaken(3.0, 0.5, handle=STAND_UP))
    first = [one for one in bench.estimates if one.run == 1]
    second = [one for one in bench.estimates if one.run == 2]
    assert first[0].standing == 1.0
    assert first[-1].standing == 0.0
    assert np.isnan([first[-1].theta, first[-1].drift, first[-1].drift_low, first[-1].excess]).all()
    assert np.isfinite(first[-1].drift_measured)
    assert [one.standing for one in second] == [1.0] * len(second)
    assert second[-1].drift_peak < 0.5 * first[-1].drift_peak_measured
    assert bench.warnings == []


def test_a_patient_twin_says_the_same_every_time_and_an_estimate_for_every_block_but_the_last() -> None:
    said = []
    for _ in range(2):
        bench = Beside(configuration(members=2))
        bench.run(shaken(2.0))
        said.append([replace(one, trace=np.zeros(0)) for one in bench.estimates])
        running = next(
            k for k, each in enumerate(bench.events) if isinstance(each, StateChanged) and each.after is State.RUNNING
        )
        blocks = [event for event in bench.events[running:] if isinstance(event, Acquired)]
        assert [one.time for one in bench.estimates] == [event.time for event in blocks[:-1]]
    assert [str(one) for one in said[0]] == [str(one) for one in said[1]]


def test_the_bench_never_waits_for_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    go_on = threading.Event()
    take = Estimator.take

    def blocked(self: Estimator, *arguments: object) -> TwinEstimate | None:
        go_on.wait(LONG)
        return take(self, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Estimator, "take", blocked)
    bench = Beside(configuration(members=2), patient=False)
    ending = bench.run(shaken(4.0))
    go_on.set()
    assert ending.status == "completed"
    assert bench.estimates == []
    (warning,) = bench.warnings
    assert "did not keep up" in warning


def test_a_model_that_is_late_gives_up_members_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Released now and then: what waits is done then, with ever fewer members."""
    turn = threading.Semaphore(0)
    take = Estimator.take

    def paced(self: Estimator, *arguments: object) -> TwinEstimate | None:
        turn.acquire(timeout=LONG)
        return take(self, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Estimator, "take", paced)
    bench = Beside(configuration(members=8, residual_warn=None), patient=False)
    seen = 0

    def release(event: Event) -> None:
        nonlocal seen
        seen += isinstance(event, Acquired)
        if isinstance(event, Acquired) and seen % 4 == 0:
            for _ in range(4):
                turn.release()
            threading.Event().wait(0.05)

    bench.listeners.append(release)
    bench.run(shaken(3.0))
    for _ in range(100):
        turn.release()
    members = [one.members for one in bench.estimates]
    assert members[0] == 8
    assert members[-1] < 8
    assert all(later <= earlier for earlier, later in pairwise(members))
    assert bench.warnings == []


def test_an_error_in_the_model_is_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Estimator, "take", Mock(side_effect=ArithmeticError("the model broke")))
    bench = Beside(configuration(members=2))
    assert bench.run(shaken(2.0)).status == "completed"
    assert bench.warnings == ["the twin is off until the rig is armed again: the model broke"]


def test_a_recording_is_replayed_with_the_same_twin(tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("twin") / "campaign.h5"
    bench = configuration(off(k1=1.5), members=3, residual_warn=None, residual_stop=0.2)

    class Shaken:
        def check(self, configuration: object) -> None:
            pass

        def plan(self, configuration: object) -> Plan:  # noqa: ARG002
            return shaken(6.0, 1.0, 16.3, REMOVE)

    simulation = bench.simulation
    assert simulation.specimen is not None
    with SimulatedRig(simulation.bench, simulation.specimen, seed=1, lead=bench.lead_samples) as rig:
        ending = recorded(path, Shaken().plan(bench), rig, bench, Twin)
    assert ending.status == "stopped"
    with open_datafile(path) as record:
        rows = len(record.columns_of(TwinEstimate)["drift"])
        played = replay(record, Shaken().plan(bench), bench, clock=VirtualClock(), subscribers=[])
        assert record.columns_of(TwinEstimate)["excess"][-1] > 0.2
        mounted = next(event.text for event in record.events if event.kind == SpecimenMounted.__name__)
    assert rows > 30
    assert mounted == "remove block: bare frame"
    assert played.identical, played.found.differences
    assert played.found.compared["twin"] == rows


def test_alpha_2_comes_with_the_measured_one_and_goes_with_the_test() -> None:
    """Under a record: over the peak drift of the bare frame under the same motion of the table."""
    bench = Beside(configuration(members=3))
    bench.run(shaken(4.0, 2.5, stated=RunningGain("a sine", 0.25, 0.0, 0.01, 0.42, 0.4, time=0.0)))
    truth = np.concatenate(bench.truth)
    peaks = [
        simulate(specimen, SampledRecord(truth[:, 0], 1.0 / RATE)).peaks.drift for specimen in (COUPLED, COUPLED.bare())
    ]
    known = [one for one in bench.estimates if np.isfinite(one.alpha_2)]
    assert known[-1].alpha_2 == pytest.approx(peaks[0] / peaks[1], rel=0.03)
    assert known[-1].alpha_2_low <= known[-1].alpha_2 <= known[-1].alpha_2_high
    assert {one.alpha_2_measured for one in known} == {0.42}
    stopping = next(
        event for event in bench.events if isinstance(event, StateChanged) and event.after is State.STOPPING
    )
    assert known[-1].time <= stopping.time
    assert bench.estimates[-1].time > stopping.time


@pytest.mark.parametrize(
    ("works", "describes"),
    [
        ((OperatorTask.MOUNT_SPRING,), True),
        ((OperatorTask.REMOVE_BLOCK, OperatorTask.LOCK_FRAME), False),
        ((OperatorTask.LOCK_FRAME, OperatorTask.UNLOCK_FRAME), True),
        ((OperatorTask.LOCK_TABLE, OperatorTask.PULL_FRAME), False),
        ((OperatorTask.PULL_FRAME, OperatorTask.UNLOCK_TABLE), False),
        ((OperatorTask.LOCK_TABLE, OperatorTask.UNLOCK_TABLE, OperatorTask.REMOVE_BLOCK), True),
        ((OperatorTask.HOLD_BLOCK,), False),
        ((OperatorTask.HOLD_BLOCK, OperatorTask.MOUNT_SPRING), True),
        ((OperatorTask.WATCH_BLOCK, OperatorTask.TILT_BLOCK, OperatorTask.REMOVE_BLOCK), False),
        (
            (OperatorTask.WATCH_BLOCK, OperatorTask.TILT_BLOCK, OperatorTask.WATCH_STOREYS, OperatorTask.MOUNT_SPRING),
            True,
        ),
    ],
)
def test_it_is_silent_where_it_does_not_describe_what_stands_there(
    works: tuple[OperatorTask, ...], describes: bool
) -> None:
    standing = Applicability()
    assert standing.specimen is None
    for work in works:
        standing.follow(SpecimenMounted(COUPLED, work, time=0.0))
    assert (standing.specimen is not None) == describes
    assert (standing.why_not == "") == describes


def test_disabled_it_is_not_there() -> None:
    bench = Beside(configuration(enabled=False))
    bench.run(shaken(1.0))
    assert bench.estimates == []
    code = "import sys, bench.app.session, bench.replay.session; print('bench.twin.twin' in sys.modules)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "False"
