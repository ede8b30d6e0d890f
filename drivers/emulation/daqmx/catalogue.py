"""Finds devices, channels and lines by the names that clients use."""

import re
from collections.abc import Sequence

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.errors import DaqmxFailure

_RANGE = re.compile(r"^(?P<stem>.*?)(?P<first>\d+):(?:.*?)(?P<last>\d+)$")


def flattened(names: Sequence[str]) -> str:
    """Names as DAQmx joins them."""
    return ", ".join(names)


def unflattened(names: str) -> tuple[str, ...]:
    """The single names of a list such as "Dev1/ai0:3, Dev1/ai6"; ranges may run downwards."""
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
    """The devices of a server. Names are compared without regard to case, as DAQmx does."""

    def __init__(self, devices: Sequence[DeviceModel]) -> None:
        self.devices = tuple(devices)

    def device(self, name: str) -> DeviceModel:
        """The device of that name."""
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
