"""What a calibration found of the two lasers, and of the table's sensors against them: applied to what they say.

A laser's error is a Chebyshev polynomial of its reading over the readings that were covered; beyond them it is held at
its value there. The table's sensors are told by one factor each: true = factor times shown.
"""

from collections.abc import Mapping
from datetime import datetime, timedelta

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from pydantic import AwareDatetime, model_validator

from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity

Array = NDArray[np.float64]


class LaserCurve(Parameters):
    """What one laser says too much, by its reading [m] from the middle of its range."""

    sensor: str = quantity(..., "", "the laser, as the data file of its calibration names it")
    lowest: float = quantity(..., "m", "least reading that was covered", usual=(1e-3, 1.0))
    highest: float = quantity(..., "m", "greatest reading that was covered", usual=(1e-3, 1.0))
    rest: float = quantity(..., "m", "reading with the storey at rest", usual=(1e-6, 0.1))
    error: tuple[float, ...] = quantity(
        ...,
        "m",
        "Chebyshev coefficients, over the covered readings, of what the laser says too much",
        min_length=2,
        usual=(0.0, 2e-3),
    )
    uncertainty: float = quantity(
        ..., "m", "standard uncertainty of that error at one reading", ge=0, usual=(1e-6, 1e-3)
    )
    scale: float = quantity(..., "1", "span of its readings over that of the motion, the mean of both lasers' being 1")
    delay: float = quantity(..., "s", "by how much later than the table's displacement it was", usual=(1e-5, 0.05))
    delay_uncertainty: float = quantity(..., "s", "standard uncertainty of the delay", ge=0, usual=(1e-7, 1e-3))

    @model_validator(mode="after")
    def _covers_something(self) -> "LaserCurve":
        if not self.lowest < self.highest:
            raise InvalidInput("lowest", self.lowest, f"it must be below highest = {self.highest:g} m")
        return self

    def corrected(self, readings: Array) -> Array:
        """Readings [m] without the laser's error, same shape; NaN stays NaN."""
        place = (2.0 * readings - self.highest - self.lowest) / (self.highest - self.lowest)
        return readings - chebyshev.chebval(np.clip(place, -1.0, 1.0), np.array(self.error))


class LaserCalibration(Parameters):
    """Both lasers calibrated against one motion. Standard uncertainties throughout."""

    date: AwareDatetime = quantity(..., "", "when it was measured")
    valid_days: float = quantity(..., "d", "how long it is good for", gt=0, usual=(7.0, 1100.0))
    laser_1: LaserCurve
    laser_2: LaserCurve
    differential_scale: float = quantity(..., "1", "scale of laser 2 over that of laser 1, before the correction")
    differential_uncertainty: float = quantity(..., "1", "what the correction leaves open of it", ge=0)
    common_linearity: float = quantity(
        ...,
        "m",
        "largest smooth error that both corrected lasers may share: that of the sensor they were held against",
        usual=(1e-6, 1e-3),
    )
    table_displacement: float = quantity(..., "1", "true over shown displacement of the table", gt=0)
    table_acceleration: float = quantity(..., "1", "true over shown acceleration of the table", gt=0)
    table_uncertainty: float = quantity(..., "1", "standard uncertainty of both factors, which share it", ge=0)

    @property
    def lasers(self) -> tuple[LaserCurve, LaserCurve]:
        """Those of storey 1 and storey 2."""
        return self.laser_1, self.laser_2

    @property
    def expires(self) -> datetime:
        """When it is no longer good."""
        return self.date + timedelta(days=self.valid_days)

    def expired(self, now: datetime) -> str | None:
        """What is to be said of its age at `now`, which has a time zone; None while it is good."""
        if now <= self.expires:
            return None
        return (
            f"the laser calibration of {self.date:%Y-%m-%d} was good until {self.expires:%Y-%m-%d}, and is applied "
            "all the same: calibrate again with `rockbench run laser-calibration`"
        )

    def strange(self, devices: Mapping[str, str]) -> tuple[str, ...]:
        """What is to be said where `devices`, by channel, are not those that were calibrated."""
        return tuple(
            f"the laser calibration is for {name} = {curve.sensor}, this one is {devices[name]}: "
            "calibrate again with `rockbench run laser-calibration`"
            for name, curve in (("laser_1", self.laser_1), ("laser_2", self.laser_2))
            if name in devices and devices[name] != curve.sensor
        )
