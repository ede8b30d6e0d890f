"""Free rocking of the stand-alone block, tilted by hand."""

from typing import Annotated, Literal

from pydantic import Field, field_validator

from bench.protocol import Protocol, RunView, deferred
from sim.parameters import Parameters, each_once, quantity

ALL = "all tilts"
"""`part` of the point that combines all tilts."""

_EXPANDED = "expanded uncertainty (k = 2)"

Share = Annotated[float, Field(ge=0.1, le=0.9)]


class FreeRockingParameters(Parameters):
    """The stand-alone block on a locked table is repeatedly tilted and released by hand; a laser measures its face."""

    tilts: tuple[Share, ...] = quantity(
        (0.35, 0.45, 0.6), "1", "tilts relative to the critical angle, beyond which the block falls", min_length=1
    )

    _each_once = field_validator("tilts")(each_once)

    sides: Literal["both", "towards", "away"] = quantity(
        "both",
        "",
        "directions in which the top of the block is tilted: towards the frame, away from it, or both in turn",
    )
    height: float = quantity(0.30, "m", "height above the table at which laser 2 measures the block", gt=0)
    height_uncertainty: float = quantity(0.001, "m", "standard uncertainty of the height", ge=0)
    side_uncertainty: float = quantity(
        1e-4, "m", "standard uncertainty of the measured width and height of the block", ge=0
    )
    least_swing: float = quantity(0.12, "1", "smallest swing that is evaluated, relative to the tilt", ge=0.03, le=0.5)
    release_within: float = quantity(
        8.0, "s", "time from the beginning of a recording within which the block must be released", ge=5, le=60
    )
    attempts: int = quantity(2, "1", "number of attempts to record a tilt before it is omitted", ge=1, le=10)


class RockingPoint(Parameters):
    """Restitution, critical angle and frequency parameter of the block, from its motion and from its dimensions."""

    part: str = quantity(..., "", 'name of the tilt, or "all tilts"')
    tilt_rad: float | None = quantity(None, "rad", "tilt before the release, positive towards the frame")
    impacts: int = quantity(..., "1", "number of impacts used")
    r_exp: float = quantity(..., "1", "restitution, from the better of the two estimators")
    r_exp_uncertainty: float = quantity(..., "1", f"{_EXPANDED} of r_exp")
    estimator: str = quantity(
        "", "", "estimator that gives r_exp: the exact motion, or the amplitudes if the impacts differ too much"
    )
    r_th: float = quantity(..., "1", "theoretical restitution of a block of the configured dimensions, 1 - 2 M b^2 / J")
    r_th_uncertainty: float = quantity(..., "1", f"{_EXPANDED} of r_th, due to the block's dimensions")
    ratio: float = quantity(..., "1", "r_exp / r_th, the restitution factor of the configured block")
    ratio_uncertainty: float = quantity(..., "1", f"{_EXPANDED} of the ratio, excluding the uncertainty of r_th")
    r_motion: float | None = quantity(None, "1", "restitution from the fit of the exact nonlinear motion")
    r_motion_uncertainty: float | None = quantity(None, "1", f"{_EXPANDED} of r_motion")
    r_amplitudes: float = quantity(..., "1", "restitution from the swing amplitudes before and after each impact")
    r_amplitudes_uncertainty: float = quantity(..., "1", f"{_EXPANDED} of r_amplitudes")
    trend: float = quantity(
        ..., "1", "change of r between zero impact velocity and the velocity of a fall from the critical angle"
    )
    trend_uncertainty: float = quantity(..., "1", f"{_EXPANDED} of the trend")
    alpha_rad: float = quantity(..., "rad", "critical angle from the fit of the motion")
    alpha_uncertainty_rad: float = quantity(..., "rad", f"{_EXPANDED} of alpha_rad, mainly from the laser's scale")
    alpha_sides_rad: float = quantity(..., "rad", "critical angle from the block's dimensions, atan(b / h_b)")
    alpha_sides_uncertainty_rad: float = quantity(..., "rad", f"{_EXPANDED} of alpha_sides_rad")
    p_rad_s: float = quantity(..., "rad/s", "frequency parameter from the fit of the motion")
    p_uncertainty_rad_s: float = quantity(..., "rad/s", f"{_EXPANDED} of p_rad_s")
    p_sides_rad_s: float = quantity(..., "rad/s", "frequency parameter of a uniform block of the configured dimensions")
    p_sides_uncertainty_rad_s: float = quantity(..., "rad/s", f"{_EXPANDED} of p_sides_rad_s")
    residual_m: float = quantity(..., "m", "rms residual of the displacement")
    push: float | None = quantity(
        None,
        "1",
        "push at the release, expressed as the relative change of the tilt that would have the same effect",
    )
    birge: float | None = quantity(
        None,
        "1",
        "scatter of r_motion between tilts, relative to that expected from the uncertainties; absent for a single tilt",
    )
    uncertainty_parts: str = quantity("", "", "standard uncertainty of r_exp by contribution, as JSON")
    remarks: str = quantity("", "", "remarks on the tilt")


PROTOCOL = Protocol(
    name="free-rocking",
    summary="Free rocking of the block: ratio of measured to theoretical restitution of its impacts.",
    details=(
        "The stand-alone block on a locked table is repeatedly tilted and released by hand; a laser measures "
        "its face. The exact nonlinear motion is fitted to each recording, and the amplitudes of the swings "
        "provide a second estimate of the restitution, impact by impact. Other runs load the result, "
        "specimen.json. The table is not driven. Without options, a run has three tilts to each side and "
        "takes about five minutes."
    ),
    example="--config bench.toml --specimen FILE",
    parameters=FreeRockingParameters,
    point=RockingPoint,
    prepare=deferred("protocols.free_rocking.experiment:FreeRockingTest"),
    figures=("free_rocking.png",),
    files=("specimen.json",),
    report=deferred("protocols.free_rocking.results:rocking_sections"),
    view=RunView(
        headline="r_exp",
        labels={
            "r_exp": "restitution rₑₓₚ",
            "r_th": "theoretical restitution rₜₕ",
            "ratio": "restitution factor rₑₓₚ/rₜₕ",
            "r_motion": "restitution r, from the motion",
            "r_amplitudes": "restitution r, from the amplitudes",
            "trend": "trend of r",
            "alpha_rad": "critical angle α, from the motion",
            "alpha_sides_rad": "critical angle α, from the dimensions",
            "p_rad_s": "frequency parameter p, from the motion",
            "p_sides_rad_s": "frequency parameter p, from the dimensions",
        },
        live=deferred("protocols.free_rocking.live:rocking_view"),
    ),
)
