"""The channels of the laboratory's bench: converter, transducer and sign in one conversion."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from drivers.daqmx.parameters import AnalogInput
from drivers.further import FurtherChannel
from drivers.hardware.parameters import CalibratedInput, Hardware
from drivers.optoncdt.analogue import laser_scaling
from drivers.optoncdt.codec import MID_RANGE, count_size
from sim.channel import Channel

_MEASURED = {
    "table_displacement": ("displacement", "m"),
    "table_acceleration": ("acceleration", "m/s2"),
    "table_force": ("force", "N"),
    "coil_current": ("current", "A"),
}
"""Quantity and unit of the transducers."""


class Scaling(Protocol):
    """What a converter says of one input: volts = coefficients[0] + coefficients[1] counts + ..., between its rails."""

    @property
    def coefficients(self) -> tuple[float, ...]:
        """Volts per power of the counts [V]."""
        ...

    @property
    def lowest(self) -> int:
        """Lowest count that is a measurement."""
        ...

    @property
    def highest(self) -> int:
        """Highest count that is a measurement."""
        ...


def analogue_channels(
    hardware: Hardware, scalings: Sequence[Scaling], devices: Mapping[str, str], further: Sequence[FurtherChannel] = ()
) -> tuple[Channel, ...]:
    """The channels of the DAQ's inputs, in their order: transducers, lasers on their analogue outputs, further ones.

    `devices` is the description of the DAQ, with the identity of each device.
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
    # names of devices are the same in capitals
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
    """A channel with value = (volts - zero) * slope in `unit`; outside the range `volts` [V] it says nothing."""
    c0, c1, *higher = scaling.coefficients
    valid = scaling.lowest, scaling.highest
    if volts is not None:
        # the polynomial is straight to a part in a thousand: far better than the reserve of the sensor needs
        ends = sorted(round((end - c0) / c1) for end in volts)
        valid = max(valid[0], ends[0]), min(valid[1], ends[1])
    terms = tuple(c * slope for c in higher)
    return Channel(name, quantity, unit, c1 * slope, (c0 - zero) * slope, valid, device, terms if any(terms) else ())


def serial_laser(name: str, measuring_range: float, polarity: int, device: str, faults: Mapping[int, str]) -> Channel:
    """A laser read serially: counts from mid range; `faults` says what those outside its range mean."""
    scale, valid = polarity * count_size(measuring_range), (-MID_RANGE, MID_RANGE)
    return Channel(name, "displacement", "m", scale, 0.0, valid, device, faults=faults)
