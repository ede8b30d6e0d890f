"""Channels of the laboratory bench: conversion from counts to SI units by converter, transducer and polarity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from drivers.daqmx.parameters import AnalogInput
from drivers.further import FurtherChannel
from drivers.hardware.parameters import CalibratedInput, Hardware
from drivers.optoncdt.codec import MID_RANGE, count_size
from sim.channel import COIL_CURRENT, TABLE_ACCELERATION, TABLE_DISPLACEMENT, TABLE_FORCE, Channel
from sim.errors import InvalidInput

_START, _END = 0.004, 0.020
"""Current at the start and at the end of the measuring range [A] (manual of the optoNCDT 1420, p. 116)."""
_LOWEST, _HIGHEST = 0.0038, 0.0202
"""Range of valid currents, including the reserve [A] (manual of the IFD2410, p. 71, of the same family).

Without a valid distance the current is lower, 3 to 3.75 mA depending on the model.
"""


@dataclass(frozen=True)
class AnalogueScaling:
    """Displacement from mid range [m] = (volts - middle) * slope, with `slope` in m/V.

    `valid` is the voltage range of valid distances.
    """

    slope: float
    middle: float
    valid: tuple[float, float]


def laser_scaling(measuring_range: float, load: float) -> AnalogueScaling:
    """Scaling from the voltage across `load` [ohm] to displacement, for the standard scaling of the laser's output.

    Source: d = (I - 4 mA) / 16 mA of the measuring range (manual of the IFD2410, p. 71; of the optoNCDT 1402, p. 31).
    """
    slope = measuring_range / ((_END - _START) * load)
    return AnalogueScaling(slope, 0.5 * (_START + _END) * load, (_LOWEST * load, _HIGHEST * load))


def require_input_range(item: str, input_range: float, load: float) -> None:
    """Raise InvalidInput for `item` if an input of +-`input_range` [V] does not cover the measuring range.

    The converter may saturate within the reserve beyond the measuring range; values there are then invalid.
    """
    if (needed := _END * load) > input_range * (1.0 + 1e-9):
        allowed = (
            f"the output of the laser reaches {needed:.4g} V across {load:g} ohm;"
            f" choose a wider input range, or a load of {input_range / _END:.0f} ohm at most"
        )
        raise InvalidInput(item, input_range, allowed)


_MEASURED = {
    TABLE_DISPLACEMENT: ("displacement", "m"),
    TABLE_ACCELERATION: ("acceleration", "m/s2"),
    TABLE_FORCE: ("force", "N"),
    COIL_CURRENT: ("current", "A"),
}
"""Quantity and unit of each transducer, by channel name."""


class Scaling(Protocol):
    """Scaling of one input: volts = coefficients[0] + coefficients[1] * counts + ..., and the range of valid counts."""

    @property
    def coefficients(self) -> tuple[float, ...]:
        """Coefficients [V] of ascending powers of the counts."""
        ...

    @property
    def lowest(self) -> int:
        """Lowest valid count."""
        ...

    @property
    def highest(self) -> int:
        """Highest valid count."""
        ...


def analogue_channels(
    hardware: Hardware, scalings: Sequence[Scaling], devices: Mapping[str, str], further: Sequence[FurtherChannel] = ()
) -> tuple[Channel, ...]:
    """The channels of the DAQ's inputs in order: transducers, lasers on their analogue outputs, and additional sensors.

    `devices` is the DAQ's description, which contains the identity of each device.
    """
    channels: list[Channel] = []
    transducers = hardware.transducers
    for (name, given), scaling in zip(transducers, scalings, strict=False):
        channels.append(_calibrated(name, *_MEASURED[name], given, scaling, devices))
    lasers = hardware.analogue_lasers
    for (name, given), scaling in zip(lasers, scalings[len(transducers) :], strict=False):
        output = laser_scaling(given.measuring_range, hardware.lasers.load)
        device = f"optoNCDT 1420 on its analogue output, {_device(devices, given)}, {given.terminal}"
        slope = given.polarity * output.slope
        channels.append(_analogue(name, "displacement", "m", device, scaling, slope, output.middle, output.valid))
    for given, scaling in zip(further, scalings[len(transducers) + len(lasers) :], strict=True):
        channels.append(_calibrated(given.name, given.measures, given.unit, given, scaling, devices))
    return tuple(channels)


def _calibrated(
    name: str, quantity: str, unit: str, given: CalibratedInput, scaling: Scaling, devices: Mapping[str, str]
) -> Channel:
    device = f"{_device(devices, given)}, {given.terminal}"
    return _analogue(name, quantity, unit, device, scaling, 1.0 / given.sensitivity, given.zero)


def _device(devices: Mapping[str, str], given: AnalogInput) -> str:
    # device names are case-insensitive
    wanted = f"device {given.terminal.split('/')[0]}".lower()
    return next((identity for name, identity in devices.items() if name.lower() == wanted), "unknown device")


def _analogue(
    name: str,
    quantity: str,
    unit: str,
    device: str,
    scaling: Scaling,
    slope: float,
    zero: float,
    volts: tuple[float, float] | None = None,
) -> Channel:
    """A channel with value = (volts - zero) * slope in `unit`; a value outside the range `volts` [V] is invalid."""
    c0, c1, *higher = scaling.coefficients
    valid = scaling.lowest, scaling.highest
    if volts is not None:
        # the converter's polynomial is assumed linear, which is sufficient for the limits of the sensor's reserve
        ends = sorted(round((end - c0) / c1) for end in volts)
        valid = max(valid[0], ends[0]), min(valid[1], ends[1])
    terms = tuple(c * slope for c in higher)
    return Channel(name, quantity, unit, c1 * slope, (c0 - zero) * slope, valid, device, terms if any(terms) else ())


def serial_laser(name: str, measuring_range: float, polarity: int, device: str, faults: Mapping[int, str]) -> Channel:
    """Channel of a laser on its serial line: counts relative to mid range; `faults` gives the meanings of counts
    outside the range.
    """
    scale, valid = polarity * count_size(measuring_range), (-MID_RANGE, MID_RANGE)
    return Channel(name, "displacement", "m", scale, 0.0, valid, device, faults=faults)
