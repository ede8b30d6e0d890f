"""The serial line: a pseudo-terminal whose other end any program opens like a serial port."""

import os
import select
import struct
import sys

from drivers.errors import DeviceNotFound

if sys.platform != "win32":
    import fcntl
    import termios
    import tty

_TCGETS2 = 0x802C542A
"""Request of Linux for the settings of a terminal with its speeds as numbers."""
_SPEED_AT = 40
"""Where the output speed stands in the answer: after four flags, a byte, nineteen control characters, one speed."""
_MOST = 4096
"""Bytes taken at once."""


class PseudoTerminal:
    """The instrument's end of a serial line. Nothing here ever waits.

    Raises DeviceNotFound on a system without pseudo-terminals.
    """

    def __init__(self) -> None:
        if sys.platform == "win32":
            raise DeviceNotFound(
                "an emulated laser on a serial line is refused: Windows has no pseudo-terminals;"
                " use the analogue connection, or run the emulated laboratory on Linux"
            )
        self._end, other = os.openpty()
        self.port = os.ttyname(other)
        """Path of the client's end."""
        os.close(other)
        # no echo and no lines: a client that has not set the port up yet sees bytes, as on a serial port
        tty.setraw(self._end)
        os.set_blocking(self._end, False)
        self._watch = select.poll()
        self._watch.register(self._end, select.POLLIN)
        self._open = True
        self.dropped = 0
        """Bytes that the client did not fetch in time."""

    @property
    def connected(self) -> bool:
        """Whether a client holds the port open."""
        return self._open and not any(event & select.POLLHUP for _, event in self._watch.poll(0))

    @property
    def baud(self) -> int:
        """Baud rate that the client has set."""
        if sys.platform == "linux":
            answer = fcntl.ioctl(self._end, _TCGETS2, bytes(64))
            return int(struct.unpack_from("I", answer, _SPEED_AT)[0])
        return int(termios.tcgetattr(self._end)[5])

    def read(self) -> bytes:
        """What the client has sent."""
        try:
            return os.read(self._end, _MOST)
        except OSError:
            # nothing there, or the client has left
            return b""

    def write(self, sent: bytes) -> None:
        """Send; what finds no room at the client is lost, as on a real line."""
        try:
            taken = os.write(self._end, sent)
        except BlockingIOError:
            taken = 0
        except OSError:
            return
        self.dropped += len(sent) - taken

    def close(self) -> None:
        """Take the instrument off the line: a client gets an error. Allowed any number of times."""
        if self._open:
            self._open = False
            os.close(self._end)
