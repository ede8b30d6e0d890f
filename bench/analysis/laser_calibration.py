"""Calibration of the two lasers and, against the lasers, of the table's sensors; correction of laser readings.

A laser's error is a Chebyshev polynomial in its reading over the covered readings, and constant beyond them. The
table's sensors have one factor each: true = factor times reading.
"""

from collections.abc import Mapping
from datetime import datetime, timedelta
from functools import cached_property
from math import sqrt, tau

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from pydantic import AwareDatetime, model_validator

from bench.analysis.error_curve import Harmonics
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity

Array = NDArray[np.float64]

ORDERS, PLACES = 20, 96
"""Highest order that a calibration determines, and number of readings at which it tells the error curve."""


class LaserCurve(Parameters):
    """Error of one laser [m] as a function of its reading [m] relative to mid range."""

    sensor: str = quantity(..., "", "description of the laser in the data file of its calibration")
    lowest: float = quantity(..., "m", "smallest reading covered", usual=(1e-3, 1.0))
    highest: float = quantity(..., "m", "largest reading covered", usual=(1e-3, 1.0))
    rest: float = quantity(..., "m", "reading with the storey at rest", usual=(1e-6, 0.1))
    error: tuple[float, ...] = quantity(
        ...,
        "m",
        "Chebyshev coefficients of the laser's error over the covered readings",
        min_length=2,
        usual=(0.0, 2e-3),
    )
    uncertainty: float = quantity(
        ..., "m", "standard uncertainty of the laser's error at one reading", ge=0, usual=(1e-7, 1e-3)
    )
    scale: float = quantity(..., "1", "span of the laser's readings, relative to the mean span of both lasers")
    delay: float = quantity(..., "s", "delay relative to the table's displacement sensor", usual=(1e-5, 0.05))
    delay_uncertainty: float = quantity(..., "s", "standard uncertainty of the delay", ge=0, usual=(1e-7, 1e-3))

    @model_validator(mode="after")
    def _covers_something(self) -> "LaserCurve":
        if not self.lowest < self.highest:
            raise InvalidInput("lowest", self.lowest, f"it must be below highest = {self.highest:g} m")
        return self

    def covers(self, displacements: Array) -> bool:
        """Whether all `displacements` from rest [m] are covered; NaN counts as covered."""
        least, greatest = np.nanmin(displacements, initial=0.0), np.nanmax(displacements, initial=0.0)
        return bool(self.lowest - self.rest <= least and greatest <= self.highest - self.rest)

    def corrected(self, readings: Array) -> Array:
        """Readings [m] corrected for the laser's error, same shape; NaN remains NaN."""
        place = (2.0 * readings - self.highest - self.lowest) / (self.highest - self.lowest)
        return readings - chebyshev.chebval(np.clip(place, -1.0, 1.0), np.array(self.error))

    @cached_property
    def harmonics(self) -> Harmonics:
        """Harmonics that the readings of this laser would have during a sine over the covered readings: the Chebyshev
        coefficients of its error, of which those that were not fitted are zero.
        """
        middle, half = 0.5 * (self.lowest + self.highest) - self.rest, 0.5 * (self.highest - self.lowest)
        found = np.zeros(max(ORDERS, len(self.error) - 1), dtype=np.complex128)
        found[: len(self.error) - 1] = self.error[1:]
        # the mean square of a sum of cosines is half the sum of their squares
        uncertainty = np.full(found.size, self.uncertainty * sqrt(2.0 / found.size))
        phases = np.arange(PLACES) * (tau / PLACES)
        return Harmonics(middle + half * np.cos(phases), found, uncertainty, first=1)


class LaserCalibration(Parameters):
    """Calibration of both lasers from one motion. All uncertainties are standard uncertainties."""

    date: AwareDatetime = quantity(..., "", "date of the measurement")
    valid_days: float = quantity(..., "d", "period of validity", gt=0, usual=(7.0, 1100.0))
    laser_1: LaserCurve
    laser_2: LaserCurve
    differential_scale: float = quantity(..., "1", "ratio of the scales of laser 2 and laser 1, before the correction")
    differential_uncertainty: float = quantity(
        ..., "1", "standard uncertainty of the ratio of the scales, after the correction", ge=0
    )
    common_linearity: float = quantity(
        ...,
        "m",
        "largest smooth error common to both corrected lasers, which is that of the reference sensor",
        usual=(1e-8, 1e-3),
    )
    table_displacement: float = quantity(..., "1", "ratio of true to measured displacement of the table", gt=0)
    table_acceleration: float = quantity(..., "1", "ratio of true to measured acceleration of the table", gt=0)
    table_uncertainty: float = quantity(..., "1", "standard uncertainty common to both factors", ge=0)

    @property
    def lasers(self) -> tuple[LaserCurve, LaserCurve]:
        """The curves of the lasers on storey 1 and storey 2."""
        return self.laser_1, self.laser_2

    @property
    def expires(self) -> datetime:
        """Date and time at which the calibration ceases to be valid."""
        return self.date + timedelta(days=self.valid_days)

    def expired(self, now: datetime) -> str | None:
        """Warning if the calibration has expired at `now`, which must have a time zone; None while it is valid."""
        if now <= self.expires:
            return None
        return (
            f"the laser calibration of {self.date:%Y-%m-%d} expired on {self.expires:%Y-%m-%d} and is still "
            "applied: calibrate again with `rockbench run laser-calibration`"
        )

    def strange(self, devices: Mapping[str, str]) -> tuple[str, ...]:
        """Warnings about `devices` (by channel) that differ from the calibrated lasers."""
        return tuple(
            f"the laser calibration is for {name} = {curve.sensor}, but the mounted laser is {devices[name]}: "
            "calibrate again with `rockbench run laser-calibration`"
            for name, curve in (("laser_1", self.laser_1), ("laser_2", self.laser_2))
            if name in devices and devices[name] != curve.sensor
        )
