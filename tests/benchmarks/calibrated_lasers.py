"""Accuracy of laser calibrations: drawn lasers and table sensors, calibrated as the protocol does, for `audit`."""

from dataclasses import replace
from math import hypot

import numpy as np

from protocols.laser_calibration.polynomial import values
from tests.benchmarks import coverage
from tests.benchmarks.coverage_sensors import CASES, Array, Sensors
from tests.benchmarks.estimates import Estimate

NAMES = {
    "table": "scale of the accelerometer",
    "ratio": "scale of laser 2 against laser 1",
    "curve": "corrected laser 2 against laser 1",
    "reference": "error of the table's displacement sensor",
}
"""Symbols of the estimates."""

PLACES: Array = np.linspace(-0.045, 0.045, 181)
"""Displacements from rest at which both lasers are compared [m], within the calibrated range."""


def calibrated(seed: int, case: str) -> dict[str, Estimate]:
    """Scale of the accelerometer, and ratio of the lasers' scales over `PLACES`. At drawn places, relative to the mean:
    difference of the lasers' corrected readings [m], and error of the table's displacement sensor [m], minus the
    straight line through its ends.
    """
    drawn = replace(CASES[case], calibrated=True)
    sensors, (found, reference) = Sensors(seed, drawn), coverage.calibrated(seed, drawn)
    errors: list[Array] = [
        curve.corrected(sensors.reading(number, PLACES)) - PLACES for number, curve in enumerate(found.lasers)
    ]
    apart = errors[1] - errors[0]
    span = float(PLACES[-1] - PLACES[0])
    random = np.random.default_rng([seed, 6])
    place = int(random.integers(PLACES.size))
    curve = values(reference.error)
    readings = np.linspace(reference.low, reference.high, curve.size)
    true = sensors.true_reference_error(readings)
    true -= np.linspace(true[0], true[-1], true.size)
    other = int(random.integers(curve.size))
    return {
        "table": Estimate(found.table_acceleration, found.table_uncertainty, 1.0 / sensors.table),
        "ratio": Estimate(1.0 + float(apart[-1] - apart[0]) / span, found.differential_uncertainty, 1.0),
        "curve": Estimate(float(apart[place] - apart.mean()), hypot(*(each.uncertainty for each in found.lasers)), 0.0),
        "reference": Estimate(
            float(curve[other] - curve.mean()), reference.uncertainty, float(true[other] - true.mean())
        ),
    }
