"""What the laser calibration asks for."""

from sim.parameters import Parameters, quantity


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
