"""Points of a stability test whose motion is not that of a measurable orbit, with scripted cycles."""

from collections.abc import Generator, Sequence

from bench.config.model import BenchConfiguration
from bench.control.oscillator import DriveCalibration, Segment
from bench.control.starts import Start
from bench.engine.steps import Arm, Done, Dwell, Measured, Outcome, Step
from protocols.stability.plan import Place, StabilityPlan
from protocols.stability.protocol import OrbitStatus, StabilityParameters, StabilityPoint
from sim.gain import predict_gain
from sim.specimen import Specimen
from tests.protocols.harmonic.scripted import cycle

FACTOR = 1.01
AMPLITUDE = FACTOR * Specimen().uplift_acceleration


class _OnePoint(StabilityPlan):
    """The steps of a single point, without the calibration before it."""

    def steps(self) -> Generator[Step, Outcome, Sequence[StabilityPoint]]:
        ((place, starts),) = self._starts.items()
        return [(yield from self._point(place, starts, DriveCalibration.flat(1.0 + 0.0j)))]


def measured(
    omega: float, beta: float, drift: float, u1: float, configuration: BenchConfiguration | None = None
) -> tuple[StabilityPoint, list[Step]]:
    """The point of two starts after which every cycle has the given peaks [m], and its steps."""
    starts = [Start(name, (Segment(8.0, AMPLITUDE, omega),), 0.5) for name in ("one", "two")]
    parameters = StabilityParameters(omega=(omega,), beta=beta, bisect=False)
    plan = _OnePoint(parameters, configuration or BenchConfiguration(), {Place(omega, FACTOR): starts}).steps()
    taken, cycles = list[Step](), 0
    outcome: Outcome | None = None
    while True:
        try:
            step = next(plan) if outcome is None else plan.send(outcome)
        except StopIteration as end:
            (point,) = end.value
            return point, taken
        taken.append(step)
        made = [cycle(cycles + k, drift, u1) for k in range(step.cycles)] if isinstance(step, Dwell) else []
        cycles += len(made)
        outcome = Measured(tuple(made)) if isinstance(step, Dwell) else Done()


def test_the_motion_of_a_resting_block_is_not_measured_as_the_rocking_orbit() -> None:
    branches = predict_gain(Specimen().coupled(0.25), 20.0, AMPLITUDE).branches
    peaks = branches["resting"].orbit.peaks
    point, steps = measured(20.0, 0.25, peaks.drift, peaks.u1)
    assert point.status is OrbitStatus.NOT_HELD
    assert "resting block" in point.reason
    assert point.modulus is None
    assert point.starts_tried == 2
    assert sum(isinstance(each, Arm) for each in steps) == 2
    rocking = branches["rocking"].orbit.peaks
    point, _ = measured(20.0, 0.25, rocking.drift, rocking.u1)
    assert "resting block" not in point.reason


def test_a_real_dominant_multiplier_is_told_before_anything_moves() -> None:
    # the slow return of a table on soft springs to its middle
    soft = BenchConfiguration.model_validate({"simulation": {"bench": {"shaker": {"k_s": 100.0}}}})
    point, steps = measured(15.6, 0.97, 0.01, 0.01, soft)
    assert point.status is OrbitStatus.NOT_MEASURABLE
    assert point.reason.startswith("the dominant multiplier of the orbit on its table is real, 0.987")
    assert steps == []
