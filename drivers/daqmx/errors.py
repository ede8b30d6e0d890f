"""Translation of driver errors to rig errors."""

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, cast

from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import (
    DaqError,
    DaqFunctionNotSupportedError,
    DaqNotFoundError,
    DaqNotSupportedError,
    Error,
    RpcError,
)

from drivers.errors import ConnectionLost, DeviceNotFound, DeviceTimeout, DriveUnderflow, InputOverflow, RigError


@dataclass(frozen=True)
class _Meaning:
    """Type of the rig error, and remedy, for a group of error codes."""

    error: type[RigError]
    remedy: str


_UNDERFLOW = _Meaning(DriveUnderflow, "the drive was written too late: increase acquisition.lead")
_OVERFLOW = _Meaning(InputOverflow, "the inputs were read too late: increase hardware.daq.buffer")
_TIMEOUT = _Meaning(DeviceTimeout, "check the wiring of clock and trigger, and the CPU load")
_GONE = _Meaning(ConnectionLost, "check power and cables, then open a new session")
_ABSENT = _Meaning(DeviceNotFound, "`rockbench devices` lists the devices that are present")
_BUSY = _Meaning(DeviceNotFound, "another program holds the device: end it first")
_NO_ROUTE = _Meaning(
    RigError,
    "see hardware.daq.start_trigger and hardware.daq.clock; clock = OnboardClock selects the output's own clock",
)
_OTHER = _Meaning(RigError, "the run has ended")

_CODES: dict[_Meaning, tuple[DAQmxErrors, ...]] = {
    _UNDERFLOW: (
        DAQmxErrors.GEN_STOPPED_TO_PREVENT_REGEN_OF_OLD_SAMPLES,
        DAQmxErrors.GEN_STOPPED_TO_PREVENT_INTERMEDIATE_BUFFER_REGEN_OF_OLD_SAMPLES,
        DAQmxErrors.OUTPUT_FIFO_UNDERFLOW,
        DAQmxErrors.OUTPUT_FIFO_UNDERFLOW_2,
        DAQmxErrors.DAC_UNDERFLOW,
        DAQmxErrors.OUTPUT_BUFFER_EMPTY,
        DAQmxErrors.OUTPUT_BUFFER_UNDERWRITE,
    ),
    _OVERFLOW: (
        DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE,
        DAQmxErrors.ACQ_STOPPED_TO_PREVENT_INPUT_BUFFER_OVERWRITE,
        DAQmxErrors.ACQ_STOPPED_TO_PREVENT_INPUT_BUFFER_OVERWRITE_ONE_DATA_XFER_MECH,
        DAQmxErrors.ACQ_STOPPED_TO_PREVENT_INTERMEDIATE_BUFFER_OVERFLOW,
        DAQmxErrors.ACQ_STOPPED_DRIVER_CANT_XFER_DATA_FAST_ENOUGH,
        DAQmxErrors.INPUT_FIFO_OVERFLOW,
        DAQmxErrors.INPUT_FIFO_OVERFLOW_2,
        DAQmxErrors.INPUT_FIFO_OVERFLOW_3,
        DAQmxErrors.ADC_OVERRUN,
    ),
    _TIMEOUT: (
        DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE,
        DAQmxErrors.SAMPLES_CAN_NOT_YET_BE_WRITTEN,
        DAQmxErrors.OPERATION_TIMED_OUT,
        DAQmxErrors.NETWORK_STATUS_TIMED_OUT,
    ),
    _GONE: (
        DAQmxErrors.INVALID_TASK,
        DAQmxErrors.DEVICE_REMOVED,
        DAQmxErrors.DEV_CANNOT_BE_ACCESSED,
        DAQmxErrors.DEV_ABSENT_OR_UNAVAILABLE,
        DAQmxErrors.HARDWARE_NOT_RESPONDING,
        DAQmxErrors.NETWORK_STATUS_CONNECTION_LOST,
        DAQmxErrors.NETWORK_STATUS_DOWN,
        DAQmxErrors.NETWORK_TARGET_UNREACHABLE,
        DAQmxErrors.PAL_TRANSFER_ABORTED,
    ),
    _ABSENT: (
        DAQmxErrors.INVALID_DEVICE_ID,
        DAQmxErrors.INVALID_DEVICE_ID_IN_LIST,
        DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST,
        DAQmxErrors.NETWORK_TARGET_NOT_FOUND,
        DAQmxErrors.PAL_DEVICE_NOT_FOUND,
    ),
    _NO_ROUTE: (
        DAQmxErrors.INVALID_ROUTING_SOURCE_TERMINAL_NAME,
        DAQmxErrors.INVALID_ROUTING_SOURCE_TERMINAL_NAME_ROUTING,
        DAQmxErrors.ROUTE_NOT_SUPPORTED_BY_HW,
        DAQmxErrors.ROUTE_NOT_SUPPORTED_BY_HW_ROUTING,
        DAQmxErrors.ROUTING_PATH_NOT_AVAILABLE,
        DAQmxErrors.ROUTING_PATH_NOT_AVAILABLE_ROUTING,
    ),
    _BUSY: (
        DAQmxErrors.PAL_RESOURCE_RESERVED,
        DAQmxErrors.RESOURCE_ALREADY_RESERVED,
        DAQmxErrors.DIG_LINES_RESERVED_OR_UNAVAILABLE,
        DAQmxErrors.LINES_ALREADY_RESERVED_FOR_OUTPUT,
        DAQmxErrors.NETWORK_DEVICE_IN_USE,
        DAQmxErrors.NETWORK_DEVICE_RESERVED_BY_ANOTHER_HOST,
    ),
}
_BY_CODE = {int(code): meaning for meaning, codes in _CODES.items() for code in codes}

