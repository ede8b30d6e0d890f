"""What a calibration found of one sensor."""

from collections.abc import Iterator

from bench.analysis.budget import COVERAGE
from bench.analysis.laser_calibration import LaserCalibration
from sim.parameters import Parameters, quantity


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


def sensors(found: LaserCalibration) -> Iterator[CalibratedSensor]:
    """A row for each sensor, and one for the lasers against each other."""
    import numpy as np

    for name, laser in (("laser_1", found.laser_1), ("laser_2", found.laser_2)):
        at = np.linspace(laser.lowest, laser.highest, 201)
        error = at - laser.corrected(at)
        yield CalibratedSensor(
            sensor=name,
            scale=laser.scale,
            scale_uncertainty=COVERAGE * found.differential_uncertainty,
            lowest_m=laser.lowest,
            highest_m=laser.highest,
            order=len(laser.error) - 1,
            largest_error_m=float(np.abs(error - error.mean()).max()),
            residual_m=COVERAGE * laser.uncertainty,
            delay_s=laser.delay,
            delay_uncertainty_s=COVERAGE * laser.delay_uncertainty,
        )
    yield CalibratedSensor(
        sensor="laser_2 / laser_1",
        scale=found.differential_scale,
        scale_uncertainty=COVERAGE * found.differential_uncertainty,
    )
    for name, factor in (
        ("table_displacement", found.table_displacement),
        ("table_acceleration", found.table_acceleration),
    ):
        uncertainty = COVERAGE * found.table_uncertainty / factor
        yield CalibratedSensor(sensor=name, scale=1.0 / factor, scale_uncertainty=uncertainty)
