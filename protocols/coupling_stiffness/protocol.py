"""The stiffness of mounted springs: parameters, the result of a spring, and the protocol."""

from typing import TYPE_CHECKING, Annotated

from pydantic import Field, field_validator

from bench.protocol import Prepared, Protocol, Sources
from protocols.common.decays.parameters import DecayParameters
from sim.parameters import COUPLING, Parameters, each_once, quantity

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration

Stiffness = Annotated[float, Field(gt=0, le=100)]


class CouplingStiffnessParameters(DecayParameters):
    """Decays of the frame with each spring mounted on a block that is held, and of the bare frame before."""

    beta: tuple[Stiffness, ...] = quantity(
        (0.25, 0.64, 0.97), "1", "stiffness ratios on the labels of the springs", min_length=1, usual=COUPLING
    )
    repeats: int = quantity(3, "1", "decays that are combined, of each spring and of the bare frame", ge=1, le=50)
    reference: bool = quantity(
        True,
        "",
        "begin with the bare frame, so that what both have in common cancels; else k1 is taken as identified before",
    )

    _each_once = field_validator("beta")(each_once)


_U = "its expanded uncertainty (k = 2)"


class SpringPoint(Parameters):
    """A spring, or the bare frame that its decays are compared with, from one decay or from all of them."""

    beta: float | None = quantity(None, "1", "stiffness ratio on the label of the spring; absent for the bare frame")
    decay: int = quantity(..., "1", "number of the decay, from 1; 0 for all of them together", ge=0)
    decays: int = quantity(..., "1", "decays in it", ge=1)
    k_c_n_m: float | None = quantity(None, "N/m", "stiffness of the spring as mounted; absent for the bare frame")
    k_c_uncertainty: float | None = quantity(None, "N/m", _U)
    k_c_nominal_n_m: float | None = quantity(None, "N/m", "what the label promises")
    beta_mounted: float | None = quantity(None, "1", "stiffness of the spring over that of the first storey, k_C/k1")
    beta_uncertainty: float | None = quantity(None, "1", _U)
    k1_with_spring_n_m: float = quantity(..., "N/m", "stiffness of the first storey, that of the spring in it")
    k1_with_spring_uncertainty: float = quantity(..., "N/m", _U)
    k2_n_m: float = quantity(..., "N/m", "stiffness of the second storey")
    k2_uncertainty: float = quantity(..., "N/m", _U)
    k2_agrees: bool | None = quantity(
        None,
        "",
        "whether k2 is that of the bare frame within the uncertainty of the difference; absent where not compared",
    )
    k_c_parts: str = quantity("", "", "standard uncertainty of k_C by part, largest first, as JSON")
    xi1: float = quantity(..., "1", "damping ratio of the first mode")
    xi1_uncertainty: float = quantity(..., "1", _U)
    xi2: float = quantity(..., "1", "damping ratio of the second mode")
    xi2_uncertainty: float = quantity(..., "1", _U)
    omega1_rad_s: float = quantity(..., "rad/s", "undamped circular frequency of the first mode")
    omega1_uncertainty: float = quantity(..., "rad/s", _U)
    omega2_rad_s: float = quantity(..., "rad/s", "undamped circular frequency of the second mode")
    omega2_uncertainty: float = quantity(..., "rad/s", _U)
    drift_peak_m: float = quantity(..., "m", "largest drift")
    residual_m: float = quantity(..., "m", "root mean square of what the fit leaves of the lasers' signals")
    birge: float | None = quantity(
        None, "1", "largest Birge ratio: scatter of the decays over their own uncertainty; absent for one decay"
    )


def _prepare(
    parameters: CouplingStiffnessParameters, configuration: "BenchConfiguration", stored: "Sources | None"
) -> Prepared[CouplingStiffnessParameters]:
    from protocols.coupling_stiffness.experiment import CouplingStiffness

    return CouplingStiffness(parameters, configuration, stored)


PROTOCOL = Protocol(
    name="coupling-stiffness",
    summary="Stiffness of mounted springs, from the shift of the frame's modes with the block held.",
    details=(
        "Decays of the bare frame, then with each spring mounted and its block clamped to the table: the spring "
        "adds to the stiffness of the first storey. Its stiffness is the difference, and beta as mounted follows. "
        "The result, specimen.json, is what other runs load."
    ),
    example="--beta 0.4 --specimen FILE",
    parameters=CouplingStiffnessParameters,
    point=SpringPoint,
    prepare=_prepare,
    figures=("coupling_stiffness.png",),
    files=("specimen.json",),
)
