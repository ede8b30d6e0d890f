"""Comparison of a measured dwell with the prediction."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import hypot, log
from typing import Any

from bench.analysis.free_motion import FreeMotion, Rate
from bench.analysis.gain import Gain, SteadyPeak, gain, without_rounding
from bench.analysis.linearity import LinearFrame
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.steady_correction import corrected, without_errors
from bench.analysis.uncertainty import plus_minus
from bench.analysis.unsteady_correction import revealed
from bench.config.model import BenchConfiguration
from bench.prediction.bands import expanded_uncertainty
from protocols.common.sine.settling import Held, Settled, linear_frame
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, PointStatus
from sim.gain import Branch, nearest_branch, predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import NoOrbit
from sim.table_orbit import table_orbit

_ROCKING = "rocking"

AMPLITUDE_NOTE = 0.002
"""Relative error of the table's amplitude above which a remark is added; the prediction is always for the achieved
amplitude.
"""

AMPLITUDE_STEP = 0.002
"""Relative change of the amplitude in the finite difference for the sensitivity."""

HARMONICS_NOTE = 0.01
"""Total harmonic distortion of the table above which a remark is added; the prediction is for a pure sine."""

DIFFERS = "the difference from the prediction exceeds the combined uncertainty"


@dataclass(frozen=True)
class Conditions:
    """Conditions of a test at `omega` [rad/s], and the model and reference with which its result is compared.

    `reference` is the bare frame's dwell at the same frequency, `known` the uncertainty of the `specimen`. Stability on
    the table is predicted with the model `shaker`, if there is one; `harmonics` is the number of harmonics of the
    table's motion that are controlled. Errors of the lasers are found according to the model of the bare `frame`, in an
    unsteady motion with residuals that may be correlated for `block` seconds; neither without a frame, nor if `block`
    is zero.
    """

    omega: float
    specimen: Specimen
    known: SpecimenKnowledge
    reference: Settled
    sensors: SensorUncertainty
    shaker: Shaker | None = None
    harmonics: int = 1
    frame: LinearFrame | None = None
    block: float = 0.0

    @classmethod
    def of(
        cls,
        omega: float,
        specimen: Specimen,
        reference: Settled,
        sensors: SensorUncertainty,
        configuration: BenchConfiguration,
        parameters: HarmonicParameters,
    ) -> "Conditions":
        """Conditions on the bench of `configuration`, with the `parameters` of the run."""
        return cls(
            omega,
            specimen,
            configuration.known_on_table,
            reference,
            sensors,
            configuration.simulated_shaker,
            parameters.harmonics,
            linear_frame(configuration),
            parameters.laser_block or 0.0,
        )

    def rounded(self, peak: SteadyPeak) -> SteadyPeak:
        """The peak without the rounding errors of calibrated lasers."""
        step = self.sensors.accuracy.laser_resolution
        if self.sensors.calibration is None or step == 0.0:
            return peak
        return without_rounding(peak, self.omega, step)

    def corrected(self, peak: SteadyPeak) -> tuple[SteadyPeak, "Conditions"]:
        """A periodic peak without the rounding errors of calibrated lasers, or without the linearity errors of others
        that the harmonics of the tests reveal; and the conditions of its gain.
        """
        peak = self.rounded(peak)
        if self.frame is None or not self.block:
            return peak, self
        found = corrected(peak, self.reference.peak, self.sensors, self.frame, self.omega)
        if found is None:
            return peak, self
        return found.peak, self.found(found.reference, found.sensors)

    def found(self, reference: SteadyPeak, sensors: SensorUncertainty) -> "Conditions":
        """Conditions with a corrected peak of the `reference`, and the `sensors` with the errors found."""
        return replace(self, reference=replace(self.reference, peak=reference), sensors=sensors)

    def branches(self, peak: SteadyPeak) -> dict[str, Branch]:
        """Predicted branches at the measured amplitudes of the table."""
        return predict_gain(self.specimen, self.omega, peak.amplitude, self.reference.peak.amplitude).branches

    def slope(self, name: str, peak: SteadyPeak) -> float:
        """d ln alpha_2 / d ln amplitude of a branch, with both tests at the same amplitude; 0 at the end of the branch.

        Central difference between orbits of the steady solver. The gains of the resting block and of the bare frame do
        not depend on the amplitude.
        """
        around = (peak.amplitude * (1.0 - AMPLITUDE_STEP), peak.amplitude * (1.0 + AMPLITUDE_STEP))
        less, more = (predict_gain(self.specimen, self.omega, each).branches.get(name) for each in around)
        if less is None or more is None:
            return 0.0
        return log(more.alpha_2 / less.alpha_2) / log(around[1] / around[0])

    def gain(self, peak: SteadyPeak, slope: float = 0.0) -> Gain:
        """Gain of a peak; for `slope` see `slope()`, zero for a gain at the amplitude that occurred."""
        return gain(peak, self.reference.peak, self.sensors, slope)

    def comparison(self, name: str, branch: Branch | None, peak: SteadyPeak) -> "_Comparison":
        """Comparison with the branch `name` at the amplitude of `peak`; `branch` is None if it does not exist."""
        return _Comparison(self, branch, self.slope(name, peak), predicted_fields(name, branch, self.known))


@dataclass(frozen=True)
class _Comparison:
    """Predicted branch with which gains are compared; for `slope` see `Conditions.slope`."""

    conditions: Conditions
    branch: Branch | None
    slope: float
    predicted: dict[str, Any]

    def compare(self, peak: SteadyPeak) -> tuple[Gain, bool | None]:
        """Gain of a peak, and whether it agrees with the predicted gain, i.e. differs by no more than the combined
        expanded uncertainty (|E_n| <= 1, ISO 13528). The verdict is None without a prediction or a steady reference.
        """
        reference, branch = self.conditions.reference, self.branch
        measured = self.conditions.gain(peak, self.slope)
        uncertainty = self.predicted["alpha_2_predicted_uncertainty"]
        if branch is None or uncertainty is None or not reference.steadiness.steady:
            return measured, None
        return measured, abs(measured.alpha_2 - branch.alpha_2) <= hypot(measured.uncertainty, uncertainty)

    def fields(self, peak: SteadyPeak, measured: Gain, agrees: bool | None, table: Settled | Held) -> dict[str, Any]:
        """Fields of a measured motion: gain, comparison with the prediction, and errors of the table's motion."""
        return self.predicted | {
            "alpha_2": measured.alpha_2,
            "alpha_2_uncertainty": measured.uncertainty,
            **measured.budget.fields,
            "agrees": agrees,
            "drift_peak_m": peak.drift,
            "amplitude_m_s2": peak.amplitude,
            "cycles_measured": peak.cycles,
            "amplitude_error": table.amplitude_error,
            "phase_error_rad": table.phase_error,
            "table_harmonics": peak.harmonics,
        }


