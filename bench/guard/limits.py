"""What the table, the shaker and the specimen may do at most, and what is expected of the sensors."""

from math import pi
from typing import Literal

from pydantic import model_validator

from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity

_SHARE = "share of the limit from which the operator is warned"
_PERSISTENCE = "how long the limit must be exceeded before it counts"


DEBOUNCE = (1e-3, 0.05)
"""Usual debounce of a limit [s]: above single spikes, below the time from a limit to the end of the stroke."""


class Warnings(Parameters):
    """From which share of a limit the operator is warned, once in a run."""

    displacement: float = quantity(0.9, "1", f"displacement of the table: {_SHARE}", gt=0, le=1)
    velocity: float = quantity(0.9, "1", f"velocity of the table: {_SHARE}", gt=0, le=1)
    acceleration: float = quantity(0.9, "1", f"acceleration of the table: {_SHARE}", gt=0, le=1)
    force: float = quantity(0.9, "1", f"force on the table: {_SHARE}", gt=0, le=1)
    current: float = quantity(0.9, "1", f"current of the coil: {_SHARE}", gt=0, le=1)
    heating: float = quantity(0.8, "1", f"heating of the coil: {_SHARE}", gt=0, le=1)
    laser_range: float = quantity(0.95, "1", f"place in the laser's range: {_SHARE}", gt=0, le=1)
    drift: float = quantity(0.9, "1", f"drift of the specimen: {_SHARE}", gt=0, le=1)


class Debounce(Parameters):
    """How long a measured limit must be exceeded before it counts: single spikes are noise."""

    displacement: float = quantity(0.003, "s", f"displacement of the table: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
    velocity: float = quantity(0.003, "s", f"velocity of the table: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
    acceleration: float = quantity(0.003, "s", f"acceleration of the table: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
    force: float = quantity(0.003, "s", f"force on the table: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
    current: float = quantity(0.01, "s", f"current of the coil: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
    heating: float = quantity(0.0, "s", f"heating of the coil: {_PERSISTENCE}", ge=0, usual=(1e-3, 5.0))
    laser_range: float = quantity(0.01, "s", f"place in the laser's range: {_PERSISTENCE}", ge=0, usual=DEBOUNCE)
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
"""Limits that can be too wide to trip on a given bench."""


class Limits(Parameters):
    """Levels at which the guard aborts a run. Magnitudes, in SI units."""

    drive_voltage: float = quantity(8.0, "V", "largest command to the amplifier", gt=0, le=10)
    drive_slew: float = quantity(400.0, "V/s", "fastest change of the command", gt=0)
    displacement: float = quantity(0.060, "m", "largest displacement of the table from mid stroke", gt=0)
    velocity: float = quantity(0.60, "m/s", "largest velocity of the table", gt=0)
    acceleration: float = quantity(6.0, "m/s2", "largest acceleration of the table", gt=0)
    force: float = quantity(700.0, "N", "largest force on table and specimen, measured or estimated", gt=0)
    current: float = quantity(16.0, "A", "largest current of the coil, measured or estimated", gt=0)
    heating: float = quantity(9.0, "A", "largest root mean square current of the coil over heating_time", gt=0)
    heating_time: float = quantity(60.0, "s", "time constant of the coil's temperature", gt=0)
    laser_range: float = quantity(0.99, "1", "share of half its range that a storey may leave the laser's middle", gt=0)
    drift: float = quantity(0.080, "m", "largest drift of the specimen from rest", gt=0)
    sensor_loss: float = quantity(0.5, "s", "how long a sensor may give no valid sample before the run aborts", gt=0)
    stuck: float = quantity(1.0, "s", "how long a sensor may show the same count while the table is driven", gt=0)
    late: float = quantity(0.5, "s", "how much later than due a block of samples may come", gt=0)
    clock: float = quantity(
        1.0e-3, "1", "largest relative difference between the sample clock and the computer's clock", gt=0
    )
    confirmed: tuple[Confirmable, ...] = quantity(
        (), "", "limits that are meant to lie beyond what this bench can show, by their keys: every run says so"
    )
    warning: Warnings = Warnings()
    debounce: Debounce = Debounce()


class Ramps(Parameters):
    """How the output is brought to zero."""

    stop: float = quantity(4.0, "s", "length of the smooth ramp that ends a good run", ge=0.05, le=60)
    abort: float = quantity(0.5, "s", "length of the fast ramp that ends a bad run", ge=0.05, le=10)

    @model_validator(mode="after")
    def _abort_is_the_fast_one(self) -> "Ramps":
        if self.abort > self.stop:
            raise ValueError("abort must not be longer than stop")
        return self


def ramp_refusal(limits: Limits, ramps: Ramps) -> InvalidInput | None:
    """Why the output could not be brought to zero in time from its limit, or None: half a cosine has its own slew."""
    shortest = min(ramps.stop, ramps.abort)
    steepest = 0.5 * pi * limits.drive_voltage / shortest
    if steepest <= limits.drive_slew:
        return None
    slew = f"limits.drive_slew = {limits.drive_slew:g} V/s"
    needs = f"a ramp from {limits.drive_voltage:g} V needs {steepest:.0f} V/s, {slew} allows less"
    return InvalidInput("ramps.abort", shortest, needs)
