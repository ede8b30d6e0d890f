"""The conversation with the sensor: commands in ASCII, each answered with a prompt (manual, pp. 94 to 116)."""

import shlex

from drivers.emulation.optoncdt.actions import Actions, Mastering, Request
from drivers.emulation.optoncdt.sensor import Sensor
from drivers.emulation.optoncdt.table import WRONG_TYPE, Refusal, commands

PROMPT = b"->"
_LONGEST = 255
"""Characters of the longest command that is understood."""
_OPEN_TO_ALL = ("ECHO", "LANGUAGE")
"""Settings that a user of either level may change."""


class Dialogue:
    """Understands commands for `sensor` and answers them; `rates` are the measuring rates that it has [1/s]."""

    def __init__(self, sensor: Sensor, actions: Actions, rates: tuple[float, ...]) -> None:
        self._sensor, self._actions = sensor, actions
        self._settings = commands(rates)
        self._heard = b""
        self._waiting: Mastering | None = None

    def hear(self, received: bytes, now: float) -> bytes:
        """Everything that is to be said at the host time `now` [s], after `received` came in.

        A command ends with a line feed, with or without carriage return; while the sensor starts up it is deaf.
        """
        if now < self._sensor.ready:
            self._heard, self._waiting = b"", None
            return b""
        self._heard += received
        said = self._finish(now)
        while self._waiting is None and b"\n" in self._heard and now >= self._sensor.ready:
            line, self._heard = self._heard.split(b"\n", 1)
            said += self._answer(line.rstrip(b"\r"), now)
        if b"\n" not in self._heard:
            # of a command without end, so much is kept that it is too long
            self._heard = self._heard[: _LONGEST + 1]
        return said

    def _answer(self, line: bytes, now: float) -> bytes:
        """The answer to one command with its prompt; nothing when it will come later."""
        text = line.decode("ascii", "replace").strip()
        try:
            if len(text) > _LONGEST:
                raise Refusal(214, "Entered command is too long to be processed")
            answer = self._obey(text, now)
        except Refusal as refusal:
            answer = [str(refusal)]
        if isinstance(answer, Mastering):
            self._waiting = answer
            return self._finish(now)
        return _reply(answer)

    def _finish(self, now: float) -> bytes:
        """The answer that had to wait, when there is one."""
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

    def _obey(self, text: str, now: float) -> list[str] | Mastering:
        """Do what the command says. Raises Refusal."""
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
    """An answer as it goes over the line: its lines and the prompt, which is not followed by a line break."""
    return "".join(f"{line}\r\n" for line in lines).encode("ascii", "replace") + PROMPT
