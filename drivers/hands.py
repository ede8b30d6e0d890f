"""Who does the handwork at the bench: a person, or an emulated laboratory that is told of it."""

import json
import socket
import time
from typing import Any, Protocol

from drivers.errors import ConnectionLost, DeviceTimeout, RigError
from drivers.rig import Handwork
from sim.errors import InvalidInput

_PATIENCE = 60.0
"""How long an answer is waited for [s]: the bench may have to come to rest first."""


class Hands(Protocol):
    """Does what is done by hand between two tests."""

    def do(self, work: Handwork, stiffness: float | None) -> None:
        """Do `work`, with a spring of `stiffness` [N/m]. Raises RigError when it cannot be done."""
        ...


class Person:
    """The person at the bench, who has done the work when the rig hears of it."""

    def do(self, work: Handwork, stiffness: float | None) -> None:
        """Nothing is left to do."""


class RemoteHands:
    """An emulated laboratory at `address`, `host:port`. Raises InvalidInput for anything else."""

    def __init__(self, address: str) -> None:
        _split(address)
        self._address = address

    def do(self, work: Handwork, stiffness: float | None) -> None:
        """Have it done to the virtual specimen. Raises RigError, ConnectionLost or DeviceTimeout."""
        ask(self._address, "handwork", work=work.value, stiffness=stiffness)


def ask(address: str, command: str, /, *, patience: float = _PATIENCE, **arguments: object) -> Any:
    """What the emulated laboratory at `address` (`host:port`) answers to a command, within `patience` [s].

    Raises RigError when it refuses, ConnectionLost when it is not there or goes away, DeviceTimeout when it does not
    answer in time, InvalidInput for an address that is none.
    """
    place = _split(address)
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


def _split(address: str) -> tuple[str, int]:
    """Host and port. Raises InvalidInput."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise InvalidInput("hands", address, "it must be host:port, such as localhost:31700")
    return host.strip("[]"), int(port)
