"""Pseudo-terminal that a client opens as the sensor's serial port, and the sensor's command dialogue."""

import os
import select
import shlex
import struct
import sys

from drivers.emulation.optoncdt.actions import Actions, Mastering, Request
from drivers.emulation.optoncdt.sensor import Sensor
from drivers.emulation.optoncdt.settings import WRONG_TYPE, Refusal, commands
from drivers.errors import DeviceNotFound

if sys.platform != "win32":
    import fcntl
    import termios
    import tty

_TCGETS2 = 0x802C542A
"""Linux ioctl request for terminal settings with numeric speeds."""
_SPEED_AT = 40
"""Offset of the output speed in the reply [bytes]: after four flag words, one byte, nineteen control characters and the
input speed.
"""
_MOST = 4096
"""Maximum number of bytes per read."""
_CAPACITY = 640 * 1024
"""Number of bytes that Linux buffers for a serial port (TTYB_DEFAULT_MEM_LIMIT). For a pseudo-terminal it buffers only
16 KiB, which 4000 measurements/s with counter and time stamp fill in a third of a second.
"""


class SerialLine:
    """Base class for the instrument's end of a serial line: buffers the bytes that the system has not yet accepted."""

    def __init__(self) -> None:
        self._pending = b""
        self.dropped = 0
        """Number of bytes lost because the client did not read them in time."""

    @property
    def pending(self) -> int:
        """Number of bytes that the system has not yet accepted."""
        return len(self._pending)

    def write(self, sent: bytes) -> None:
        """Send bytes, after those still pending; those beyond the capacity of a serial port's buffer are lost."""
        kept = sent[: max(_CAPACITY - len(self._pending), 0)]
        self.dropped += len(sent) - len(kept)
        self._pending += kept
        if not self._pending:
            return
        try:
            self._pending = self._pending[self.send(self._pending) :]
        except BlockingIOError:
            return
        except OSError:
            self._pending = b""

    def discard(self) -> None:
        """Discard the pending bytes, as when no client is connected."""
        self._pending = b""

    def send(self, pending: bytes) -> int:
        """Pass bytes to the system; returns the number that it accepted. Raises OSError."""
        raise NotImplementedError


class PseudoTerminal(SerialLine):
    """The instrument's end of a serial line. No call blocks.

    Raises DeviceNotFound on a system without pseudo-terminals.
    """

    def __init__(self) -> None:
        if sys.platform == "win32":
            raise DeviceNotFound(
                "an emulated laser on a serial line is refused: Windows has no pseudo-terminals;"
                " use the socket or the analogue connection"
            )
        super().__init__()
        self._end, other = os.openpty()
        self.port = os.ttyname(other)
        """Path of the client's end."""
        os.close(other)
        # no echo, no line mode: a client that has not configured the port receives plain bytes, as on a serial port
        tty.setraw(self._end)
        os.set_blocking(self._end, False)
        self._watch = select.poll()
        self._watch.register(self._end, select.POLLIN)
        self._open = True

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
        """Bytes sent by the client."""
        try:
            return os.read(self._end, _MOST)
        except OSError:
            # no data yet, or the client has disconnected
            return b""

    def send(self, pending: bytes) -> int:
        return os.write(self._end, pending)

    def close(self) -> None:
        """Close the line; the client's next access fails. May be called repeatedly."""
        if self._open:
            self._open = False
            os.close(self._end)


PROMPT = b"->"
_LONGEST = 255
"""Length of the longest accepted command [characters]."""
_OPEN_TO_ALL = ("ECHO", "LANGUAGE")
"""Settings that both user levels may change."""


class Dialogue:
    """Executes the commands received for `sensor` and returns its answers; `rates` are its measuring rates [1/s]."""

    def __init__(self, sensor: Sensor, actions: Actions, rates: tuple[float, ...]) -> None:
        self._sensor, self._actions = sensor, actions
        self._settings = commands(rates)
        self._received = b""
        self._waiting: Mastering | None = None

    def receive(self, received: bytes, now: float) -> bytes:
        """Answers due at the host time `now` [s], at which `received` has arrived.

        A command ends with a line feed, with or without carriage return; input during start-up is ignored.
        """
        if now < self._sensor.ready:
            self._received, self._waiting = b"", None
            return b""
        self._received += received
        said = self._finish(now)
        while self._waiting is None and b"\n" in self._received and now >= self._sensor.ready:
            line, self._received = self._received.split(b"\n", 1)
            said += self._answer(line.rstrip(b"\r"), now)
        if b"\n" not in self._received:
            # keep enough of an unterminated command for it to be rejected as too long
            self._received = self._received[: _LONGEST + 1]
        return said

    def _answer(self, line: bytes, now: float) -> bytes:
        """The answer to one command with its prompt; empty while the answer is pending."""
        text = line.decode("ascii", "replace").strip()
        try:
            if len(text) > _LONGEST:
                raise Refusal(214, "Entered command is too long to be processed")
            answer = self._execute(text, now)
        except Refusal as refusal:
            answer = [str(refusal)]
        if isinstance(answer, Mastering):
            self._waiting = answer
            return self._finish(now)
        return _reply(answer)

    def _finish(self, now: float) -> bytes:
        """The pending answer; empty until it is available."""
        if self._waiting is None:
            return b""
        try:
            answer = self._waiting.outcome(now)
        except Refusal as refusal:
            answer = [str(refusal)]
        if answer is None:
            return b""
        self._waiting = None
        return _reply(answer)

    def _execute(self, text: str, now: float) -> list[str] | Mastering:
        """Execute the command. Raises Refusal."""
        try:
            words = shlex.split(text.upper())
        except ValueError:
            raise Refusal(234, WRONG_TYPE) from None
        if not words:
            return []
        name, parameters = words[0], words[1:]
        request = Request(text, parameters, now)
        if name == "PRINT":
            return self._print(parameters)
        if (action := self._actions.table.get(name)) is not None:
            return action(request)
        if (setting := self._settings.get(name)) is None:
            raise Refusal(210, "Unknown command")
        if not parameters:
            return [f"{name} {setting.show(self._sensor.settings)}"]
        if name not in _OPEN_TO_ALL:
            self._actions.require_professional()
        self._sensor.apply(setting.change(self._sensor.settings, parameters), now)
        return self._actions.done(request)

    def _print(self, parameters: list[str]) -> list[str]:
        if parameters not in ([], ["ALL"]):
            raise Refusal(234, WRONG_TYPE)
        shown = [f"{name} {setting.show(self._sensor.settings)}" for name, setting in self._settings.items()]
        return [*shown, self._actions.mastering]


def _reply(lines: list[str]) -> bytes:
    """The bytes of an answer: its lines and the prompt, which is not followed by a line break."""
    return "".join(f"{line}\r\n" for line in lines).encode("ascii", "replace") + PROMPT
