"""What free rocking asks for: declared once, used by command line, file and documentation."""

from typing import Annotated, Literal

from pydantic import Field, field_validator

from sim.parameters import Parameters, each_once, quantity

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
