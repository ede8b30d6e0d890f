"""Evaluation of the recorded tilts: results, fits for the data file, and identified specimen."""

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from json import dumps
from math import hypot

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_rocking.findings import SCATTERED, Findings, Tilt
from bench.analysis.free_rocking.fit import NAMES, R
from bench.analysis.gain import COVERAGE
from bench.findings import FitFinished, FittedParameter, Series
from protocols.free_rocking.protocol import FreeRockingParameters, RockingPoint
from sim.free_rocking import critical_angle, frequency_parameter, theoretical_restitution
from sim.identified import Finding, Identified
from sim.specimen import Block, Specimen

Array = NDArray[np.float64]

_UNITS = dict(zip(NAMES, ("rad", "rad/s", "1", "1", "s", "m", "1/m", "1/m2"), strict=True))


def rocking_point(
    part: str,
    found: Findings,
    specimen: Specimen,
    parameters: FreeRockingParameters,
    residual: float,
    *,
    tilt: float | None = None,
    push: float | None = None,
    remarks: str = "",
) -> RockingPoint:
    """Point of `part`, one tilt or all tilts, for the block of `specimen`; `residual` [m] is the rms of the fit."""
    block, theory = specimen.block, theoretical_restitution(specimen.block)
    r, birge = found.restitution, found.motion.birge
    return RockingPoint(
        part=part,
        tilt_rad=tilt,
        impacts=found.impacts,
        r_exp=r.value,
        r_exp_uncertainty=COVERAGE * r.uncertainty,
        estimator="amplitudes" if found.by_amplitudes else "exact motion",
        r_th=theory,
        r_th_uncertainty=COVERAGE * _by_sides(theoretical_restitution, block, parameters),
        ratio=r.value / theory,
        ratio_uncertainty=COVERAGE * r.uncertainty / theory,
        r_motion=found.motion.value,
        r_motion_uncertainty=COVERAGE * found.motion.uncertainty,
        r_amplitudes=found.relation.value,
        r_amplitudes_uncertainty=COVERAGE * found.relation.uncertainty,
        trend=found.trend.value,
        trend_uncertainty=COVERAGE * found.trend.uncertainty,
        alpha_rad=found.alpha.value,
        alpha_uncertainty_rad=COVERAGE * found.alpha.uncertainty,
        alpha_sides_rad=critical_angle(block),
        alpha_sides_uncertainty_rad=COVERAGE * _by_sides(critical_angle, block, parameters),
        p_rad_s=found.p.value,
        p_uncertainty_rad_s=COVERAGE * found.p.uncertainty,
        p_sides_rad_s=frequency_parameter(block, specimen.g),
        p_sides_uncertainty_rad_s=COVERAGE
        * _by_sides(lambda changed: frequency_parameter(changed, specimen.g), block, parameters),
        residual_m=residual,
        push=push,
        birge=None if birge != birge else birge,
        uncertainty_parts=dumps({name: float(f"{part:.4g}") for name, part in r.parts().items()}),
        remarks=remarks,
    )


def inconsistencies(combined: RockingPoint) -> list[str]:
    """Inconsistencies of the combined result, one message each, with what to check at the bench."""
    found: list[str] = []
    if abs(combined.trend) > combined.trend_uncertainty:
        found.append(
            f"r changes by {combined.trend:+.2g} +- {combined.trend_uncertainty:.2g} over the whole range of impact"
            " velocities: the stated value is the mean over these tilts"
        )
    motion, motion_uncertainty = combined.r_motion or combined.r_exp, combined.r_motion_uncertainty or 0.0
    apart = motion - combined.r_amplitudes
    if abs(apart) > hypot(motion_uncertainty, combined.r_amplitudes_uncertainty):
        found.append(
            f"r from the whole motion and r from the amplitudes alone differ by {apart:+.2g}: check the block's base"
        )
    if combined.birge is not None and combined.birge > SCATTERED:
        found.append(
            f"the scatter of the tilts is {combined.birge:.1f} times that expected from their uncertainties, and is "
            "included in the uncertainty: the impacts differ. r_exp is taken from the amplitudes, which are less "
            "sensitive to these differences"
        )
    if combined.birge is None:
        found.append("a single tilt does not show the scatter of r between tilts: release the block several times")
    for name, seen, sides, uncertainty in (
        (
            "alpha",
            combined.alpha_rad,
            combined.alpha_sides_rad,
            hypot(combined.alpha_uncertainty_rad, combined.alpha_sides_uncertainty_rad),
        ),
        (
            "p",
            combined.p_rad_s,
            combined.p_sides_rad_s,
            hypot(combined.p_uncertainty_rad_s, combined.p_sides_uncertainty_rad_s),
        ),
    ):
        if abs(seen - sides) > uncertainty:
            found.append(
                f"{name} is {seen:.5g} from the motion and {sides:.5g} from the dimensions, a difference of "
                f"{100 * (seen / sides - 1):+.2g} %: check for blunt edges, the laser's height and scale, the "
                "dimensions, and whether the block is uniform"
            )
    return found


