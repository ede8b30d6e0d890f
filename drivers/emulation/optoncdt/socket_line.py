"""TCP socket on this machine in place of the sensor's serial line, as provided by a serial device server."""

import socket
from contextlib import suppress

from drivers.emulation.optoncdt.dialogue import SerialLine

_MOST = 4096
"""Maximum number of bytes per read."""
_BUFFER = 1 << 16
"""Requested size of the system's send buffer for a client that does not read [bytes]; the system may double it."""


class SocketLine(SerialLine):
    """The instrument's end of a serial line, for one client at a time. No call blocks."""

    def __init__(self) -> None:
        super().__init__()
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=1)
        self._listener.setblocking(False)
        self.port = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        """Address that the client opens."""
        self._client: socket.socket | None = None

    @property
    def connected(self) -> bool:
        """Whether a client holds the line open."""
        if self._client is None:
            # no client is waiting, or the line is closed
            with suppress(OSError):
                self._client, _ = self._listener.accept()
                self._client.setblocking(False)
                self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER)
        return self._client is not None

    @property
    def baud(self) -> None:
        """Always None, because a socket does not transmit the client's baud rate."""

    def read(self) -> bytes:
        """Bytes sent by the client."""
        if self._client is None:
            return b""
        try:
            received = self._client.recv(_MOST)
        except BlockingIOError:
            return b""
        except OSError:
            received = b""
        if not received:
            self._disconnect()
        return received

    def send(self, pending: bytes) -> int:
        if self._client is None:
            raise OSError
        try:
            return self._client.send(pending)
        except BlockingIOError:
            raise
        except OSError:
            self._disconnect()
            raise

    def close(self) -> None:
        """Close the line; the client's next access fails. May be called repeatedly."""
        self._listener.close()
        self._disconnect()

    def _disconnect(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None
