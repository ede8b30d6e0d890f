"""Stability protocol: multipliers of rocking orbits, measured after the release of held motions."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field, field_validator, model_validator

from bench.protocol import Axis, Protocol, RunView, deferred
from protocols.common.sine.settings import SineParameters
from sim.errors import InvalidInput
from sim.parameters import COUPLING, Parameters, each_once, quantity

Frequency = Annotated[float, Field(gt=0, le=40)]
Factor = Annotated[float, Field(ge=0.1, le=5)]


class StabilityPoints(Parameters):
    """Test points of a stability test: frequencies, amplitudes and stiffness ratio."""

    omega: tuple[Frequency, ...] = quantity(
        (15.0, 15.2, 15.4, 15.6),
        "rad/s",
        "circular frequencies of the base motion; more than one requires a single amplitude",
        min_length=1,
    )
    amplitude_factor: tuple[Factor, ...] = quantity(
        (1.01,),
        "1",
        "amplitudes of the table acceleration, relative to the uplift acceleration g/lambda; more than one requires a "
        "single frequency",
        min_length=1,
    )
    beta: float = quantity(0.97, "1", "stiffness ratio k_C/k1 of the coupling spring", gt=0, le=100, usual=COUPLING)

    _each_once = field_validator("omega", "amplitude_factor")(each_once)


class StabilityParameters(SineParameters, StabilityPoints):
    """Orbits with one spring at several frequencies or amplitudes, held and released to measure their multipliers."""

    settle_limit: float = quantity(30.0, "s", "longest wait for the steady state before the hold", gt=0, le=3600)
    released_cycles: int = quantity(60, "1", "largest number of cycles observed after the release", ge=24, le=1000)
    bisect: bool = quantity(
        True, "", "whether the interval between a stable and an unstable neighbour is bisected by further points"
    )
    bracket: float = quantity(
        0.003,
        "1",
        "width of the bisected interval, relative to its middle, at which the bisection ends",
        ge=1e-4,
        le=0.5,
    )

    impulse_offset: float | None = quantity(
        None,
        "1",
        "distance of the impulse from the middle of the base, relative to the half width, in the prediction for an "
        "impact over a contact region; if absent, 1/3, of an impulse distributed like the velocity of approach",
        gt=0,
        le=1,
        example=0.5,
    )

    @model_validator(mode="after")
    def _check_axes(self) -> "StabilityParameters":
        if len(self.omega) > 1 and len(self.amplitude_factor) > 1:
            raise InvalidInput(
                "amplitude_factor",
                self.amplitude_factor,
                "several amplitudes are possible only at a single frequency: give one omega",
            )
        return self


class OrbitStatus(StrEnum):
    """Outcome of a point."""

    MEASURED = "measured"
    NOT_HELD = "not held"
    NOT_MEASURABLE = "not measurable"
    OVERTURNED = "overturned"


_EXPANDED = "expanded uncertainty (k = 2)"


class StabilityPoint(Parameters):
    """Measured and predicted multiplier of the rocking orbit at one frequency and amplitude.

    Values that were not measured are None. The prediction is for the nominal amplitude.
    """

    omega_rad_s: float = quantity(..., "rad/s", "circular frequency of the base motion")
    amplitude_factor: float = quantity(..., "1", "nominal amplitude relative to the uplift acceleration g/lambda")
    beta: float = quantity(..., "1", "stiffness ratio of the coupling spring")
    status: OrbitStatus = quantity(..., "", "outcome of the point")
    bisected: bool = quantity(False, "", "whether the point was added by the bisection")
    modulus: float | None = quantity(
        None, "1", "modulus of the dominant multiplier: factor by which a deviation changes per cycle"
    )
    modulus_uncertainty: float | None = quantity(None, "1", f"{_EXPANDED} of the modulus")
    angle_rad: float | None = quantity(None, "rad", "argument of the multiplier: rotation of the deviation in a cycle")
    angle_uncertainty_rad: float | None = quantity(None, "rad", f"{_EXPANDED} of the angle")
    modulus_predicted: float | None = quantity(
        None, "1", "predicted modulus: on the simulated table, or on fixed ground for any other table"
    )
    modulus_predicted_uncertainty: float | None = quantity(
        None, "1", f"{_EXPANDED} of the predicted modulus, due to the specimen"
    )
    angle_predicted_rad: float | None = quantity(None, "rad", "predicted argument of the multiplier")
    fixed_modulus: float | None = quantity(None, "1", "predicted modulus on fixed ground")
    consecutive_modulus: float | None = quantity(
        None, "1", "predicted modulus with consecutive impacts at the middle and the corner of the base"
    )
    contact_modulus: float | None = quantity(
        None, "1", "predicted modulus with an impulse in a contact region, at the distance impulse_offset"
    )
    law_modulus_uncertainty: float | None = quantity(
        None,
        "1",
        f"{_EXPANDED} of a modulus that is predicted with an exact law of restitution, due to the rest of the specimen",
    )
    implied_factor: float | None = quantity(
        None, "1", "restitution factor with which the prediction would be the measured modulus, to first order"
    )
    implied_factor_uncertainty: float | None = quantity(None, "1", f"{_EXPANDED} of this factor")
    agrees: bool | None = quantity(
        None,
        "1",
        "whether modulus and prediction differ by no more than their combined uncertainty (root sum of squares)",
    )
    uncertainty_parts: str = quantity(
        "", "", "standard uncertainty of the modulus by contribution, largest first, as JSON"
    )
    released_cycles: int = quantity(0, "1", "number of cycles after the release used for the multiplier")
    pairs: int | None = quantity(None, "1", "number of pairs of multipliers in the fit, 1 or 2")
    autocorrelation: float | None = quantity(
        None, "1", "correlation of the residuals of successive cycles; near 0 if the fit describes the motion"
    )
    residual_m: float | None = quantity(None, "m", "rms residual of the fitted Fourier coefficients of u1 and drift")
    drift_peak_m: float | None = quantity(None, "m", "peak drift of the held orbit")
    amplitude_m_s2: float | None = quantity(None, "m/s2", "achieved amplitude of the table on the held orbit")
    amplitude_slope: float | None = quantity(
        None, "1", "predicted derivative of the modulus with respect to the logarithm of the amplitude"
    )
    control_share: float | None = quantity(
        None, "1", "rms of the control over the measured cycles of the hold, relative to the table's amplitude"
    )
    captured_cycles: int | None = quantity(None, "1", "number of cycles from the beginning of the hold to the capture")
    starts_tried: int = quantity(0, "1", "number of starts tried")
    reason: str = quantity("", "", "remarks, or the reason why there is no multiplier")


PROTOCOL = Protocol(
    name="stability",
    summary="Multipliers of stable and unstable rocking orbits, and the stability boundary, against prediction.",
    details=(
        "At each frequency or amplitude, the rocking motion is held on its orbit by small corrections once per cycle, "
        "deflected slightly and released. The growth or decay of the deviation gives the modulus and angle of the "
        "dominant multiplier. Where the modulus crosses 1 between two points, further points bisect the interval. "
        "Without options, a run brackets the upper end of the unstable window at beta 0.97 on the simulated bench."
    ),
    example="--beta 0.97 --omega 15:15.6:4 --yes",
    parameters=StabilityParameters,
    point=StabilityPoint,
    prepare=deferred("protocols.stability.experiment:StabilityTest"),
    figures=("stability.png",),
    events=("protocols.common.sine.holding:HoldCycle",),
    report=deferred("protocols.stability.results:stability_sections"),
    view=RunView(
        headline="modulus",
        labels={
            "modulus": "multiplier |μ|",
            "angle_rad": "angle of μ",
            "modulus_predicted": "predicted |μ|",
            "angle_predicted_rad": "predicted angle of μ",
            "consecutive_modulus": "|μ| with consecutive impacts",
            "contact_modulus": "|μ| with a contact region",
            "implied_factor": "implied restitution factor",
        },
        matrix=(Axis("amplitude_factor", "amplitude_factor", "A {:g}"), Axis("omega", "omega_rad_s", "{:g} rad/s")),
        live=deferred("protocols.stability.live:multiplier_view"),
    ),
)