def fit_events(tilt: Tilt, alone: Findings, uncertain: Array, number: int) -> Iterator[FitFinished]:
    """Two fit events for tilt `number`: the exact motion against time, and the impacts in order.

    `alone` are the findings from this tilt alone, `uncertain`, shape (8,), the standard uncertainties of the fit.
    """
    yield _motion(tilt, uncertain, number)
    yield _impacts(tilt, alone, number)


def identified_specimen(found: Findings, tilts: int, block: Block, known: Identified | None) -> Identified:
    """Identified specimen with the restitution factor of `block`, the ratio of measured to theoretical restitution.

    The theoretical value depends on the block's width and height, so the source of the finding states both and the
    measured restitution.
    """
    theory, r = theoretical_restitution(block), found.restitution
    by = "amplitudes of the swings" if found.by_amplitudes else "exact motion"
    size = f"{2.0 * block.b:.6g} m wide and {2.0 * block.h_b:.6g} m high"
    finding = Finding(
        name="restitution_factor",
        value=r.value / theory,
        standard_uncertainty=r.uncertainty / theory,
        source=f"free rocking (tilts: {tilts}), from the {by}: r_exp = {r.value:.6f} of a block {size}",
        date=datetime.now(UTC).replace(microsecond=0),
    )
    return (known or Identified()).extended([finding])


def _motion(tilt: Tilt, uncertain: Array, number: int) -> FitFinished:
    fit = tilt.fit
    r, u = float(fit.motion.restitution), float(uncertain[R])
    columns = {
        "time": Series(fit.times, "s", "time since the start of the recording"),
        "measured": Series(fit.displacement, "m", "displacement of the block's face at the laser's height"),
        "fitted": Series(fit.fitted, "m", "the exact nonlinear motion"),
        "residual": Series(fit.residual, "m", "measured minus fitted"),
    }
    parameters = {
        name: FittedParameter(float(value), float(uncertainty), _UNITS[name])
        for name, value, uncertainty in zip(NAMES, fit.values, uncertain, strict=True)
    }
    text = f"exact motion: r = {r:.6f} +- {u:.1g} (k = 1) from {fit.impacts} impacts"
    return FitFinished(f"tilt {number}", text, columns, parameters)


def _impacts(tilt: Tilt, alone: Findings, number: int) -> FitFinished:
    relation, points = tilt.relation, tilt.points
    count = relation.each.size
    # the first impact is preceded by the release, not by a turning point
    columns = {
        "time": Series(points.impacts[1 : count + 1], "s", "time of the impact"),
        "restitution": Series(relation.each, "1", "r of this impact, from the largest angles before and after"),
        "restitution_uncertainty": Series(
            relation.each_uncertainty, "1", "standard uncertainty of the restitution from noise"
        ),
        "speed": Series(
            relation.speed,
            "1",
            "angular velocity before the impact, relative to the velocity in a fall from the critical angle",
        ),
        "angle_before": Series(relation.angles[:-1], "rad", "largest angle before the impact"),
        "angle_after": Series(relation.angles[1:], "rad", "largest angle after the impact"),
        "time_uncertainty": Series(
            points.impact_uncertainty[1 : count + 1], "s", "standard uncertainty of the time from noise"
        ),
    }
    text = f"r = {relation.restitution:.5f} +- {alone.relation.uncertainty:.1g} (k = 1)"
    found = {"restitution": FittedParameter(relation.restitution, alone.relation.uncertainty, "1")}
    return FitFinished(f"impacts of tilt {number}", text, columns, found)


def _by_sides(value: Callable[[Block], float], block: Block, parameters: FreeRockingParameters) -> float:
    """Standard uncertainty of a quantity computed from the measured width and height, whose errors are independent."""
    half = 0.5 * parameters.side_uncertainty
    wider = Block.model_validate(block.model_dump() | {"b": block.b + half})
    higher = Block.model_validate(block.model_dump() | {"h_b": block.h_b + half})
    return hypot(value(wider) - value(block), value(higher) - value(block))
