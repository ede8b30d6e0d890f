"""Steps of a stability test.

1. Bare frame: calibrate the drive. Mount the spring: calibrate again with the block at rest.
2. At each point: try the planned starts, control the amplitude, hold the motion on its orbit, deflect and release it.
3. Between adjacent points on either side of the boundary: bisect. The motion is started at the nearest planned point,
   swept to the middle of the interval, and measured as in step 2.
"""

from cmath import phase
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from json import dumps
from math import hypot, nan
from typing import Any

from bench.analysis.cycles import Cycle
from bench.analysis.gain import COVERAGE, steady_peak
from bench.config.model import BenchConfiguration
from bench.control.oscillator import DriveCalibration, Segment
from bench.control.sine import Sine
from bench.control.stabiliser import GROWTH, Stabiliser, StabiliserDesign
from bench.control.starts import Start
from bench.engine.steps import Arm, Calibrate, Fallen, Outcome, Publish, RampOut, Step, Sweep
from bench.events import PointFinished, StepStarted
from bench.live_values import Estimate
from protocols.common.sine.calibration import REST, bare_calibration, end_test, spring_calibration
from protocols.common.sine.holding import Hold, capture_and_measure, prepared
from protocols.common.sine.pace import Pace
from protocols.common.sine.settling import Held, Report, Settled, settle_and_measure
from protocols.stability.laws import LawPrediction, implied, law_prediction, predicted_columns
from protocols.stability.prediction import Predicted, close_pair, predicted
from protocols.stability.protocol import OrbitStatus, StabilityParameters, StabilityPoint
from protocols.stability.release import Released, combined, known_norm, parts_of, release
from sim.gain import Branch, nearest_branch, predict_gain

MOST_BISECTIONS = 12
"""Largest number of points added by the bisection."""

SWEEP_TIME = 8.0
"""Duration of the sweep from the end of a start to a point of the bisection [s]."""


@dataclass(frozen=True)
class Place:
    """A point of the test: `omega` [rad/s], and `factor`, the amplitude relative to the uplift acceleration."""

    omega: float
    factor: float

    def along(self, by_amplitude: bool) -> float:
        """Coordinate on the axis of the test: `factor` if the amplitude is varied, otherwise `omega` [rad/s]."""
        return self.factor if by_amplitude else self.omega


@dataclass(frozen=True)
class _Trial:
    """A motion to be held: its predicted branches and sine, the predicted multiplier, also under other laws of
    restitution, and the stabiliser.
    """

    branches: Mapping[str, Branch]
    sine: Sine
    predicted: Predicted
    under: LawPrediction
    design: StabiliserDesign


