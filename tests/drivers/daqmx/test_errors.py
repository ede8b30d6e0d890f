"""Every error of the driver becomes one of the rig; codes are those of NI's list of errors."""

import grpc
import pytest
from nidaqmx.errors import (
    DaqError,
    DaqFunctionNotSupportedError,
    DaqNotFoundError,
    DaqNotSupportedError,
    DaqReadError,
    DaqWriteError,
    Error,
    RpcError,
)

from drivers.daqmx.errors import translated
from drivers.errors import ConnectionLost, DeviceNotFound, DeviceTimeout, DriveUnderflow, InputOverflow, RigError


def raised_by(error: Error) -> RigError:
    with pytest.raises(RigError) as caught, translated("reading the inputs"):
        raise error
    assert caught.value.__cause__ is error
    return caught.value


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        (-200290, DriveUnderflow),
        (-200621, DriveUnderflow),
        (-200462, DriveUnderflow),
        (-200279, InputOverflow),
        (-200222, InputOverflow),
        (-200361, InputOverflow),
        (-200284, DeviceTimeout),
        (-200292, DeviceTimeout),
        (-200474, DeviceTimeout),
        (-200088, ConnectionLost),
        (-201003, ConnectionLost),
        (-200324, ConnectionLost),
        (-50405, ConnectionLost),
        (-200220, DeviceNotFound),
        (-200170, DeviceNotFound),
        (-50103, DeviceNotFound),
        (-200022, DeviceNotFound),
        (-200587, DeviceNotFound),
        (-88710, RigError),
        (-200077, RigError),
    ],
)
def test_a_code_has_its_error(code: int, expected: type[RigError]) -> None:
    error = raised_by(DaqError("First line\nof the text.\n\nProperty: DAQmx_Something\n\nStatus Code: -1", code))
    assert type(error) is expected
    assert error.code == code
    assert str(error).startswith("reading the inputs failed: First line of the text; ")
    assert str(error).endswith(f"(code {code})")


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (DaqReadError("late", -200279, 0), InputOverflow),
        (DaqWriteError("dry", -200290, 0), DriveUnderflow),
        (RpcError(grpc.StatusCode.UNAVAILABLE, "Failed to connect"), ConnectionLost),
        (RpcError(grpc.StatusCode.CANCELLED, "closed"), ConnectionLost),
        (RpcError(grpc.StatusCode.DEADLINE_EXCEEDED, "Deadline Exceeded"), DeviceTimeout),
        (RpcError(grpc.StatusCode.ALREADY_EXISTS, "rockbench_in"), DeviceNotFound),
        (RpcError(grpc.StatusCode.FAILED_PRECONDITION, "rockbench_in"), ConnectionLost),
        (RpcError(grpc.StatusCode.UNIMPLEMENTED, "no such call"), RigError),
        (RpcError(grpc.StatusCode.INTERNAL, "broken"), RigError),
        (DaqFunctionNotSupportedError("old"), RigError),
        (Error("other"), RigError),
    ],
)
def test_an_error_without_code_of_its_own_has_its_meaning(error: Error, expected: type[RigError]) -> None:
    assert type(raised_by(error)) is expected


@pytest.mark.parametrize("error", [DaqNotFoundError("no library"), DaqNotSupportedError("macOS")])
def test_a_missing_driver_says_what_to_do(error: Error) -> None:
    missing = raised_by(error)
    assert type(missing) is DeviceNotFound
    assert "install NI-DAQmx" in str(missing)
    assert "hardware.daq.server" in str(missing)


@pytest.mark.parametrize("error", [ValueError("not the driver's"), KeyboardInterrupt()])
def test_what_the_driver_did_not_raise_passes(error: BaseException) -> None:
    with pytest.raises(type(error)), translated("reading the inputs"):
        raise error
