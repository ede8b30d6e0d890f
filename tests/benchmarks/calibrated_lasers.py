"""Accuracy of laser calibrations: drawn lasers and table sensors, calibrated as the protocol does, for `audit`."""

from dataclasses import replace
from math import hypot

import numpy as np

from tests.benchmarks.coverage import calibration_of
from tests.benchmarks.coverage_sensors import CASES, Array, Sensors
from tests.benchmarks.estimates import Estimate

NAMES = {
    "table": "scale of the accelerometer",
    "ratio": "scale of laser 2 against laser 1",
    "curve": "corrected laser 2 against laser 1",
}
"""Symbols of the estimates."""

PLACES: Array = np.linspace(-0.045, 0.045, 181)
"""Displacements from rest at which both lasers are compared [m], within the calibrated range."""


def calibrated(seed: int, case: str) -> dict[str, Estimate]:
    """Scale of the accelerometer, ratio of the lasers' scales over `PLACES`, and the difference of their corrected
    readings [m] at a drawn place, relative to its mean.
    """
    drawn = replace(CASES[case], calibrated=True)
    sensors, found = Sensors(seed, drawn), calibration_of(seed, drawn)
    errors: list[Array] = [
        curve.corrected(sensors.reading(number, PLACES)) - PLACES for number, curve in enumerate(found.lasers)
    ]
    apart = errors[1] - errors[0]
    span = float(PLACES[-1] - PLACES[0])
    place = int(np.random.default_rng([seed, 6]).integers(PLACES.size))
    return {
        "table": Estimate(found.table_acceleration, found.table_uncertainty, 1.0 / sensors.table),
        "ratio": Estimate(1.0 + float(apart[-1] - apart[0]) / span, found.differential_uncertainty, 1.0),
        "curve": Estimate(float(apart[place] - apart.mean()), hypot(*(each.uncertainty for each in found.lasers)), 0.0),
    }
