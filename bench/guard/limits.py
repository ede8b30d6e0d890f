"""Limits of table, shaker, specimen and sensors, their debounce, and the ramps that bring the output to zero."""

from dataclasses import dataclass
from math import pi
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity

_SHARE = "fraction of the limit at which the operator is warned"
_PERSISTENCE = "time for which the limit must be exceeded before it trips"


DEBOUNCE = (1e-3, 0.05)
"""Usual debounce of a limit [s]: typically longer than a single spike, and shorter than the time in which the table
moves from a limit to the end of its stroke.
"""


class Warnings(Parameters):
    """Fraction of each limit at which the operator is warned, once per run."""

    displacement: float = quantity(0.9, "1", f"displacement of the table: {_SHARE}", gt=0, le=1)
    velocity: float = quantity(0.9, "1", f"velocity of the table: {_SHARE}", gt=0, le=1)
    acceleration: float = quantity(0.9, "1", f"acceleration of the table: {_SHARE}", gt=0, le=1)
    force: float = quantity(0.9, "1", f"force on the table: {_SHARE}", gt=0, le=1)
    current: float = quantity(0.9, "1", f"current of the coil: {_SHARE}", gt=0, le=1)
    heating: float = quantity(0.8, "1", f"heating of the coil: {_SHARE}", gt=0, le=1)
    laser_range: float = quantity(0.95, "1", f"position in the laser's range: {_SHARE}", gt=0, le=1)
    drift: float = quantity(0.9, "1", f"drift of the specimen: {_SHARE}", gt=0, le=1)


