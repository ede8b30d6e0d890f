"""The rows of free rocking from its findings: one for each tilt and one for all of them."""

from collections.abc import Callable
from json import dumps
from math import hypot

from bench.analysis.free_rocking.findings import SCATTERED, Findings
from bench.analysis.gain import COVERAGE
from protocols.free_rocking.protocol import FreeRockingParameters, RockingPoint
from sim.free_rocking import critical_angle, frequency_parameter, theoretical_restitution
from sim.specimen import Block, Specimen


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
