"""Commands to the sensor over an open serial port, one at a time, and the parsing of its replies."""

import re
import time

from serial import Serial

from drivers.errors import ConnectionLost, DeviceTimeout, RigError

_WORD = re.compile(rb"[\x00-\x3f][\x40-\x7f][\x80-\xff]")
_PROMPT = re.compile(rb"(?:^|(?<=[\r\n\x80-\xff]))->")
"""Prompt, accepted only at the start of a line or after the rest of a truncated value, since elsewhere the same two
bytes may be part of text or of a value.
"""
_NOT_TEXT = re.compile(rb"[^\t\r\n\x20-\x7e]")


class Reply:
    """Collects the bytes after a command up to the prompt.

    Measured values that arrive within the reply are discarded, since a value split by text would be misread.
    """

    def __init__(self) -> None:
        self.complete = False
        self.prompt_in_value = False
        """Whether bytes were received that resemble a prompt but may be part of a value; they are accepted as the
        prompt if no unambiguous one follows.
        """
        self.rest = b""
        """Bytes after the prompt."""
        self._text = b""

    def feed(self, chunk: bytes) -> None:
        """Add bytes from the line; those after the prompt are kept in `rest`."""
        line, self._text = self._text + chunk, b""
        self.prompt_in_value |= b"->" in line
        place = 0
        for start, end in (*(word.span() for word in _WORD.finditer(line)), (len(line), len(line))):
            self._text += line[place:start]
            place = end
            if found := _PROMPT.search(self._text):
                self.complete = True
                self.rest = line[start - (len(self._text) - found.end()) :]
                self._text = self._text[: found.start()]
                return

    @property
    def lines(self) -> list[str]:
        """The non-empty lines of text, stripped."""
        text = _NOT_TEXT.sub(b"", _WORD.sub(b"", self._text)).decode("ascii")
        return [line for part in re.split(r"[\r\n]+", text) if (line := part.strip())]


def error_in(command: str, lines: list[str]) -> str | None:
    """The code and text of the sensor's error in the lines that answer `command`; None if the command succeeded.

    A code is at the beginning of a line or after the echo of the command. A warning (W and a number) does not prevent
    the execution of the command (manual of the optoNCDT 1320, p. 82).
    """
    name = re.escape(command.split()[0])
    for line in lines:
        if found := re.match(rf"(?:{name}\b.*?\s)?(E\d{{2,3}}\b.*)", line, re.IGNORECASE):
            return found[1].strip()
    return None


def parameters_in(name: str, lines: list[str]) -> list[str]:
    """The parameters of the setting `name`, in capitals, from the lines that answer its query.

    The answer is `<name> <parameter> ...`; an echo `<name> ok` may precede it, and a list may take several lines.
    """
    words = (word.upper() for line in lines for word in line.split())
    return [word for word in words if word not in (name, "OK")]


USUAL = 1.0
"""Time-out of a command [s]."""
SLOW = 3.0
"""Time-out [s] of a command that waits for a measurement, which takes at most 2 s (manual, p. 108)."""


class CommandRefused(RigError):
    """The sensor replied to a command with an error; `answer` is its code and text."""

    error_code = "command_refused"

    def __init__(self, who: str, command: str, answer: str) -> None:
        if answer.startswith("E202"):
            remedy = "select the professional user level in the sensor's web interface"
        else:
            remedy = "check the command in the manual of the sensor's firmware"
        super().__init__(f"{who} refused {command}: {answer}; {remedy}")
        self.answer = answer


class Dialogue:
    """Command dialogue with a sensor on `port`, whose read time-out is about 20 ms. `who` names sensor and port in
    errors.

    Methods that use the port raise ConnectionLost if it has disappeared.
    """

    def __init__(self, who: str, port: Serial) -> None:
        self.who = who
        self.port = port

    def ask(self, command: str, timeout: float = USUAL) -> list[str]:
        """Send a command; returns the lines of the answer.

        Raises CommandRefused, and DeviceTimeout after `timeout` [s].
        """
        reply = Reply()
        deadline = time.monotonic() + timeout
        self.discard()
        self.send(command)
        while not reply.complete and time.monotonic() < deadline:
            reply.feed(self._read())
        return self.judged(command, reply, timeout)

    def setting(self, name: str, timeout: float = USUAL) -> list[str]:
        """The present parameters of a setting, in capitals; raises the errors of `ask`."""
        return parameters_in(name, self.ask(name, timeout))

    def send(self, command: str) -> None:
        """Send a command without waiting for the answer."""
        try:
            self.port.write(command.encode("ascii") + b"\r\n")
        except OSError as error:
            raise self.gone(error) from error

    def judged(self, command: str, reply: Reply, timeout: float) -> list[str]:
        """The lines of a received reply. Raises CommandRefused, or DeviceTimeout if the reply is incomplete."""
        if not (reply.complete or reply.prompt_in_value):
            raise DeviceTimeout(
                f"{self.who} did not reply to {command} within {timeout:g} s; check its power and cable, and reopen it"
            )
        lines = reply.lines
        if (answer := error_in(command, lines)) is not None:
            raise CommandRefused(self.who, command, answer)
        return lines

    def discard(self) -> None:
        """Discard all bytes received but not read."""
        try:
            self.port.read(self.port.in_waiting)
        except OSError as error:
            raise self.gone(error) from error

    def drain(self, quiet: float, limit: float) -> bool:
        """Discard input until the line has been quiet for `quiet` [s]; returns False if this takes longer than `limit`
        [s].
        """
        begun = last = time.monotonic()
        while (now := time.monotonic()) - last < quiet:
            if now - begun > limit:
                return False
            if self._read():
                last = time.monotonic()
        return True

    def gone(self, error: Exception) -> ConnectionLost:
        """The ConnectionLost for `error`, raised by the port."""
        return ConnectionLost(f"{self.who} was disconnected ({error}); plug it in, check its power, and reopen it")

    def _read(self) -> bytes:
        """Bytes received; if there are none, waits for one byte, at most until the port's read time-out."""
        try:
            return self.port.read(max(1, self.port.in_waiting))
        except OSError as error:
            raise self.gone(error) from error
