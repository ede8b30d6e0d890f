"""Two sets of devices with specifications from the data sheets, lists of names, and catalogue of a server's devices."""

import re
from collections.abc import Sequence
from dataclasses import replace

from nidaqmx.constants import ProductCategory
from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.device import AnalogInputs, AnalogOutputs, DeviceModel, Wirings
from drivers.emulation.daqmx.errors import DaqmxFailure
from drivers.emulation.daqmx.zoo import build

_CALIBRATED = 2
"""Index of the input with a non-linear calibration, if any; the analogue output of laser 1 is wired to it."""
_BEND = 1.0e-4
"""Contribution of each of the square and cubic terms of the calibration at full scale, relative to the range."""


def x_series(name: str = "Dev1", *, simulated: bool = False, calibrated: bool = False) -> DeviceModel:
    """A multifunction device on a USB port, after the data sheet of the USB-6363.

    If `calibrated`, one input has a calibration polynomial with offset, slope error, and square and cubic terms.
    """
    return DeviceModel(
        name,
        "USB-6363",
        category=ProductCategory.X_SERIES_DAQ,
        serial=0x01C0FFEE,
        simulated=simulated,
        inputs=AnalogInputs(
            count=32,
            ranges=(10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1),
            rate=2.0e6,
            total_rate=1.0e6,
            simultaneous=False,
            wirings=Wirings.RSE | Wirings.NRSE | Wirings.DIFFERENTIAL,
            polynomials=_polynomials(16) if calibrated else {},
        ),
        outputs=AnalogOutputs(count=4, ranges=(10.0, 5.0), rate=2.86e6, memory=8191),
        lines=32,
        input_lines=32,
        watchdog=34.0,
        counters=4,
    )


def compact_rio(name: str = "cRIO1", *, simulated: bool = False, calibrated: bool = False) -> tuple[DeviceModel, ...]:
    """A cRIO-9045 with two NI 9239 (inputs), NI 9263 (outputs), NI 9485 (relays) and NI 9421 (digital inputs).

    Modules are devices: `cRIO1Mod1/ai0`. The controller has a timing engine for each slot: `/cRIO1/it0/StartTrigger`.
    DAQmx supports no watchdog on a CompactRIO. `calibrated` applies to the first module, as in `x_series`.
    """
    controller, *modules = build("cRIO-9045", ("9239", "9239", "9263", "9485", "9421"))
    assert modules[0].inputs is not None
    assert modules[1].inputs is not None
    first = replace(modules[0].inputs, polynomials=_polynomials(24) if calibrated else {})
    second = replace(modules[1].inputs, first_terminal=first.count)
    modules[:2] = replace(modules[0], inputs=first), replace(modules[1], inputs=second)
    renamed = [replace(module, name=module.name.replace(controller.name, name), chassis=name) for module in modules]
    whole = (replace(controller, name=name, modules=tuple(module.name for module in renamed)), *renamed)
    return tuple(replace(device, simulated=simulated) for device in whole)


def _polynomials(bits: int, span: float = 10.0) -> dict[int, tuple[float, ...]]:
    """Calibration polynomial of the non-linear input, by the index of this input: coefficients [V] of ascending powers
    of the counts, for `bits` over +-`span` volts.
    """
    full = 2.0 ** (bits - 1)
    return {_CALIBRATED: (5e-5 * span, (1.0 + 2e-4) * span / full, _BEND * span / full**2, -_BEND * span / full**3)}


_RANGE = re.compile(r"^(?P<stem>.*?)(?P<first>\d+):(?:.*?)(?P<last>\d+)$")


def flattened(names: Sequence[str]) -> str:
    """The names in one string, separated as in DAQmx."""
    return ", ".join(names)


def unflattened(names: str) -> tuple[str, ...]:
    """The individual names in a list such as "Dev1/ai0:3, Dev1/ai6"; ranges may be descending."""
    found: list[str] = []
    for part in filter(None, (part.strip() for part in names.split(","))):
        if (given := _RANGE.match(part)) is None:
            found.append(part)
            continue
        first, last = int(given["first"]), int(given["last"])
        step = 1 if last >= first else -1
        found.extend(f"{given['stem']}{k}" for k in range(first, last + step, step))
    return tuple(found)


class Catalogue:
    """The devices of a server. Names are case-insensitive, as in DAQmx."""

    def __init__(self, devices: Sequence[DeviceModel]) -> None:
        self.devices = tuple(devices)

    def device(self, name: str) -> DeviceModel:
        """The device `name`. Raises DaqmxFailure if there is none."""
        for device in self.devices:
            if device.name.lower() == name.lower():
                return device
        raise DaqmxFailure(DAQmxErrors.INVALID_DEVICE_ID, f"Device identifier is invalid.\n\nDevice Specified: {name}")

    def input(self, channel: str) -> tuple[DeviceModel, int]:
        """The device of an analogue input and the number of the input."""
        return self._find(channel, "input_names")

    def output(self, channel: str) -> tuple[DeviceModel, int]:
        """The device of an analogue output and the number of the output."""
        return self._find(channel, "output_names")

    def counter(self, counter: str) -> tuple[DeviceModel, int]:
        """The device of a counter and its number."""
        return self._find(counter, "counter_names")

    def line(self, line: str) -> tuple[DeviceModel, int]:
        """The device of a digital output line and the number of the line."""
        return self._find(line, "line_names")

    def input_line(self, line: str) -> tuple[DeviceModel, int]:
        """The device of a digital input line and the number of the line."""
        return self._find(line, "input_line_names")

    def _find(self, channel: str, kind: str) -> tuple[DeviceModel, int]:
        device = self.device(channel.strip("/").split("/")[0])
        names: tuple[str, ...] = getattr(device, kind)
        for index, name in enumerate(names):
            if name.lower() == channel.strip("/").lower():
                return device, index
        raise DaqmxFailure(
            DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST,
            f"Physical channel specified does not exist on this device.\n\nPhysical Channel Name: {channel}",
        )
