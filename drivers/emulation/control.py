"""The control channel of an emulated laboratory: how another program does handwork, causes faults and asks the truth.

A request is one line of JSON, `{"command": "handwork", "work": "remove block", "amount": null}`; the answer is one
line, `{"ok": true, "result": ...}` or `{"ok": false, "error": "..."}`. A connection may carry any number of requests.
"""

import json
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Any, BinaryIO, cast

from drivers.errors import RigError
from sim.errors import RockbenchError

Handler = Callable[[dict[str, Any]], object]
"""Given the arguments of a command, does it; what it returns must fit into JSON."""

_LONGEST = 65536
"""Bytes of the longest request."""


class ControlServer:
    """Answers on a port of this machine that the system chooses; serves from the moment it is made.

    Each connection has a thread of its own, so that handlers may wait and may run at the same time. A handler refuses
    by raising.
    """

    def __init__(self, handlers: Mapping[str, Handler]) -> None:
        self._handlers = dict(handlers)
        self._lock = threading.Lock()
        self._served: dict[socket.socket, threading.Thread] = {}
        self._closing = False
        self._listening = socket.create_server(("127.0.0.1", 0))
        host, port = self._listening.getsockname()
        self.address = f"{host}:{port}"
        """Where it listens, as `host:port`."""
        self._accepting = threading.Thread(target=self._accept, name="emulated-control", daemon=True)
        self._accepting.start()

    def close(self) -> None:
        """Close every connection, after the handlers at work have ended. Allowed any number of times."""
        with self._lock:
            first, self._closing = not self._closing, True
            served = list(self._served.items())
        if first:
            # closing a socket does not wake the thread that waits at it, a connection does
            with socket.create_connection(self._listening.getsockname()):
                self._accepting.join()
            self._listening.close()
        for connection, thread in served:
            _hang_up(connection)
            thread.join()

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
        """The thread of one connection."""
        # a client may go at any time
        with connection, suppress(OSError), connection.makefile("rb") as lines:
            for line in _requests(lines):
                connection.sendall(self._answer(line) + b"\n")
        with self._lock:
            self._served.pop(connection, None)

    def _answer(self, line: bytes) -> bytes:
        """The answer to one request, whatever it is."""
        try:
            return json.dumps({"ok": True, "result": self._result(line)}).encode()
        except RockbenchError as error:
            text = str(error)
        except Exception as error:
            # a handler that fails must not end the conversation, and its failure must not be hidden
            text = f"{type(error).__name__}: {error}"
        return json.dumps({"ok": False, "error": text}).encode()

    def _result(self, line: bytes) -> object:
        """What the handler gives. Raises RigError for what is no request."""
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
            raise RigError(f"command {command!r} is refused: there are {known}")
        return handler(arguments)


def _requests(lines: BinaryIO) -> Iterator[bytes]:
    """What comes, line by line; of a line that is too long only the beginning."""
    while line := lines.readline(_LONGEST + 1):
        part = line
        while part and not part.endswith(b"\n"):
            part = lines.readline(_LONGEST + 1)
        yield line


def _hang_up(connection: socket.socket) -> None:
    """Let the thread that reads from the connection find its end, if it has not ended already."""
    with suppress(OSError):
        connection.shutdown(socket.SHUT_RD)
