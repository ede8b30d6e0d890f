"""Accuracy of the sensors from data sheets and calibrations."""

from sim.parameters import Parameters, quantity


class SensorAccuracy(Parameters):
    """Accuracy of the sensors from data sheets and calibrations. Relative errors of scales, of a laser's slope and of
    the timebase are standard uncertainties; the other values are limits.
    """

    laser_slope: float = quantity(
        0.003, "1", "relative error of one laser's slope over its motion, due to linearity", ge=0, le=0.1
    )
    laser_mismatch: float = quantity(
        0.001, "1", "relative difference between the scales of the two lasers", ge=0, le=0.1
    )
    laser_resolution: float = quantity(5e-5, "m", "smallest step of a laser's output", ge=0, le=0.01)
    laser_timing: float = quantity(
        2.5e-4, "s", "wander of a laser's delay due to its free-running clock: one measuring period", ge=0, le=0.01
    )
    laser_linearity: float = quantity(
        0.0008, "1", "largest linearity error of a laser relative to its range, from its data sheet", ge=0, le=0.05
    )
    table_scale: float = quantity(
        0.005,
        "1",
        "relative error of the scales of the table's accelerometer and displacement sensor; in a laser calibration, "
        "that of the accelerometer as a standard of length",
        ge=0,
        le=0.1,
    )
    timebase: float = quantity(
        3e-5, "1", "relative error of the sample clock: limits of 50 ppm, divided by sqrt(3)", ge=0, le=0.01
    )
