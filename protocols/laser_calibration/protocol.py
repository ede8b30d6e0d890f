"""Calibration of both lasers against a common motion of the table with the frame locked."""

from bench.protocol import Protocol, RunView, deferred
from sim.parameters import Parameters, quantity


class LaserCalibrationParameters(Parameters):
    """Slow sines of the table with the frame locked to it, so that all sensors measure the same motion."""

    amplitude: float = quantity(
        0.050, "m", "amplitude of the first pass; only readings covered by all passes are calibrated", gt=0.001, le=1
    )
    omega: float = quantity(
        8.0,
        "rad/s",
        "circular frequency of half of the passes; the others use half this frequency, to determine the "
        "compliance of the clamps",
        ge=1,
        le=20,
    )
    passes: int = quantity(
        8,
        "1",
        "number of passes; the amplitude decreases by 1 % per pass, so that quantisation errors differ",
        ge=6,
        le=20,
    )
    cycles: int = quantity(6, "1", "number of cycles measured in each pass", ge=4, le=100)
    reference_linearity: float = quantity(
        0.0005,
        "1",
        "largest linearity error of the table's displacement sensor over the covered range, from its data sheet",
        ge=0,
        le=0.05,
    )
    valid_days: float = quantity(365.0, "d", "validity of the calibration", gt=0, le=3650)


class CalibratedSensor(Parameters):
    """Calibration of a sensor: lasers relative to the mean span of both, sensors of the table relative to the weighted
    mean of lasers and accelerometer. Values that do not apply are absent. Uncertainties are expanded (k = 2).
    """

    sensor: str = quantity(..., "", "channel, or laser_2 / laser_1 for the ratio of the lasers")
    scale: float = quantity(..., "1", "ratio of reading to reference")
    scale_uncertainty: float = quantity(..., "1", "expanded uncertainty of the scale (k = 2)")
    lowest_m: float | None = quantity(None, "m", "smallest covered reading")
    highest_m: float | None = quantity(None, "m", "largest covered reading")
    order: int | None = quantity(None, "1", "order of the error polynomial")
    largest_error_m: float | None = quantity(None, "m", "largest error, excluding its mean; corrected for lasers")
    residual_m: float | None = quantity(None, "m", "expanded uncertainty of the error at one reading (k = 2)")
    delay_s: float | None = quantity(None, "s", "delay relative to the table's displacement")
    delay_uncertainty_s: float | None = quantity(None, "s", "expanded uncertainty of the delay (k = 2)")


PROTOCOL = Protocol(
    name="laser-calibration",
    summary="Calibrate both lasers and the table's sensors against each other in a slow motion with the frame locked.",
    details=(
        "The storeys are clamped to the table, which moves slowly over the range to be calibrated. The result is "
        "the scale, the linearity error and the delay of each laser, and the agreement between the lasers. "
        "To apply the result, laser_calibration.json, in other runs, set the key `laser_calibration` in their "
        "configuration to its path. "
        "Without options, a run has eight passes of up to 50 mm and takes about four minutes."
    ),
    example="--config bench.toml",
    parameters=LaserCalibrationParameters,
    point=CalibratedSensor,
    prepare=deferred("protocols.laser_calibration.experiment:LaserCalibrationRun"),
    figures=("laser_errors.png",),
    files=("laser_calibration.json",),
    view=RunView(
        headline="scale",
        labels={"scale": "scale", "delay_s": "delay"},
        live=deferred("protocols.laser_calibration.live:error_view"),
    ),
)
