"""The steps of a hold on scripted cycles: its latency, its release, and what is computed before it."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import replace
from itertools import repeat
from math import inf, nan, tau
from typing import Any

import numpy as np
import pytest

from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition
from bench.control.oscillator import DriveCalibration
from bench.control.sine import Sine
from bench.control.stabiliser import DELAY, Stabiliser, StabiliserDesign
from bench.engine.steps import Done, Dwell, Fallen, Measured, Outcome, Publish, Scheduled, SetHarmonics, Step
from bench.events import StepStarted
from protocols.common.sine import holding
from protocols.common.sine.holding import HoldCycle, hold, prepared, too_late
from protocols.common.sine.settling import Held, TableState
from protocols.harmonic.campaign import HarmonicCampaign
from protocols.harmonic.forecast import trials
from protocols.harmonic.protocol import HarmonicParameters, PointStatus
from sim.cycle_map import CycleMap
from sim.gain import predict_gain
from sim.specimen import Specimen
from sim.steady import Orbit
from tests.protocols.harmonic.scripted import AMPLITUDE, Script, cycle

pytestmark = pytest.mark.usefixtures("shared_results", "no_specimens")

OMEGA, BETA = 15.0, 0.97
PARAMETERS = HarmonicParameters(omega=(OMEGA,), beta=(BETA,), starts=1, settle_limit=30.0, measured_cycles=12)
DRIFT, LARGEST = 0.004, 0.005
SINE = Sine(OMEGA, AMPLITUDE, DriveCalibration.flat(AMPLITUDE))
TURN = SINE.turn(cycle(0, DRIFT))


def timed(block: float, lead: float) -> BenchConfiguration:
    return BenchConfiguration(acquisition=Acquisition(block_duration=block, lead=lead))


@pytest.fixture(scope="module")
def orbit() -> Orbit:
    found = predict_gain(Specimen().coupled(BETA), OMEGA, AMPLITUDE).rocking
    assert found is not None
    return found.orbit


@pytest.fixture(scope="module")
def design(orbit: Orbit) -> StabiliserDesign:
    found = prepared(orbit, None, PARAMETERS.harmonics)
    assert found is not None
    return found


def latest(configuration: BenchConfiguration, omega: float) -> int:
    """Largest number of samples by which a correction misses the beginning of its cycle, over many cycles."""
    rate, block = configuration.sample_rate, configuration.block_samples
    cycles = CycleAnalyser(omega, rate, 0)
    ends = np.array([cycles.start_of(n + 1) for n in range(500)])
    read = -(-ends // block) * block
    begins = np.array([cycles.start_of(n + DELAY) for n in range(500)])
    return int(np.max(read + configuration.lead_samples - begins))


@pytest.mark.parametrize("block", [0.005, 0.1, 0.2])
@pytest.mark.parametrize("lead", [0.01, 0.1, 0.3])
def test_a_motion_is_held_only_if_every_correction_begins_in_its_cycle(block: float, lead: float) -> None:
    configuration = timed(block, lead)
    limit = tau / (block + lead)
    assert too_late(configuration, 0.999 * limit) is None
    assert latest(configuration, 0.999 * limit) <= 0
    assert too_late(configuration, 1.07 * limit) is not None
    assert latest(configuration, 1.07 * limit) > 0


@pytest.mark.parametrize(("omega", "beta"), [(OMEGA, BETA), (16.0, 0.4)])
def test_a_point_that_cannot_be_held_states_latency_cycle_and_remedy(omega: float, beta: float) -> None:
    """Also where the orbit is stable, but the motion does not become steady."""
    parameters = PARAMETERS.model_copy(update={"omega": (omega,), "beta": (beta,)})
    campaign = HarmonicCampaign(parameters, timed(0.1, 0.4))
    script = Script(lambda _, k: cycle(k, DRIFT * (1.0 + 0.3 * np.sin(2.4 * k))), 0.05, campaign)
    (point,) = script.run()
    assert "could not be held on its orbit: acquisition.block_duration and acquisition.lead" in point.reason
    assert f"0.5 s, are longer than a cycle of {tau / omega:.3f} s" in point.reason
    assert "reduce them" in point.reason
    assert not [step for step in script.steps if isinstance(step, SetHarmonics) and step.cycle is not None]


@pytest.mark.parametrize("held", [False, True])
def test_without_a_hold_only_the_free_motion_is_measured(held: bool) -> None:
    parameters = PARAMETERS.model_copy(update={"hold": held})
    campaign = HarmonicCampaign(parameters, BenchConfiguration())
    script = Script(lambda _, k: cycle(k, DRIFT * (1.0 + 0.3 * np.sin(2.4 * k))), 0.05, campaign)
    (point,) = script.run()
    assert any(isinstance(step, SetHarmonics) and step.cycle is not None for step in script.steps) is held
    assert point.status is PointStatus.MODULATED
    assert point.control_share is None
    assert point.alpha_2 == point.alpha_2_greatest


@pytest.mark.parametrize(("lead", "authority"), [(0.1, PARAMETERS.hold_authority), (0.4, 0.0)])
def test_the_forecast_has_no_control_where_no_hold_is_possible(lead: float, authority: float) -> None:
    configuration = timed(0.1, lead)
    starts = HarmonicCampaign(PARAMETERS, configuration).starts
    found = [each for each in trials(PARAMETERS, configuration, None, starts) if each.beta == BETA]
    assert [each.control for each in found] == [authority]


@pytest.mark.parametrize("effect", [0.0, nan])
def test_without_a_stabilising_gain_there_is_no_hold(
    orbit: Orbit, monkeypatch: pytest.MonkeyPatch, effect: float
) -> None:
    """An unstable motion on which the control has no effect, and a map that could not be computed."""
    whole = holding.cycle_map

    def uncontrolled(*arguments: Any) -> CycleMap:
        found = whole(*arguments)
        return replace(found, inputs=(effect * found.inputs[0], effect * found.inputs[1]))

    monkeypatch.setattr(holding, "cycle_map", uncontrolled)
    assert prepared(orbit, None, PARAMETERS.harmonics) is None


def held_by(
    design: StabiliserDesign, peaks: Callable[[bool], Iterator[float]], late: float = 0.0
) -> tuple[Held, list[Step], list[HoldCycle]]:
    """Result of a hold, its steps and its cycles; `peaks` are those of the held or, if True, of the released motion.

    From the third cycle on the corrections are `late` [s].
    """

    def report(_: list[Cycle]) -> Generator[Step, Outcome, None]:
        yield from ()

    table = TableState(TURN, (1.0 + 0.0j,), 1.0 + 0.0j)
    stabiliser = Stabiliser(design, PARAMETERS.hold_authority)
    plan = hold(SINE, table, stabiliser, BETA, LARGEST, PARAMETERS, BenchConfiguration().analysis, report)
    steps, drifts = list[Step](), peaks(False)
    step = next(plan)
    try:
        while True:
            steps.append(step)
            answer: Outcome = Done()
            if isinstance(step, Publish) and isinstance(step.event, StepStarted):
                drifts = peaks(True)
            elif isinstance(step, Dwell):
                drift = next(drifts)
                answer = Fallen() if drift == inf else Measured((cycle(len(steps), drift),))
            elif isinstance(step, SetHarmonics) and step.cycle is not None:
                answer = Scheduled(late if step.cycle > DELAY + 1 else 0.0)
            step = plan.send(answer)
    except StopIteration as end:
        result = end.value
    assert isinstance(result, Held)
    events = [each.event for each in steps if isinstance(each, Publish)]
    return result, steps, [each for each in events if isinstance(each, HoldCycle)]


def test_a_released_motion_is_observed_up_to_the_first_drift_that_is_too_large(design: StabiliserDesign) -> None:
    def peaks(released: bool) -> Iterator[float]:
        yield from (DRIFT, DRIFT, 1.01 * LARGEST) if released else ()
        while True:
            yield DRIFT

    result, _, cycles = held_by(design, peaks)
    assert result.peak is not None
    assert result.rate is None
    assert cycles[-1].drift_peak == pytest.approx(1.01 * LARGEST)
    assert len(cycles) == result.cycles + 3


def test_a_fall_after_the_release_leaves_what_was_measured_before(design: StabiliserDesign) -> None:
    def peaks(released: bool) -> Iterator[float]:
        yield from (DRIFT, DRIFT, inf) if released else ()
        while True:
            yield DRIFT

    result, _, _ = held_by(design, peaks)
    assert result.peak is not None
    assert result.fallen
    assert result.rate is None


def test_an_estimate_that_is_not_finite_releases_the_hold(design: StabiliserDesign) -> None:
    def peaks(_: bool) -> Iterator[float]:
        yield from (DRIFT, DRIFT, nan)

    result, steps, cycles = held_by(design, peaks)
    assert result.peak is None
    assert result.reason == "the estimate of the deviation is not finite"
    assert len(cycles) == 3
    assert all(np.isfinite(step.shares).all() for step in steps if isinstance(step, SetHarmonics))
    assert isinstance(steps[-1], SetHarmonics)
    assert steps[-1].shares == (1.0 + 0.0j,)


def test_a_correction_that_comes_too_late_releases_the_hold(design: StabiliserDesign) -> None:
    """The lead of an open rig may be longer than the configured one, by the delays of its inputs."""
    result, steps, cycles = held_by(design, lambda _: repeat(DRIFT), late=0.012)
    assert result.peak is None
    assert "a correction came 12 ms too late for its cycle" in result.reason
    assert "acquisition.block_duration and acquisition.lead; reduce them" in result.reason
    assert len(cycles) == 3
    assert isinstance(steps[-1], SetHarmonics)
    assert (steps[-1].shares, steps[-1].cycle) == ((1.0 + 0.0j,), None)
