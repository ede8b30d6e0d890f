"""The rows of a calibration: each sensor against the mean span of both lasers."""

from collections.abc import Iterator

import numpy as np

from bench.analysis.budget import COVERAGE
from bench.analysis.laser_calibration import LaserCalibration
from protocols.laser_calibration.protocol import CalibratedSensor


def sensors(found: LaserCalibration) -> Iterator[CalibratedSensor]:
    """A row for each sensor, and one for the lasers against each other."""
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
