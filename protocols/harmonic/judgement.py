"""The point of a measured dwell: its status, gain, comparison with the prediction, and remarks."""

from dataclasses import replace
from typing import Any

from bench.analysis.free_motion import FreeMotion, Rate
from bench.analysis.steady_correction import without_errors
from bench.analysis.unsteady_correction import revealed
from protocols.common.sine.settling import Held, Settled
from protocols.harmonic.conditions import ROCKING, Conditions
from protocols.harmonic.protocol import HarmonicPoint, PointStatus
from protocols.harmonic.remarks import DIFFERS, amplitude_remark, remarks_on
from sim.gain import Branch, nearest_branch
from sim.shaker import Shaker
from sim.steady import NoOrbit
from sim.table_orbit import table_orbit


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
    name = (nearest_branch(branches, peak.drift, peak.u1) if steady else None) or ROCKING
    status = (PointStatus.STEADY if name == ROCKING else PointStatus.RESTING) if steady else PointStatus.MODULATED
    comparison = own.comparison(name, branches.get(name), peak)
    # an unsteady motion has the gain at the amplitude that occurred, which no branch describes
    measured, agrees = comparison.compare(peak) if steady else (own.gain(peak), None)
    on_table = None
    if shaker is not None and ROCKING in branches and not (steady and branches[name].stable):
        on_table = _table_multiplier(branches[ROCKING], shaker, conditions.harmonics)
    free = _free_fields(settled.motion, own)
    orbit: dict[str, Any] = {}
    if settled.orbit is not None:
        curves = own.sensors.curves
        mean = settled.orbit if curves is None else without_errors(settled.orbit, curves)
        gained, same = comparison.compare(mean)
        orbit = {"alpha_2_orbit": gained.alpha_2, "alpha_2_orbit_uncertainty": gained.uncertainty, "orbit_agrees": same}
    remarks = (
        *remarks_on(settled, conditions.reference, name, branches, agrees, on_table, free, orbit),
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
    if nearest_branch(branches, peak.drift, peak.u1) != ROCKING:
        return _remarked(free, "the held motion is not on the rocking orbit")
    comparison = conditions.comparison(ROCKING, branches[ROCKING], peak)
    measured, agrees = comparison.compare(peak)
    remarks = [f"free: {free.reason}"] if free.reason else []
    captured = f"captured after cycle {held.captured}" + (" without a model" if held.model_free else "")
    remarks.append(f"{captured}, control {100.0 * held.control:.2g} % of the amplitude (rms)")
    remarks += [*amplitude_remark(held), *([DIFFERS] if agrees is False else [])]
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
