"""Commands to the sensor, one at a time, over an open serial port."""

import time

from serial import Serial

from drivers.errors import ConnectionLost, DeviceTimeout, RigError
from drivers.optoncdt.reply import Reply, error_in, parameters_in

USUAL = 1.0
"""How long the sensor may take for a command [s]."""
SLOW = 3.0
"""How long it may take where it waits for a measurement of its own, 2 s at most (manual, p. 108) [s]."""


class CommandRefused(RigError):
    """The sensor answered a command with an error; `answer` is its code and text."""

    error_code = "command_refused"

    def __init__(self, who: str, command: str, answer: str) -> None:
        if answer.startswith("E202"):
            remedy = "switch it to the user level professional in its web interface"
        else:
            remedy = "compare the command with the manual of its firmware"
        super().__init__(f"{who} refused {command}: {answer}; {remedy}")
        self.answer = answer


class Dialogue:
    """`who` names the sensor and its port in errors; `port` has a read time-out of a few hundredths of a second.

    Every method raises ConnectionLost when the port is gone.
    """

    def __init__(self, who: str, port: Serial) -> None:
        self.who = who
        self.port = port

    def ask(self, command: str, timeout: float = USUAL) -> list[str]:
        """The lines that the sensor answers. Raises CommandRefused, and DeviceTimeout after `timeout` [s]."""
        reply = Reply()
        deadline = time.monotonic() + timeout
        self.discard()
        self.send(command)
        while not reply.complete and time.monotonic() < deadline:
            reply.feed(self._read())
        return self.judged(command, reply, timeout)

    def setting(self, name: str, timeout: float = USUAL) -> list[str]:
        """The parameters of a setting as they are in the sensor, in capitals; raises as `ask` does."""
        return parameters_in(name, self.ask(name, timeout))

    def send(self, command: str) -> None:
        """Send a command and do not wait for the answer."""
        try:
            self.port.write(command.encode("ascii") + b"\r\n")
        except OSError as error:
            raise self.gone(error) from error

    def judged(self, command: str, reply: Reply, timeout: float) -> list[str]:
        """The lines of a reply that was waited for. Raises CommandRefused, or DeviceTimeout when it is not complete."""
        if not (reply.complete or reply.prompt_in_value):
            raise DeviceTimeout(
                f"{self.who} did not answer {command} within {timeout:g} s; check its power and cable, and open it anew"
            )
        lines = reply.lines
        if (answer := error_in(command, lines)) is not None:
            raise CommandRefused(self.who, command, answer)
        return lines

    def discard(self) -> None:
        """Drop what has arrived and was not read."""
        try:
            self.port.read(self.port.in_waiting)
        except OSError as error:
            raise self.gone(error) from error

    def drain(self, quiet: float, limit: float) -> bool:
        """Drop what arrives until nothing has for `quiet` [s]; False when that did not happen within `limit` [s]."""
        begun = last = time.monotonic()
        while (now := time.monotonic()) - last < quiet:
            if now - begun > limit:
                return False
            if self._read():
                last = time.monotonic()
        return True

    def gone(self, error: Exception) -> ConnectionLost:
        """What to raise when the port failed with `error`."""
        return ConnectionLost(f"{self.who} is gone ({error}); plug it in, check its power, and open it anew")

    def _read(self) -> bytes:
        """What has arrived; waits for the read time-out of the port when there is nothing."""
        try:
            return self.port.read(max(1, self.port.in_waiting))
        except OSError as error:
            raise self.gone(error) from error
