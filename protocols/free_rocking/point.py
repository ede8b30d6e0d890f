"""What free rocking comes to: one row for each tilt, and one for all of them."""

from collections.abc import Callable
from json import dumps
from math import hypot

from bench.analysis.free_rocking.findings import SCATTERED, Findings
from bench.analysis.gain import COVERAGE
from protocols.free_rocking.parameters import FreeRockingParameters
from sim.free_rocking import critical_angle, frequency_parameter, theoretical_restitution
from sim.parameters import Parameters, quantity
from sim.specimen import Block, Specimen

ALL = "all tilts"
"""Name of the row that combines the others."""

_EXPANDED = "expanded uncertainty (k = 2)"


class RockingPoint(Parameters):
    """Restitution of the block's impacts, what its motion says of its shape, and what its sides say of both."""

    part: str = quantity(..., "", "which tilt, or all of them")
    tilt_rad: float | None = quantity(None, "rad", "tilt in the hand, above zero towards the frame")
    impacts: int = quantity(..., "1", "impacts that were used")
    r_exp: float = quantity(..., "1", "restitution, by the better of the two estimators")
    r_exp_uncertainty: float = quantity(..., "1", f"{_EXPANDED} of r_exp")
    estimator: str = quantity(
        "", "", "where r_exp is from: the exact motion, or the amplitudes where impacts differ too much for it"
    )
    r_th: float = quantity(..., "1", "theoretical restitution of the block as measured, 1 - 2 M b^2 / J")
    r_th_uncertainty: float = quantity(..., "1", f"{_EXPANDED} of r_th, by the block's sides")
    ratio: float = quantity(..., "1", "r_exp / r_th, the restitution factor of the block as configured")
    ratio_uncertainty: float = quantity(..., "1", f"{_EXPANDED} of the ratio, that of r_th apart")
    r_motion: float | None = quantity(None, "1", "restitution, from the fit of the exact nonlinear motion")
    r_motion_uncertainty: float | None = quantity(None, "1", f"{_EXPANDED} of r_motion")
    r_amplitudes: float = quantity(..., "1", "restitution, from the sizes of the swings alone")
    r_amplitudes_uncertainty: float = quantity(..., "1", f"{_EXPANDED} of r_amplitudes")
    trend: float = quantity(..., "1", "change of r from impacts of no speed to that of a fall from the critical angle")
    trend_uncertainty: float = quantity(..., "1", f"{_EXPANDED} of the trend")
    alpha_rad: float = quantity(..., "rad", "critical angle that the motion shows")
    alpha_uncertainty_rad: float = quantity(..., "rad", f"{_EXPANDED} of alpha_rad, by the laser's scale above all")
    alpha_sides_rad: float = quantity(..., "rad", "critical angle by the block's sides, atan(b / h_b)")
    alpha_sides_uncertainty_rad: float = quantity(..., "rad", f"{_EXPANDED} of alpha_sides_rad")
    p_rad_s: float = quantity(..., "rad/s", "frequency parameter that the motion shows")
    p_uncertainty_rad_s: float = quantity(..., "rad/s", f"{_EXPANDED} of p_rad_s")
    p_sides_rad_s: float = quantity(..., "rad/s", "frequency parameter of a uniform block with these sides")
    p_sides_uncertainty_rad_s: float = quantity(..., "rad/s", f"{_EXPANDED} of p_sides_rad_s")
    residual_m: float = quantity(..., "m", "root mean square of what the fit leaves of the displacement")
    push: float | None = quantity(
        None, "1", "by how much the block was pushed: tilt of a release from rest over the hand's"
    )
    birge: float | None = quantity(None, "1", "scatter of the tilts' r_motion over what their uncertainties let expect")
    uncertainty_parts: str = quantity("", "", "standard uncertainty of r_exp by contribution, JSON object")
    remarks: str = quantity("", "", "what was noticed")


def point(
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
    """The row of `part` for the block of `specimen`."""
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
        uncertainty_parts=dumps({name: float(f"{size:.4g}") for name, size in r.parts().items()}),
        remarks=remarks,
    )


def doubts(combined: RockingPoint) -> list[str]:
    """What does not hang together in the row of all tilts, and what to see to."""
    found: list[str] = []
    if abs(combined.trend) > combined.trend_uncertainty:
        found.append(
            f"r changes with the impact's speed by {combined.trend:+.2g} +- {combined.trend_uncertainty:.2g} over the"
            " whole range: one value is a mean over these tilts"
        )
    motion, motion_uncertainty = combined.r_motion or combined.r_exp, combined.r_motion_uncertainty or 0.0
    apart = motion - combined.r_amplitudes
    if abs(apart) > hypot(motion_uncertainty, combined.r_amplitudes_uncertainty):
        found.append(f"the whole motion and its amplitudes alone differ by {apart:+.2g} in r: see to the block's base")
    if combined.birge is not None and combined.birge > SCATTERED:
        found.append(
            f"the tilts scatter {combined.birge:.1f} times as much as each of them promises, which is counted: impacts"
            " differ from one another. r_exp is that of the amplitudes, which depend less on that"
        )
    if combined.birge is None:
        found.append("a single tilt does not tell how much r scatters between tilts: let the block go several times")
    for name, seen, sides, doubt in (
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
        if abs(seen - sides) > doubt:
            found.append(
                f"{name} is {seen:.5g} by the motion and {sides:.5g} by the sides, {100 * (seen / sides - 1):+.2g} %:"
                " see to edges that are not sharp, to the laser's height and scale, to sides and density"
            )
    return found


def _by_sides(value: Callable[[Block], float], block: Block, parameters: FreeRockingParameters) -> float:
    """Standard uncertainty of what follows from width and height, each measured on its own."""
    half = 0.5 * parameters.side_uncertainty
    wider = Block.model_validate(block.model_dump() | {"b": block.b + half})
    higher = Block.model_validate(block.model_dump() | {"h_b": block.h_b + half})
    return hypot(value(wider) - value(block), value(higher) - value(block))