class Debounce(Parameters):
    """Time for which a measured limit must be exceeded before it trips, so that single spikes are ignored."""

    displacement: float = quantity(0.003, "s", f"displacement of the table: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
    velocity: float = quantity(0.003, "s", f"velocity of the table: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
    acceleration: float = quantity(0.003, "s", f"acceleration of the table: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
    force: float = quantity(0.003, "s", f"force on the table: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
    current: float = quantity(0.01, "s", f"current of the coil: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
    heating: float = quantity(0.0, "s", f"heating of the coil: {_PERSISTENCE}", ge=0, usual=(1e-3, 5.0))
    laser_range: float = quantity(0.01, "s", f"position in the laser's range: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
    drift: float = quantity(0.01, "s", f"drift of the specimen: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)


Confirmable = Literal[
    "drive_voltage",
    "drive_slew",
    "displacement",
    "velocity",
    "acceleration",
    "force",
    "current",
    "heating",
    "laser_range",
    "drift",
    "late",
]
"""Limits that can be set too wide to trip on a given bench."""


class Limits(Parameters):
    """Limits, as magnitudes in SI units, beyond which the guard aborts a run."""

    drive_voltage: float = quantity(8.0, "V", "largest command to the amplifier", gt=0, le=10)
    drive_slew: float = quantity(400.0, "V/s", "fastest change of the command", gt=0)
    displacement: float = quantity(0.060, "m", "largest displacement of the table from mid stroke", gt=0)
    velocity: float = quantity(0.60, "m/s", "largest velocity of the table", gt=0)
    acceleration: float = quantity(6.0, "m/s2", "largest acceleration of the table", gt=0)
    force: float = quantity(700.0, "N", "largest force on table and specimen, measured or estimated", gt=0)
    current: float = quantity(16.0, "A", "largest current of the coil, measured or estimated", gt=0)
    heating: float = quantity(9.0, "A", "largest root mean square current of the coil over heating_time", gt=0)
    heating_time: float = quantity(60.0, "s", "time constant of the coil's temperature", gt=0)
    laser_range: float = quantity(
        0.99, "1", "largest distance of a storey from the laser's mid range, relative to half the range", gt=0
    )
    drift: float = quantity(0.080, "m", "largest drift of the specimen from rest", gt=0)
    sensor_loss: float = quantity(0.5, "s", "time without a valid sample of a sensor before the run aborts", gt=0)
    stuck: float = quantity(
        1.0, "s", "time for which a sensor's count may remain constant while the table is driven", gt=0
    )
    late: float = quantity(0.5, "s", "largest delay of a block of samples", gt=0)
    clock: float = quantity(
        1.0e-3, "1", "largest relative difference between the sample clock and the computer's clock", gt=0
    )
    confirmed: tuple[Confirmable, ...] = quantity(
        (), "", "keys of limits intentionally set beyond the range of this bench; every run reports them"
    )
    cut: tuple[Literal["displacement", "force"], ...] = quantity(
        (),
        "",
        "limits that cut the enable line at once instead of ramping the drive to zero after the queued samples: this"
        " acts sooner by acquisition.lead, but the amplifier may then brake the table harder than limits.acceleration",
        example=["displacement"],
    )
    warning: Warnings = Warnings()
    debounce: Debounce = Debounce()


class Ramps(Parameters):
    """Durations of the ramps to zero."""

    stop: float = quantity(
        4.0, "s", "duration of the smooth ramp, for a stop or the normal end of a test", ge=0.05, le=60
    )
    abort: float = quantity(0.5, "s", "duration of the fast ramp, for an abort", ge=0.05, le=10)

    @model_validator(mode="after")
    def _check_durations(self) -> "Ramps":
        if self.abort > self.stop:
            raise ValueError("abort must not be longer than stop")
        return self


def ramp_refusal(limits: Limits, ramps: Ramps) -> InvalidInput | None:
    """Error if one of the ramps, each half a cosine, would exceed the slew limit when it starts at the largest drive;
    None otherwise.
    """
    shortest = min(ramps.stop, ramps.abort)
    steepest = 0.5 * pi * limits.drive_voltage / shortest
    if steepest <= limits.drive_slew:
        return None
    slew = f"limits.drive_slew = {limits.drive_slew:g} V/s"
    needs = f"a ramp from {limits.drive_voltage:g} V needs {steepest:.0f} V/s, but {slew}: lengthen the ramp"
    return InvalidInput("ramps.abort", shortest, needs)


@dataclass(frozen=True)
class Violation:
    """Exceeded limit: `quantity` reached `value` beyond `limit`, in `unit`, at index `sample` since arming.

    `of_table`: the limit concerns the motion or load of the table, not a sensor, a clock or the specimen. `timing`: the
    limit concerns the arrival times of blocks, which the samples do not contain. `cuts`: exceeding the limit cuts the
    enable line.
    """

    quantity: str
    value: float
    limit: float
    unit: str
    sample: int
    of_table: bool = False
    timing: bool = False
    cuts: bool = False

    def __str__(self) -> str:
        return f"{self.quantity} {amount(self.value, self.unit)} exceeds {amount(self.limit, self.unit)}"


def amount(value: float, unit: str) -> str:
    """A value with its unit; a ratio, whose unit is 1, stands alone."""
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"


class Persistence:
    """Counter that rises by one with each bad sample and falls by one with each good one, never below zero.

    A condition present in more than half of the samples reaches the limit in time, even if it is intermittent; a spike
    of fewer samples than the limit does not.
    """

    def __init__(self, samples: int) -> None:
        self._needed = max(samples, 1)
        self._level = 0

    @property
    def counting(self) -> bool:
        """Whether the count is above zero."""
        return self._level > 0

    def first(self, bad: NDArray[np.bool_]) -> int | None:
        """Index of the sample at which the count reaches the limit, or None."""
        if self._level == 0 and not bad.any():
            return None
        walk = self._level + np.cumsum(np.where(bad, 1, -1))
        level = walk - np.minimum(np.minimum.accumulate(walk), 0)
        self._level = min(int(level[-1]), self._needed)
        reached = np.flatnonzero(level >= self._needed)
        return int(reached[0]) if reached.size else None