class StabilityPlan:
    """Steps of a stability test, and the points measured so far."""

    def __init__(
        self,
        parameters: StabilityParameters,
        configuration: BenchConfiguration,
        starts: Mapping[Place, Sequence[Start]],
    ) -> None:
        self._parameters, self._configuration, self._starts = parameters, configuration, starts
        self._specimen = configuration.known_specimen.coupled(parameters.beta)
        self._by_amplitude = len(parameters.amplitude_factor) > 1
        self._pace = Pace(tuple(place.omega for place in starts), 1)
        self.points: list[StabilityPoint] = []
        """Points finished so far, in the order of measurement."""

    def steps(self) -> Generator[Step, Outcome, Sequence[StabilityPoint]]:
        """Steps of the complete test; returns its points."""
        p, known = self._parameters, self._configuration.known_specimen
        lowest = min(place.factor for place in self._starts) * known.uplift_acceleration
        bare = yield from bare_calibration(p, p.omega, lowest, known.bare())
        yield RampOut()
        starts = [start for each in self._starts.values() for start in each]
        level = p.calibration_level * lowest
        calibration = yield from spring_calibration(self._specimen, p.omega, starts, level, bare)
        for place, planned in self._starts.items():
            point = yield from self._point(place, planned, calibration)
            yield from self._finished(point)
        yield from self._bisect(calibration)
        return self.points

    def _finished(self, point: StabilityPoint) -> Generator[Step, Outcome, None]:
        self.points.append(point)
        self._pace.finished(point.omega_rad_s)
        following = self._following()
        if following is not None:
            self._pace.add(following.omega)
        yield Publish(self._pace.progress(f"{_text(point.omega_rad_s, point.amplitude_factor)} finished"))
        yield Publish(PointFinished(point))

    def _bisect(self, calibration: DriveCalibration) -> Generator[Step, Outcome, None]:
        while (middle := self._following()) is not None:
            planned, others = self._nearest(middle)
            amplitude = middle.factor * self._specimen.uplift_acceleration
            starts = [
                replace(each, segments=(*each.segments, Segment(SWEEP_TIME, amplitude, middle.omega)))
                for each in others
            ]
            yield Publish(
                StepStarted(
                    f"bisection: {_text(middle.omega, middle.factor)}, from {_text(planned.omega, planned.factor)}"
                )
            )
            point = yield from self._point(middle, starts, calibration)
            yield from self._finished(point.model_copy(update={"bisected": True}))

    def _following(self) -> Place | None:
        """Next point of the bisection; None before all planned points are finished and after the last one."""
        bisected = self.points[len(self._starts) :]
        ended = len(bisected) == MOST_BISECTIONS or any(each.modulus is None for each in bisected)
        if not self._parameters.bisect or len(self.points) < len(self._starts) or ended:
            return None
        return self.next_middle()

    def next_middle(self) -> Place | None:
        """Middle of the widest bracket of a boundary; None if no bracket is wider than the parameter `bracket`."""
        known = sorted((each for each in self.points if each.modulus is not None), key=self._position)
        open_brackets = [
            (b - a, 0.5 * (a + b))
            for first, second in pairwise(known)
            for a, b in ((self._position(first), self._position(second)),)
            if ((first.modulus or 0.0) < 1.0) != ((second.modulus or 0.0) < 1.0)
            and b - a > self._parameters.bracket * 0.5 * (a + b)
        ]
        if not open_brackets:
            return None
        _, middle = max(open_brackets)
        p = self._parameters
        return Place(p.omega[0], middle) if self._by_amplitude else Place(middle, p.amplitude_factor[0])

    def _position(self, point: StabilityPoint) -> float:
        return point.amplitude_factor if self._by_amplitude else point.omega_rad_s

    def _nearest(self, place: Place) -> tuple[Place, Sequence[Start]]:
        by = self._by_amplitude
        return min(self._starts.items(), key=lambda each: abs(each[0].along(by) - place.along(by)))

    def _point(
        self, place: Place, starts: Sequence[Start], calibration: DriveCalibration
    ) -> Generator[Step, Outcome, StabilityPoint]:
        """Try the starts until one yields a multiplier; returns its point, otherwise the last point without a fall, or
        an overturned point after falls only.
        """
        p, configuration, specimen = self._parameters, self._configuration, self._specimen
        amplitude, shaker = place.factor * specimen.uplift_acceleration, configuration.simulated_shaker
        fields: dict[str, Any] = {"omega_rad_s": place.omega, "amplitude_factor": place.factor, "beta": p.beta}
        branches = predict_gain(specimen, place.omega, amplitude).branches
        orbit = branches["rocking"].orbit if "rocking" in branches else None
        design = prepared(orbit, shaker, p.harmonics)
        if orbit is None or design is None:
            reason = (
                "the model has no rocking orbit at this point"
                if orbit is None
                else "no stabiliser can be designed for the orbit"
            )
            return StabilityPoint(**fields, status=OrbitStatus.NOT_HELD, reason=reason)
        slowest = design.cycle_map.slowest
        if slowest.imag == 0.0:
            reason = (
                f"the dominant multiplier of the orbit on its table is real, {slowest.real:.4f}: only a pair of "
                "complex multipliers can be measured"
            )
            return StabilityPoint(**fields, status=OrbitStatus.NOT_MEASURABLE, reason=reason)
        # the model of the table contains the recoil, which otherwise counts as an uncertainty
        known = configuration.known_on_table if shaker is None else configuration.known
        found = predicted(orbit, known, shaker, p.harmonics)
        under = law_prediction(orbit, found.multiplier, known, shaker, p.harmonics, p.impulse_offset)
        by_law = {name: _or_none(value) for name, value in predicted_columns(under).items()}
        fields |= {**_predicted_fields(found), **by_law, "reason": close_pair(orbit)}
        sine = Sine(place.omega, amplitude, calibration)
        falls, last = 0, StabilityPoint(**fields, status=OrbitStatus.OVERTURNED)
        for tried, start in enumerate(starts, 1):
            where = f"{_text(place.omega, place.factor)}, start {tried} of {len(starts)}: {start.name}"
            yield Publish(StepStarted(f"{where}, chance {start.chance:.0%}"))
            yield Arm(REST)
            yield Calibrate(calibration)
            point, fallen = None, True
            if not isinstance((yield Sweep(start.segments)), Fallen):
                point, fallen = yield from self._held_point(_Trial(branches, sine, found, under, design), fields, where)
            yield from end_test(specimen, fast=fallen)
            if point is None:
                falls += 1
                continue
            last = point.model_copy(update={"starts_tried": tried})
            if point.status is OrbitStatus.MEASURED:
                return last
        if last.status is OrbitStatus.OVERTURNED:
            update = {"starts_tried": falls, "reason": f"the block fell after every start ({falls} tried)"}
            return last.model_copy(update=update)
        return last.model_copy(update={"starts_tried": len(starts)})

    def _held_point(
        self, trial: _Trial, fields: Mapping[str, Any], where: str
    ) -> Generator[Step, Outcome, tuple[StabilityPoint | None, bool]]:
        """Hold the motion, release it, and evaluate it. Returns the point, None if the block fell before the release,
        and whether it has fallen.
        """
        p, configuration, sine = self._parameters, self._configuration, trial.sine
        report = self._report(sine)
        settled = yield from settle_and_measure(sine, p, configuration.analysis, report)
        if isinstance(settled, Fallen) or settled.table is None:
            return None, True
        largest = self._largest(settled)
        yield Publish(StepStarted(f"{where}: holding the motion on its orbit"))
        stabiliser = Stabiliser(trial.design, p.hold_authority)
        run = Hold(sine, settled.table, stabiliser, largest, p, configuration.analysis)
        held = yield from capture_and_measure(run, p.beta, report)
        if isinstance(held, Fallen):
            return None, True
        if held.peak is None:
            values = {**fields, "captured_cycles": held.captured, "reason": held.reason}
            return StabilityPoint.model_validate({**values, "status": OrbitStatus.NOT_HELD}), False
        # the stabiliser takes any motion that repeats for the orbit, also that of the resting block
        if nearest_branch(trial.branches, held.peak.drift, held.peak.u1) != "rocking":
            reason = "the held motion is not on the rocking orbit, but nearer that of the resting block"
            values = {**fields, "captured_cycles": held.captured, "reason": reason}
            return StabilityPoint.model_validate({**values, "status": OrbitStatus.NOT_HELD}), False
        found = trial.design.cycle_map
        released = yield from release(run, found, settled.table, p.beta, largest, p.released_cycles, p.hold_authority)
        return self._measured(trial, held, released, fields), released.fallen

    def _largest(self, settled: Settled) -> float:
        """Largest drift allowed during hold and release [m]."""
        free = settled.peak.drift
        limits = self._configuration.limits
        return min(GROWTH * free, limits.warning.drift * limits.drift)

    def _measured(self, trial: _Trial, held: Held, released: Released, fields: Mapping[str, Any]) -> StabilityPoint:
        found, peak = released.multiplier, held.peak
        values = {
            **fields,
            "drift_peak_m": None if peak is None else peak.drift,
            "amplitude_m_s2": None if peak is None else peak.amplitude,
            "control_share": held.control,
            "captured_cycles": held.captured,
        }
        if found is None:
            reason = (
                f"no multiplier can be determined from the cycles after the release ({len(released.series)} measured)"
            )
            return StabilityPoint.model_validate({**values, "status": OrbitStatus.NOT_MEASURABLE, "reason": reason})
        scale = self._configuration.sensors.table_scale
        predicted = trial.predicted
        own = hypot(found.modulus_uncertainty, found.modulus_other, known_norm((predicted.slope,)) * scale)
        local = predicted.given(found.modulus, own)
        parts = parts_of(found, (local.slope, local.slope_spread), scale)
        turned = known_norm((local.turn, local.turn_spread)) * scale
        expanded, expected = COVERAGE * combined(parts), COVERAGE * predicted.uncertainty
        apart = abs(found.modulus - abs(predicted.multiplier))
        return StabilityPoint.model_validate(
            {
                **values,
                "status": OrbitStatus.MEASURED,
                "modulus": found.modulus,
                "modulus_uncertainty": expanded,
                "angle_rad": found.angle,
                "angle_uncertainty_rad": COVERAGE * hypot(found.angle_uncertainty, found.angle_other, turned),
                "agrees": apart <= hypot(expanded, expected) if expected == expected else None,
                **implied(trial.under, self._specimen.block.restitution_factor, found.modulus, expanded),
                "uncertainty_parts": dumps({name: float(f"{part:.4g}") for name, part in parts.items()}),
                "released_cycles": found.cycles,
                "pairs": found.pairs,
                "autocorrelation": found.autocorrelation,
                "residual_m": found.residual,
            }
        )

    def _report(self, sine: Sine) -> Report:
        """Callback that publishes the peak drift and the progress."""
        evaluated = 0

        def report(cycles: list[Cycle]) -> Generator[Step, Outcome, None]:
            nonlocal evaluated
            evaluated += len(cycles)
            drift = steady_peak(cycles, sine.omega).drift
            yield Publish(Estimate(sine.omega, self._parameters.beta, evaluated, drift, nan, nan, nan))
            yield Publish(self._pace.progress(f"measuring at {sine.omega:g} rad/s", sine.omega, evaluated))

        return report


def _predicted_fields(found: Predicted) -> dict[str, Any]:
    return {
        "modulus_predicted": abs(found.multiplier),
        "modulus_predicted_uncertainty": _or_none(COVERAGE * found.uncertainty),
        "angle_predicted_rad": abs(phase(found.multiplier)),
        "fixed_modulus": abs(found.fixed),
        "amplitude_slope": _or_none(found.slope),
    }


def _or_none(value: float) -> float | None:
    return value if value == value else None


def _text(omega: float, factor: float) -> str:
    return f"{omega:.4g} rad/s at {factor:.4g} times the uplift acceleration"
