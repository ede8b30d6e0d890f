"""Correction of the readings of checked lasers for their expected linearity errors.

The harmonics of the bare frame tell the curvature of a laser's error curve over the swing of the check. The expected
error (`bench.analysis.linearity.expected_errors`) tends to a constant far outside the swing, minus the expected error
at rest; the rest of the error is part of the uncertainty of `SensorUncertainty.corrected_by` the same checks. A change
of scale causes no harmonics: it is neither found nor corrected.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bench.analysis.linearity import expected_errors
from bench.analysis.sensor_accuracy import SensorUncertainty
from bench.analysis.signals import DRIFT, LASER_1, LASER_2, U1

Array = NDArray[np.float64]

PLACES = 513
"""Number of readings at which the expected errors are computed, from one range below the rest position to one above: 16
for the shortest of the assumed waves.
"""


@dataclass(frozen=True)
class ReadingCorrection:
    """Correction according to the checks of `sensors`; none without checks, or with a calibration, which has corrected
    the readings before.
    """

    sensors: SensorUncertainty

    def __call__(self, signals: Array) -> Array:
        """A copy of `signals`, shape (n, n_signals), with corrected readings, u1 and drift; the same object if nothing
        is corrected.
        """
        if not self.sensors.corrected:
            return signals
        corrected = signals.copy()
        errors = [self.expected(laser, signals[:, column]) for laser, column in enumerate((LASER_1, LASER_2))]
        corrected[:, LASER_1] -= errors[0]
        corrected[:, LASER_2] -= errors[1]
        corrected[:, U1] -= errors[0]
        corrected[:, DRIFT] -= errors[1] - errors[0]
        return corrected

    def expected(self, laser: int, readings: Array) -> Array:
        """Expected errors [m] of laser 0 or 1, shape (n,), which are subtracted from its `readings` [m]."""
        if not self.sensors.corrected:
            return np.zeros(readings.size)
        return np.interp(readings, *self._curves[laser])

    @cached_property
    def _curves(self) -> Sequence[tuple[Array, Array]]:
        """Readings and expected errors [m] of each laser."""
        found = list[tuple[Array, Array]]()
        for laser, whole in enumerate(self.sensors.ranges):
            places = np.linspace(-whole, whole, PLACES)
            limit = self.sensors.accuracy.laser_linearity * whole
            found.append((places, expected_errors(places, limit, whole, self.sensors.checks_of(laser))))
        return found