def judge(settled: Settled, conditions: Conditions, starts: int, held: Held | None = None) -> HarmonicPoint:
    """Point of a dwell after `starts` attempts, compared with the branch whose peaks of drift and u1 are nearest.

    If the motion is not steady or the orbit is unstable, stability is also predicted on the table. If the motion was
    then `held` on the rocking orbit, gain and comparison are for the held motion, and the free motion is described in
    addition. Peaks are corrected for errors of the lasers, which takes up to half a second.
    """
    reference = conditions.reference
    if reference.steadiness.steady:
        conditions = replace(conditions, reference=replace(reference, peak=conditions.rounded(reference.peak)))
    settled, own = _corrected(settled, conditions)
    peak, bare, shaker = settled.peak, own.reference.peak, conditions.shaker
    branches = conditions.branches(peak)
    steady = settled.steadiness.steady
    name = (nearest_branch(branches, peak.drift, peak.u1) if steady else None) or _ROCKING
    status = (PointStatus.STEADY if name == _ROCKING else PointStatus.RESTING) if steady else PointStatus.MODULATED
    comparison = own.comparison(name, branches.get(name), peak)
    # an unsteady motion has the gain at the amplitude that occurred, which no branch describes
    measured, agrees = comparison.compare(peak) if steady else (own.gain(peak), None)
    on_table = None
    if shaker is not None and _ROCKING in branches and not (steady and branches[name].stable):
        on_table = _table_multiplier(branches[_ROCKING], shaker, conditions.harmonics)
    free = _free_fields(settled.motion, own)
    orbit: dict[str, Any] = {}
    if settled.orbit is not None:
        curves = own.sensors.curves
        mean = settled.orbit if curves is None else without_errors(settled.orbit, curves)
        gained, same = comparison.compare(mean)
        orbit = {"alpha_2_orbit": gained.alpha_2, "alpha_2_orbit_uncertainty": gained.uncertainty, "orbit_agrees": same}
    remarks = (
        *_remarks(settled, conditions.reference, name, branches, agrees, on_table, free, orbit),
        *own.sensors.rough(measured.shapes),
    )
    point = HarmonicPoint(
        omega_rad_s=conditions.omega,
        beta=conditions.specimen.label or 0.0,
        status=status,
        **comparison.fields(peak, measured, agrees, settled),
        bare_drift_peak_m=bare.drift,
        bare_amplitude_m_s2=bare.amplitude,
        **free,
        **orbit,
        table_multiplier=on_table,
        starts_tried=starts,
        settle_time_s=settled.time,
        table_updates=settled.updates,
        reason="; ".join(remarks),
    )
    return point if held is None else _held_point(point, held, conditions)


