"""The laser calibration: parameters, the result of a sensor, and the protocol."""

from typing import TYPE_CHECKING

from bench.protocol import Prepared, Protocol, Sources
from sim.parameters import Parameters, quantity

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration


class LaserCalibrationParameters(Parameters):
    """Slow sines of the table with the frame locked to it: all sensors see one motion."""

    amplitude: float = quantity(
        0.050, "m", "amplitude of the first pass: readings beyond it stay uncalibrated", gt=0.001, le=1
    )
    omega: float = quantity(
        8.0,
        "rad/s",
        "circular frequency of half the passes; the others have half of it, which tells what the clamps yield",
        ge=1,
        le=20,
    )
    passes: int = quantity(
        8, "1", "passes, each 1 % smaller than the one before so that its roundings are others", ge=6, le=20
    )
    cycles: int = quantity(6, "1", "cycles that are measured in each pass", ge=4, le=100)
    reference_linearity: float = quantity(
        0.0005,
        "1",
        "largest linearity error of the table's displacement sensor over what is covered, as on its data sheet",
        ge=0,
        le=0.05,
    )
    valid_days: float = quantity(365.0, "d", "how long the calibration is good for", gt=0, le=3650)


class CalibratedSensor(Parameters):
    """One sensor against the mean span of both lasers. What does not exist is absent. Uncertainties are expanded
    (k = 2).
    """

    sensor: str = quantity(..., "", "channel, or laser_2 / laser_1 for the two against each other")
    scale: float = quantity(..., "1", "what it shows over what is true")
    scale_uncertainty: float = quantity(..., "1", "expanded uncertainty of the scale (k = 2)")
    lowest_m: float | None = quantity(None, "m", "least reading that was covered")
    highest_m: float | None = quantity(None, "m", "greatest reading that was covered")
    order: int | None = quantity(None, "1", "order of the polynomial of its error")
    largest_error_m: float | None = quantity(None, "m", "largest error that is taken away, its mean left out")
    residual_m: float | None = quantity(None, "m", "expanded uncertainty of the error at one reading (k = 2)")
    delay_s: float | None = quantity(None, "s", "by how much later it is than the table's displacement")
    delay_uncertainty_s: float | None = quantity(None, "s", "expanded uncertainty of the delay (k = 2)")


def _prepare(
    parameters: LaserCalibrationParameters, configuration: "BenchConfiguration", stored: "Sources | None"
) -> Prepared[LaserCalibrationParameters]:
    from protocols.laser_calibration.experiment import LaserCalibrationRun

    return LaserCalibrationRun(parameters, configuration, stored)


PROTOCOL = Protocol(
    name="laser-calibration",
    summary="Calibrate both lasers, and the table's sensors, against one slow motion with the frame locked.",
    details=(
        "The storeys are clamped to the table, which moves slowly over the range that the tests see. Scale, smooth "
        "linearity error and delay of each laser follow, and how far the two agree. The result, "
        "laser_calibration.json, is what `laser_calibration` in the configuration of other runs names. Without "
        "options: eight passes of 50 mm, about four minutes."
    ),
    example="--config bench.toml",
    parameters=LaserCalibrationParameters,
    point=CalibratedSensor,
    prepare=_prepare,
    figures=("laser_errors.png",),
    files=("laser_calibration.json",),
)
