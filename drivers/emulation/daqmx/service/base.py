"""Common base of all parts of the service."""

from typing import Protocol

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.driver import Driver
from drivers.emulation.daqmx.errors import DaqmxFailure
from drivers.emulation.daqmx.task import Task


class _Session(Protocol):
    @property
    def name(self) -> str: ...


class AboutTask(Protocol):
    """A request about a task."""

    @property
    def task(self) -> _Session: ...


class AboutAttribute(Protocol):
    """A request about an attribute: NI's clients send its number, others may send the enumeration value."""

    @property
    def attribute(self) -> int: ...
    @property
    def attribute_raw(self) -> int: ...


class Service:
    """Base class of the parts of the service, whose calls use the driver."""

    def __init__(self, driver: Driver) -> None:
        self._driver = driver

    def _task(self, request: AboutTask) -> Task:
        return self._driver.task(request.task.name)


def attribute_of(request: AboutAttribute) -> int:
    """The number of the attribute in a request."""
    return request.attribute_raw or request.attribute


def unsupported(attribute: int) -> DaqmxFailure:
    """The failure for an attribute that is not emulated."""
    return DaqmxFailure(
        DAQmxErrors.ATTRIBUTE_NOT_SUPPORTED_IN_TASK_CONTEXT,
        "Specified property is not supported by the device or is not applicable to the task.\n\n"
        f"Property Number: {attribute:#x}",
    )