def _corrected(settled: Settled, conditions: Conditions) -> tuple[Settled, Conditions]:
    """A dwell without the errors of the lasers that it reveals, and the conditions of its gain; both as they are if it
    reveals none, or if the peak of an unsteady dwell was asked for in another way.
    """
    if settled.steadiness.steady:
        peak, own = conditions.corrected(settled.peak)
        return replace(settled, peak=peak), own
    motion, reference, frame = settled.motion, conditions.reference, conditions.frame
    if motion is None or frame is None or settled.peak.drift != motion.peaks.greatest.drift:
        return settled, conditions
    found = revealed(motion.peaks, reference.peak, conditions.sensors, frame, conditions.omega, conditions.block)
    if found is None:
        return settled, conditions
    own = conditions.found(found.reference, found.sensors)
    return replace(settled, peak=found.peaks.greatest, motion=replace(motion, peaks=found.peaks)), own


def _held_point(free: HarmonicPoint, held: Held, conditions: Conditions) -> HarmonicPoint:
    """The point of a free motion that was then held; if it was not held on the orbit, only a remark is added."""
    if held.peak is None:
        released = f"the hold of the motion on its orbit was released after cycle {held.cycles}"
        text = f"{released if held.cycles else 'the motion could not be held on its orbit'}: {held.reason}"
        return _remarked(free, text)
    peak, conditions = conditions.corrected(held.peak)
    branches = conditions.branches(peak)
    if nearest_branch(branches, peak.drift, peak.u1) != _ROCKING:
        return _remarked(free, "the held motion is not on the rocking orbit")
    comparison = conditions.comparison(_ROCKING, branches[_ROCKING], peak)
    measured, agrees = comparison.compare(peak)
    remarks = [f"free: {free.reason}"] if free.reason else []
    captured = f"captured after cycle {held.captured}" + (" without a model" if held.model_free else "")
    remarks.append(f"{captured}, control {100.0 * held.control:.2g} % of the amplitude (rms)")
    remarks += [*_amplitude_remark(held), *([DIFFERS] if agrees is False else [])]
    # the number in a remark may differ
    remarks += [each for each in conditions.sensors.rough(measured.shapes) if each.split(" is ")[0] not in free.reason]
    return free.model_copy(
        update={
            "status": PointStatus.HELD,
            **comparison.fields(peak, measured, agrees, held),
            "bare_drift_peak_m": conditions.reference.peak.drift,
            **_rate_fields(held.rate),
            "control_share": held.control,
            "captured_cycles": held.captured,
            "model_free": held.model_free,
            "table_updates": free.table_updates + held.updates,
            "reason": "; ".join(remarks),
        }
    )


def _remarked(point: HarmonicPoint, remark: str) -> HarmonicPoint:
    return point.model_copy(update={"reason": "; ".join(filter(None, (point.reason, remark)))})


def _table_multiplier(branch: Branch, shaker: Shaker, harmonics: int) -> float | None:
    """Greatest modulus of the multipliers on the table; None if no orbit is found."""
    try:
        return abs(table_orbit(branch.orbit, shaker, harmonics).slowest)
    except NoOrbit:
        return None


def _free_fields(motion: FreeMotion | None, conditions: Conditions) -> dict[str, Any]:
    """Fields of an unsteady motion."""
    if motion is None:
        return {}
    found: dict[str, Any] = {"repeats_cycles": motion.repeats or None}
    peaks = {"least": motion.peaks.least, "mean": motion.peaks.mean, "greatest": motion.peaks.greatest}
    for name, peak in peaks.items():
        measured = conditions.gain(peak)
        found[f"alpha_2_{name}"] = measured.alpha_2
        found[f"alpha_2_{name}_uncertainty"] = measured.uncertainty
    return found | _rate_fields(motion.rate)


