"""Free rocking of the stand-alone block: parameters, the result of a tilt, and the protocol."""

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, field_validator

from bench.protocol import Prepared, Protocol, Sources
from sim.parameters import Parameters, each_once, quantity

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration

ALL = "all tilts"
"""Name of the row that combines the others."""

_EXPANDED = "expanded uncertainty (k = 2)"

Share = Annotated[float, Field(ge=0.1, le=0.9)]


class FreeRockingParameters(Parameters):
    """The stand-alone block is tilted by hand and let go on a locked table, several times, a laser on its face."""

    tilts: tuple[Share, ...] = quantity(
        (0.35, 0.45, 0.6), "1", "tilts over the angle beyond which the block falls", min_length=1
    )

    _each_once = field_validator("tilts")(each_once)

    sides: Literal["both", "towards", "away"] = quantity(
        "both", "", "where the block's top is tilted to: towards the frame, away from it, or both in turn"
    )
    height: float = quantity(0.30, "m", "height above the table at which laser 2 looks at the block", gt=0)
    height_uncertainty: float = quantity(0.001, "m", "standard uncertainty of that height", ge=0)
    side_uncertainty: float = quantity(
        1e-4, "m", "standard uncertainty of the measured width and height of the block", ge=0
    )
    least_swing: float = quantity(
        0.12, "1", "size below which swings are not used any more, over the tilt", ge=0.03, le=0.5
    )
    release_within: float = quantity(
        8.0, "s", "time from the beginning of a recording until the block must have been let go", ge=5, le=60
    )
    attempts: int = quantity(2, "1", "recordings of a tilt before it is left out", ge=1, le=10)


class RockingPoint(Parameters):
    """Restitution of the block's impacts and its shape, by its motion and by its sides."""

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
    birge: float | None = quantity(
        None, "1", "scatter of the tilts' r_motion relative to that expected from their uncertainties"
    )
    uncertainty_parts: str = quantity("", "", "standard uncertainty of r_exp by contribution, JSON object")
    remarks: str = quantity("", "", "what was noticed")


def _prepare(
    parameters: FreeRockingParameters, configuration: "BenchConfiguration", stored: "Sources | None"
) -> Prepared[FreeRockingParameters]:
    from protocols.free_rocking.experiment import FreeRockingTest

    return FreeRockingTest(parameters, configuration, stored)


PROTOCOL = Protocol(
    name="free-rocking",
    summary="Free rocking of the block: restitution of its impacts, measured over theoretical.",
    details=(
        "The stand-alone block is tilted by hand and let go on a locked table, a laser on its face, several times. "
        "The exact nonlinear motion is fitted to each recording, and the sizes of the swings tell the restitution "
        "again, impact by impact. The result, specimen.json, is what other runs load. Nothing is driven. Without "
        "options: three tilts to either side, about five minutes."
    ),
    example="--config bench.toml --specimen FILE",
    parameters=FreeRockingParameters,
    point=RockingPoint,
    prepare=_prepare,
    figures=("free_rocking.png",),
    files=("specimen.json",),
)
