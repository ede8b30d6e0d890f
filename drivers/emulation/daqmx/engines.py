"""Timing engines of a device: each runs one clocked task, and its number is part of that task's terminal names."""

from collections.abc import Callable

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.errors import DaqmxFailure


class EngineSlot:
    """Timing engine of one task.

    With several engines, the driver chooses one when it reserves the task, unless the client has set SampTimingEngine.
    Until then the names of the task's terminals are undefined (NI-DAQmx help, "cDAQ-91xx and TestScale Chassis Timing
    Engines").
    """

    def __init__(self) -> None:
        self.requested: int | None = None
        """The number set by the client."""
        self._chosen: int | None = None

    def number(self, engines: tuple[str, ...]) -> int | None:
        """The number of the task's engine; None while it is undefined."""
        if self.requested is not None:
            return self.requested
        return 0 if len(engines) == 1 else self._chosen

    def terminal(self, device: DeviceModel, engines: tuple[str, ...], signal: str) -> str | None:
        """Terminal of a signal of the task; None while its engine is undefined."""
        number = self.number(engines)
        return None if number is None else f"/{device.clockwork}/{engines[number]}/{signal}"

    def resource(self, device: DeviceModel, engines: tuple[str, ...]) -> str:
        """Name of the task's engine as a resource that a task reserves."""
        return f"{device.clockwork} timing engine {engines[self.number(engines) or 0]}"

    def request(self, number: int, engines: tuple[str, ...]) -> None:
        """Set the engine. Raises DaqmxFailure if this engine does not exist, or if the device has only one."""
        if len(engines) == 1:
            raise DaqmxFailure(
                DAQmxErrors.ATTRIBUTE_NOT_SUPPORTED_IN_TASK_CONTEXT,
                "Specified property is not supported by the device or is not applicable to the task.\n\n"
                "Property: SampTimingEngine",
            )
        if not 0 <= number < len(engines):
            raise DaqmxFailure(
                DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
                "Requested value is not a supported value for this property.\n\n"
                f"Property: SampTimingEngine\nRequested Value: {number}",
            )
        self.requested = number

    def choose(self, device: DeviceModel, engines: tuple[str, ...], is_free: Callable[[str], bool]) -> None:
        """Choose the first free engine. If none is free, choose the first one, whose reservation then fails."""
        if self.requested is not None or self._chosen is not None:
            return
        for self._chosen in range(len(engines)):
            if is_free(self.resource(device, engines)):
                return
        self._chosen = 0

    def release(self) -> None:
        """Discard the driver's choice."""
        self._chosen = None


def undefined(what: str, task: str) -> DaqmxFailure:
    """The failure for a property that is undefined until the task is reserved."""
    return DaqmxFailure(
        DAQmxErrors.CANNOT_GET_PROPERTY_WHEN_TASK_NOT_RESERVED_COMMITTED_OR_RUNNING,
        "Cannot get property value when the task is not reserved, committed, or running.\n\n"
        "Before getting the value, reserve, commit, or start the task.\n\n"
        f"Property: {what}\nTask Name: {task}",
    )