def _rate_fields(rate: Rate | None) -> dict[str, Any]:
    """Fields of the measured multiplier."""
    if rate is None:
        return {}
    return {
        "multiplier": rate.modulus,
        "multiplier_uncertainty": 2.0 * rate.uncertainty,
        "multiplier_angle_rad": rate.angle,
    }


def predicted_fields(name: str, branch: Branch | None, known: SpecimenKnowledge) -> dict[str, Any]:
    """Prediction fields of a point for the branch `name`; the predicted values are None if it does not exist."""
    return {
        "layer": name if branch else "none",
        "alpha_2_predicted": branch.alpha_2 if branch else None,
        "alpha_2_predicted_uncertainty": expanded_uncertainty(branch, known) if branch else None,
        "predicted_stable": branch.stable if branch else None,
    }


def _described(settled: Settled) -> str:
    """Description of an unsteady motion."""
    motion = settled.motion
    if motion is not None and motion.rate is not None and motion.rate.decays:
        decay, doubt = 100.0 * (1.0 - motion.rate.modulus), 200.0 * motion.rate.uncertainty
        return (
            f"the motion approaches a periodic one: the deviation decays by ({decay:.2g} +- {doubt:.1g}) % per "
            "cycle; with a longer --settle-limit it may become steady"
        )
    repeats = settled.steadiness.repeats if motion is None else motion.repeats
    return f"the motion repeats every {repeats} cycles" if repeats else "the motion does not repeat"


def _growth(fixed: float, on_table: float | None) -> str:
    """Growth or decay of disturbances, from the moduli of the dominant multipliers on fixed ground and on the table."""

    def change(modulus: float) -> str:
        return f"{'grow' if modulus > 1.0 else 'decay'} by {100.0 * abs(modulus - 1.0):.2g} % per cycle"

    found = f"{change(fixed)} on fixed ground"
    return found if on_table is None else f"{found} and {change(on_table)} on this table"


def _remarks(
    settled: Settled,
    reference: Settled,
    name: str,
    branches: dict[str, Branch],
    agrees: bool | None,
    on_table: float | None,
    free: Mapping[str, Any],
    orbit: Mapping[str, Any],
) -> Iterator[str]:
    state, peak = settled.steadiness, settled.peak
    if not state.steady:
        peaks = ""
        if free:
            least, greatest = (
                plus_minus(free[f"alpha_2_{end}"], free[f"alpha_2_{end}_uncertainty"]) for end in ("least", "greatest")
            )
            peaks = f", the largest drift within a period is between alpha_2 = {least} and {greatest}"
        yield f"not steady after {settled.time:.0f} s: {_described(settled)}{peaks}"
        if on_table is not None:
            yield f"disturbances of the predicted orbit {_growth(branches[_ROCKING].multiplier, on_table)}"
        if orbit:
            gained = f"alpha_2 = {orbit['alpha_2_orbit']:.4f} +- {orbit['alpha_2_orbit_uncertainty']:.4f}"
            verdict = {True: ", which agrees with the prediction", False: ", which differs from the prediction"}
            yield f"the mean cycle gives the gain of the orbit: {gained}{verdict.get(orbit['orbit_agrees'], '')}"
    elif name in branches and not branches[name].stable:
        growth = _growth(branches[name].multiplier, on_table)
        yield f"steady while measured; disturbances of the predicted orbit {growth}"
    elif name != _ROCKING and _ROCKING in branches and branches[_ROCKING].stable:
        yield "no start reached the stable rocking motion; the block rests"
    yield from _amplitude_remark(settled)
    if peak.harmonics > HARMONICS_NOTE:
        yield f"the table's harmonics are {100.0 * peak.harmonics:.1f} % of its fundamental"
    if not reference.steadiness.steady:
        yield "the bare frame was not steady, so its drift is not a valid reference"
    if agrees is False:
        yield DIFFERS


def _amplitude_remark(table: Settled | Held) -> Iterator[str]:
    if abs(table.amplitude_error) > AMPLITUDE_NOTE:
        yield f"the table's amplitude has an error of {100.0 * table.amplitude_error:+z.2f} %"