_BY_STATUS = {
    "UNAVAILABLE": _GONE,
    "CANCELLED": _GONE,
    "NOT_FOUND": _GONE,
    "DEADLINE_EXCEEDED": _Meaning(DeviceTimeout, "check the network and the server, then open a new session"),
    "ALREADY_EXISTS": _BUSY,
    "FAILED_PRECONDITION": _Meaning(ConnectionLost, "another client has taken the device: open a new session"),
    "UNIMPLEMENTED": _Meaning(RigError, "update NI gRPC Device Server"),
}
"""Meanings of the status codes of a gRPC call, by name."""

_UNSUPPORTED = {
    int(code)
    for code in (
        DAQmxErrors.ATTR_NOT_SUPPORTED,
        DAQmxErrors.ATTRIBUTE_NOT_SUPPORTED_IN_TASK_CONTEXT,
        DAQmxErrors.SPECIFIED_ATTR_NOT_VALID,
        DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
    )
}


def is_unsupported(error: DaqError) -> bool:
    """Whether the error reports a property that the device lacks."""
    return code_of(error) in _UNSUPPORTED


def code_of(error: DaqError) -> int:
    return int(error.error_code)


def translation(doing: str, error: Error) -> RigError:
    """The rig error for a driver error that was raised during the operation `doing`."""
    if isinstance(error, DaqNotFoundError | DaqNotSupportedError):
        return DeviceNotFound(
            f"{doing} failed: there is no NI-DAQmx driver on this PC; install NI-DAQmx, or set hardware.daq.server to"
            " the host:port of a gRPC device server"
        )
    if isinstance(error, DaqFunctionNotSupportedError):
        return RigError(f"{doing} failed: the NI-DAQmx driver of this PC lacks a function; update it")
    if isinstance(error, RpcError):
        status = status_of(error)
        meaning = _BY_STATUS.get(status, _OTHER)
        return meaning.error(f"{doing} failed: {_line(cast(Any, error).description)} ({status}); {meaning.remedy}")
    if isinstance(error, DaqError):
        meaning = _BY_CODE.get(code_of(error), _OTHER)
        return meaning.error(f"{doing} failed: {_line(str(error))}; {meaning.remedy}", code_of(error))
    return RigError(f"{doing} failed: {_line(str(error))}; {_OTHER.remedy}")


def status_of(error: RpcError) -> str:
    """The status name of a failed gRPC call."""
    return str(getattr(cast(Any, error).rpc_code, "name", "UNKNOWN"))


@contextmanager
def translated(doing: str) -> Generator[None]:
    """Context manager that raises driver errors as rig errors, with the operation `doing` in the message."""
    try:
        yield
    except Error as error:
        raise translation(doing, error) from error


def _line(text: object) -> str:
    """The first paragraph of the driver's message, in one line without full stop."""
    return " ".join(str(text).split("\n\n")[0].split()).rstrip(".")
