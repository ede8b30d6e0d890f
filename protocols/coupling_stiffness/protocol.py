"""Stiffness of mounted springs, from decays with the block clamped."""

from typing import Annotated

from pydantic import Field, field_validator

from bench.protocol import Protocol, RunView, deferred
from protocols.common.decays.parameters import EXPANDED, DecayParameters, decay_field
from sim.parameters import COUPLING, Parameters, each_once, quantity

Stiffness = Annotated[float, Field(gt=0, le=100)]


class CouplingStiffnessParameters(DecayParameters):
    """Decays of the bare frame, then of the frame with each spring between it and the clamped block."""

    beta: tuple[Stiffness, ...] = quantity(
        (0.25, 0.64, 0.97), "1", "stiffness ratios on the labels of the springs", min_length=1, usual=COUPLING
    )
    repeats: int = quantity(
        3, "1", "number of decays that are combined for each spring and for the bare frame", ge=1, le=50
    )
    reference: bool = quantity(
        True,
        "",
        "whether the bare frame is measured first, so that errors common to both cancel; otherwise the previously "
        "identified k1 is used",
    )

    _each_once = field_validator("beta")(each_once)


class SpringPoint(Parameters):
    """A spring, or the bare frame as its reference, identified from one decay or from all decays."""

    beta: float | None = quantity(None, "1", "stiffness ratio on the label of the spring; absent for the bare frame")
    decay: int = decay_field("decay")
    decays: int = decay_field("decays")
    k_c_n_m: float | None = quantity(None, "N/m", "stiffness of the spring as mounted; absent for the bare frame")
    k_c_uncertainty: float | None = quantity(None, "N/m", EXPANDED)
    k_c_nominal_n_m: float | None = quantity(None, "N/m", "nominal stiffness on the label")
    beta_mounted: float | None = quantity(
        None, "1", "stiffness of the spring relative to that of the first storey, k_C/k1"
    )
    beta_uncertainty: float | None = quantity(None, "1", EXPANDED)
    k1_with_spring_n_m: float = quantity(..., "N/m", "stiffness of the first storey, including the spring")
    k1_with_spring_uncertainty: float = quantity(..., "N/m", EXPANDED)
    k2_n_m: float = decay_field("k2_n_m")
    k2_uncertainty: float = decay_field("k2_uncertainty")
    k2_agrees: bool | None = quantity(
        None,
        "",
        "whether the difference from k2 of the bare frame is insignificant (99 %); absent if not compared",
    )
    k_c_parts: str = quantity("", "", "standard uncertainty of k_C by contribution, largest first, as JSON")
    xi1: float = decay_field("xi1")
    xi1_uncertainty: float = decay_field("xi1_uncertainty")
    xi2: float = decay_field("xi2")
    xi2_uncertainty: float = decay_field("xi2_uncertainty")
    omega1_rad_s: float = decay_field("omega1_rad_s")
    omega1_uncertainty: float = decay_field("omega1_uncertainty")
    omega2_rad_s: float = decay_field("omega2_rad_s")
    omega2_uncertainty: float = decay_field("omega2_uncertainty")
    drift_peak_m: float = decay_field("drift_peak_m")
    residual_m: float = decay_field("residual_m")
    birge: float | None = decay_field("birge")


PROTOCOL = Protocol(
    name="coupling-stiffness",
    summary="Stiffness of mounted springs, from the shift of the frame's modes with the block clamped.",
    details=(
        "Decays are measured with the bare frame, then with each spring mounted and the block clamped to the "
        "table, so that the spring adds to the stiffness of the first storey. The difference is the stiffness of "
        "the spring and determines beta as mounted. Other runs load the result, specimen.json."
    ),
    example="--beta 0.4 --specimen FILE",
    parameters=CouplingStiffnessParameters,
    point=SpringPoint,
    prepare=deferred("protocols.coupling_stiffness.experiment:CouplingStiffness"),
    figures=("coupling_stiffness.png",),
    files=("specimen.json",),
    report=deferred("protocols.coupling_stiffness.results:springs_sections"),
    view=RunView(
        headline="k_c_n_m",
        labels={
            "k_c_n_m": "stiffness of the spring",
            "beta": "β on the label",
            "beta_mounted": "β as mounted",
            "k1_with_spring_n_m": "stiffness k₁ with the spring",
            "k2_n_m": "stiffness k₂",
            "xi1": "damping ξ₁",
            "xi2": "damping ξ₂",
            "omega1_rad_s": "frequency ω₁",
            "omega2_rad_s": "frequency ω₂",
        },
        live=deferred("protocols.coupling_stiffness.live:springs_view"),
    ),
)
