"""Correction of the readings of checked lasers for their expected linearity errors.

The harmonics of the bare frame tell the curvature of a laser's error curve over the swing of the check. The expected
error (`bench.analysis.linearity.expected_errors`) tends to a constant far outside the swing, minus the expected error
at rest; the rest of the error is part of the uncertainty of `SensorUncertainty.corrected_by` the same checks. A change
of scale causes no harmonics: it is neither found nor corrected.

The readings of calibrated lasers have been corrected by their curves, which hold the error constant beyond the
calibrated readings. There it is continued by the expected error relative to that at the nearer end.

Where the errors were found in the tests themselves (`bench.analysis.laser_curves`), these are subtracted.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bench.analysis.linearity import expected_errors
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.signals import DRIFT, LASER_1, LASER_2, U1

Array = NDArray[np.float64]

PLACES = 513
"""Number of readings at which the expected errors are computed, from one range below the rest position to one above: 16
for the shortest of the assumed waves.
"""


@dataclass(frozen=True)
class ReadingCorrection:
    """Correction according to the curves or the checks of `sensors` or, beyond the calibrated readings, according to
    their calibration.
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
        if self.sensors.curves is not None:
            return self.sensors.curves.expected(laser, readings)
        return np.interp(readings, *self._curves[laser])

    @cached_property
    def _curves(self) -> Sequence[tuple[Array, Array]]:
        """Readings and expected errors [m] of each laser."""
        return [self._curve(laser) for laser in (0, 1)]

    def _curve(self, laser: int) -> tuple[Array, Array]:
        whole, calibration = self.sensors.ranges[laser], self.sensors.calibration
        limit, places = self.sensors.accuracy.laser_linearity * whole, np.linspace(-whole, whole, PLACES)
        if calibration is None:
            return places, expected_errors(places, limit, whole, self.sensors.checks_of(laser))
        curve = calibration.lasers[laser]
        low, high = curve.lowest - curve.rest, curve.highest - curve.rest
        places = np.concatenate((places[places < low], [low, high], places[places > high]))
        errors = expected_errors(places, limit, whole, [curve.harmonics])
        # the calibration has corrected the covered readings, and the others for the error at the nearer end
        return places, errors - np.where(places <= low, *np.interp([low, high], places, errors))
