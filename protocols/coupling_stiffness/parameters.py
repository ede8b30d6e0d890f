"""What the test of the springs asks for: declared once, used by command line, file and documentation."""

from typing import Annotated

from pydantic import Field, field_validator

from protocols.free_vibration.parameters import DecayParameters
from sim.parameters import COUPLING, each_once, quantity

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
