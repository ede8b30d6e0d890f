"""Control channel of an emulated laboratory (server and client) for operator actions, faults and true values.

A request is one line of JSON, `{"command": "handwork", "work": "remove block", "amount": null}`; the answer is one
line, `{"ok": true, "result": ...}` or `{"ok": false, "error": "..."}`. A connection may carry any number of requests.
"""

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Any, BinaryIO, cast

from drivers.errors import ConnectionLost, DeviceTimeout, RigError
from sim import waiting
from sim.errors import InvalidInput, RockbenchError

Handler = Callable[[dict[str, Any]], object]
"""Function that carries out a command with its arguments, and returns data that can be written as JSON."""

_LONGEST = 65536
"""Length of the longest request [bytes]."""


class ControlServer:
    """Server on a free local port; the constructor starts it.

    Each connection has its own thread, so that handlers may block and run concurrently. A handler refuses a command by
    raising an error.
    """

    def __init__(self, handlers: Mapping[str, Handler]) -> None:
        self._handlers = dict(handlers)
        self._lock = threading.Lock()
        self._served: dict[socket.socket, threading.Thread] = {}
        self._closing = False
        self._listening = socket.create_server(("127.0.0.1", 0))
        host, port = self._listening.getsockname()
        self.address = f"{host}:{port}"
        """Listening address, as `host:port`."""
        self._accepting = threading.Thread(target=self._accept, name="emulated-control", daemon=True)
        self._accepting.start()

    def close(self) -> None:
        """Close every connection after the running handlers have ended; may be called repeatedly."""
        with self._lock:
            first, self._closing = not self._closing, True
            served = list(self._served.items())
        if first:
            # closing a socket does not wake the thread in accept(), but a connection does
            with socket.create_connection(self._listening.getsockname()):
                waiting.join(self._accepting)
            self._listening.close()
        for connection, thread in served:
            _shut_down_input(connection)
            waiting.join(thread)

    def _accept(self) -> None:
        while True:
            connection, _ = self._listening.accept()
            with self._lock:
                if self._closing:
                    connection.close()
                    return
                thread = threading.Thread(
                    target=self._serve, args=(connection,), name="emulated-control-client", daemon=True
                )
                self._served[connection] = thread
                thread.start()

    def _serve(self, connection: socket.socket) -> None:
        # a client may disconnect at any time
        with connection, suppress(OSError), connection.makefile("rb") as lines:
            for line in _requests(lines):
                connection.sendall(self._answer(line) + b"\n")
        with self._lock:
            self._served.pop(connection, None)

    def _answer(self, line: bytes) -> bytes:
        """Reply to any request, valid or not."""
        try:
            return json.dumps({"ok": True, "result": self._result(line)}).encode()
        except RockbenchError as error:
            text = str(error)
        except Exception as error:
            # a failing handler must not end the connection, and its failure must be reported
            text = f"{type(error).__name__}: {error}"
        return json.dumps({"ok": False, "error": text}).encode()

    def _result(self, line: bytes) -> object:
        """Result of the handler. Raises RigError for an invalid request."""
        if len(line) > _LONGEST:
            raise RigError(f"a request of more than {_LONGEST} bytes is refused")
        try:
            request = cast(object, json.loads(line))
        except ValueError as error:
            raise RigError(f"a request that is not JSON is refused: {error}") from None
        if not isinstance(request, dict):
            raise RigError("a request that is not a JSON object is refused")
        arguments = cast(dict[str, Any], request)
        command = arguments.pop("command", None)
        if not isinstance(command, str) or (handler := self._handlers.get(command)) is None:
            known = ", ".join(sorted(self._handlers))
            raise RigError(f"command {command!r} is refused: it must be one of {known}")
        return handler(arguments)


def _requests(lines: BinaryIO) -> Iterator[bytes]:
    """Received lines; a line longer than `_LONGEST` is truncated to `_LONGEST + 1` bytes, so that it is refused."""
    while line := lines.readline(_LONGEST + 1):
        part = line
        while part and not part.endswith(b"\n"):
            part = lines.readline(_LONGEST + 1)
        yield line


def _shut_down_input(connection: socket.socket) -> None:
    """End the input of a connection, so that the thread that reads it ends; does nothing on a closed connection."""
    with suppress(OSError):
        connection.shutdown(socket.SHUT_RD)


_PATIENCE = 60.0
"""Time-out for a reply [s], longer than the bench takes to come to rest."""


def ask(address: str, command: str, /, *, patience: float = _PATIENCE, **arguments: object) -> Any:
    """Send a command to the emulated laboratory at `address` (`host:port`), and return the result in its reply; waits
    up to `patience` [s].

    Raises RigError if the command is refused, ConnectionLost if there is no connection, DeviceTimeout if there is no
    reply in time, and InvalidInput for an invalid address.
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
            f"the emulated laboratory at {address} did not reply to {command} within {patience:g} s; check that it is"
            " running"
        ) from None
    except OSError as error:
        raise ConnectionLost(
            f"{command} failed: no connection to the emulated laboratory at {address} ({error});"
            " check that it is running and that hardware.emulator_address is its address"
        ) from None
    return _result(address, command, line)


def place_of(address: str) -> tuple[str, int]:
    """Host and port of an address, `host:port`. Raises InvalidInput."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise InvalidInput("emulator_address", address, "it must be host:port, such as localhost:31700")
    return host.strip("[]"), int(port)


def _line(connection: socket.socket, deadline: float) -> bytes:
    """The reply, with its line ending. Raises OSError, or TimeoutError when the deadline passes."""
    received = b""
    while not received.endswith(b"\n"):
        if (left := deadline - time.monotonic()) <= 0.0:
            raise TimeoutError
        connection.settimeout(min(left, waiting.STEP))
        try:
            part = connection.recv(65536)
        except TimeoutError:
            continue
        if not part:
            raise ConnectionResetError("it closed the connection without a reply")
        received += part
    return received


def _result(address: str, command: str, line: bytes) -> Any:
    """The result in a reply. Raises RigError."""
    try:
        answer: Any = json.loads(line)
        if answer["ok"]:
            return answer["result"]
        error = str(answer["error"])
    except (ValueError, TypeError, KeyError):
        raise RigError(f"invalid reply from {address} to {command}: check that it is an emulated laboratory") from None
    raise RigError(error)
