"""The client of the control channel of an emulated laboratory: handwork, faults and the truth, asked from outside.

A request is one line of JSON and so is its answer, as `drivers/emulation/control.py` says.
"""

import json
import socket
import time
from typing import Any

from drivers.errors import ConnectionLost, DeviceTimeout, RigError
from sim.errors import InvalidInput

_PATIENCE = 60.0
"""How long an answer is waited for [s]: the bench may have to come to rest first."""


def ask(address: str, command: str, /, *, patience: float = _PATIENCE, **arguments: object) -> Any:
    """What the emulated laboratory at `address` (`host:port`) answers to a command, within `patience` [s].

    Raises RigError when it refuses, ConnectionLost when it is not there or goes away, DeviceTimeout when it does not
    answer in time, InvalidInput for an address that is none.
    """
    place = place_of(address)
    deadline = time.monotonic() + patience
    request = json.dumps({"command": command, **arguments}).encode() + b"\n"
    try:
        with socket.create_connection(place, timeout=patience) as connection:
            connection.sendall(request)
            line = _line(connection, deadline)
    except TimeoutError:
        raise DeviceTimeout(
            f"the emulated laboratory at {address} did not answer {command} in {patience:g} s"
        ) from None
    except OSError as error:
        raise ConnectionLost(
            f"{command} is refused: no connection to the emulated laboratory at {address} ({error});"
            " see that it runs and that hardware.hands is its address"
        ) from None
    return _result(address, command, line)


def place_of(address: str) -> tuple[str, int]:
    """Host and port of an address, `host:port`. Raises InvalidInput."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise InvalidInput("hands", address, "it must be host:port, such as localhost:31700")
    return host.strip("[]"), int(port)


def _line(connection: socket.socket, deadline: float) -> bytes:
    """The answer, without the end of its line. Raises OSError, TimeoutError when the deadline passes."""
    received = b""
    while not received.endswith(b"\n"):
        if (left := deadline - time.monotonic()) <= 0.0:
            raise TimeoutError
        connection.settimeout(left)
        if not (part := connection.recv(65536)):
            raise ConnectionResetError("it hung up without an answer")
        received += part
    return received


def _result(address: str, command: str, line: bytes) -> Any:
    """What is in an answer. Raises RigError."""
    try:
        answer: Any = json.loads(line)
        if answer["ok"]:
            return answer["result"]
        error = str(answer["error"])
    except (ValueError, TypeError, KeyError):
        raise RigError(
            f"the answer of {address} to {command} is not understood: is it an emulated laboratory?"
        ) from None
    raise RigError(error)
