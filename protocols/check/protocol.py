"""The loop check: parameters with their tolerances, and the protocol."""

from typing import TYPE_CHECKING, Annotated

from pydantic import Field, field_validator

from bench.analysis.check_line import CheckLine
from bench.protocol import Prepared, Protocol, Sources
from protocols.check.results import log_line
from sim.parameters import Parameters, each_once, quantity

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration

Frequency = Annotated[float, Field(gt=0, le=60)]


class CheckParameters(Parameters):
    """Loop check: the bench at rest, then sines of one velocity with the frame locked to the table."""

    omega: tuple[Frequency, ...] = quantity(
        (8.0, 12.0, 18.0, 27.0, 40.0), "rad/s", "circular frequencies of the sines", min_length=4
    )

    _each_once = field_validator("omega")(each_once)

    velocity: float = quantity(
        0.06, "m/s", "amplitude of the table's velocity: the same at every frequency", gt=0, le=0.5
    )
    cycles: int = quantity(8, "1", "cycles that are measured at each frequency", ge=4, le=200)
    rest: float = quantity(2.0, "s", "time at rest over which noise and valid samples are counted", ge=0.5, le=60)
    displacement_noise: float = quantity(
        1e-4, "m", "largest standard deviation of the table's displacement at rest", gt=0
    )
    acceleration_noise: float = quantity(
        0.02, "m/s2", "largest standard deviation of the table's acceleration at rest", gt=0
    )
    scale_tolerance: float = quantity(0.02, "1", "largest relative difference between two sensors", gt=0, lt=0.5)
    drive_tolerance: float = quantity(
        0.25, "1", "largest relative difference between measured and expected drive", gt=0, lt=1
    )
    latency: float = quantity(0.02, "s", "longest dead time from drive to sample", gt=0, le=1)
    u1_error: float = quantity(
        0.01, "1", "largest error of u1, relative to itself, that a laser's delay may cause", gt=0, lt=0.5
    )
    highest_omega: float = quantity(
        20.0, "rad/s", "highest frequency of the tests to come: there a delay does most harm", gt=0, le=60
    )


def _prepare(
    parameters: CheckParameters, configuration: "BenchConfiguration", stored: "Sources | None"
) -> Prepared[CheckParameters]:
    from protocols.check.experiment import LoopCheck

    return LoopCheck(parameters, configuration, stored)


PROTOCOL = Protocol(
    name="check",
    summary="Check the loop of the configured bench at low level, line by line: passed or failed, and what to do.",
    details=(
        "Listens to every channel at rest, then drives sines of one velocity with the frame locked to the table, and "
        "compares polarity, scale and delay of all sensors, and the drive. The exit code is 1 also when a line failed."
    ),
    example="--config bench.toml",
    parameters=CheckParameters,
    point=CheckLine,
    prepare=_prepare,
    figures=("margins.png",),
    log_line=log_line,
)
