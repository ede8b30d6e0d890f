"""What can be set at the sensor, and what it is set to."""

from dataclasses import dataclass
from typing import Literal

BAUDS = (9600, 19200, 56000, 115200, 128000, 230400, 256000, 460800, 691200, 921600, 1_000_000)
ADDITIONAL = ("SHUTTER", "COUNTER", "TIMESTAMP", "INTENSITY", "STATE", "DIST_RAW")
"""Values that can be sent along with the distance. Their order on the line is not documented; this sensor sends them
in this order, whatever the order in which they were asked for."""


@dataclass(frozen=True)
class Mastering:
    """The distance that was there [share of the measuring range] is called `value` [m]."""

    place: float
    value: float


@dataclass(frozen=True)
class Settings:
    """Settings of the sensor; as it comes from the factory when nothing is said.

    The analogue output and 2 kHz are how the factory is remembered to set it: a client that does not configure the
    sensor gets no stream.
    """

    output: Literal["NONE", "RS422", "ANALOG"] = "ANALOG"
    rate: float = 2000.0
    """Measurements per second."""
    additional: tuple[str, ...] = ()
    average: int = 1
    """Measurements in the moving mean."""
    hold: float = 0.0
    """For how many measurements the last valid value stands in for an error; infinity: until there is another."""
    reduction: int = 1
    """Every how many measurements one is sent."""
    reduced: tuple[str, ...] = ("RS422",)
    """The outputs that are reduced."""
    trigger: Literal["NONE", "EDGE", "PULSE", "SOFTWARE"] = "NONE"
    """Anything but NONE and the sensor sends nothing: nobody triggers it."""
    laser_power: Literal["FULL", "OFF"] = "FULL"
    mastering: Mastering | None = None
    baud: int = 921_600
    language: Literal["DE", "EN", "CN"] = "EN"
    echo: bool = True
    professional: bool = True
    """Whether the user may change settings."""


BASIC = ("baud", "language")
"""Settings of the device; the others are settings of the measurement."""
