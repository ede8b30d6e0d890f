"""Search for sensors on the serial ports of this machine: identity and baud rate."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.errors import DeviceNotFound, DeviceTimeout, RigError
from drivers.optoncdt.dialogue import CommandRefused, Dialogue
from drivers.optoncdt.port import has_baud, listed_ports, open_port
from sim.errors import InvalidInput
from sim.sweep import in_threads

FACTORY_BAUD = 921_600
BAUDS = (FACTORY_BAUD, 1_000_000, 691_200, 460_800, 256_000, 230_400, 128_000, 115_200, 56_000, 19_200, 9_600)
"""Baud rates of the sensor, the factory setting first (manual, p. 84 and p. 116)."""

_IDENTITY = "GETINFO"


@dataclass(frozen=True)
class SensorInfo:
    """The identity of a sensor; `measuring_range` [m]."""

    model: str
    serial: str
    measuring_range: float
    firmware: str
    article: str
    option: str

    @property
    def supported(self) -> bool:
        """Whether this driver supports the sensor's commands and scaling."""
        return re.match(r"ILD\s?1420\b", self.model, re.IGNORECASE) is not None

    @property
    def identity(self) -> str:
        """Model, measuring range, serial number and firmware in one line."""
        return f"{self.model}, {self.measuring_range * 1e3:g} mm, serial number {self.serial}, firmware {self.firmware}"


def info_in(lines: list[str]) -> SensorInfo | None:
    """The identity in the sensor's reply to `GETINFO`; None unless `lines` contain a name and a measuring range.

    Format (manual, p. 97): one `key: value` per line, the range with its unit.
    """
    pairs = (line.split(":", 1) for line in lines if ":" in line)
    given = {key.strip().lower(): value.strip() for key, value in pairs}
    measuring_range = re.match(r"(\d+(?:\.\d+)?)\s*mm\b", given.get("measuring range", ""), re.IGNORECASE)
    if not given.get("name") or measuring_range is None:
        return None
    serial, firmware, article, option = (given.get(key, "") for key in ("serial", "version", "article", "option"))
    return SensorInfo(given["name"], serial, float(measuring_range[1]) / 1e3, firmware, article, option)


_PROBE = 0.3
"""Time-out of a command at one baud rate [s]."""
_QUIET = 0.05
"""Time without input after which the line counts as quiet [s]; adapters delay data by up to 16 ms."""
_SILENCE = "OUTPUT NONE"
_TRIES = 3
"""Attempts per command; bytes sent earlier at a wrong baud rate can corrupt the first command at the right one."""
_DRAINED = 1.0
"""Longest wait for a quiet line [s]."""


@dataclass(frozen=True)
class Answer:
    """Answer of a sensor: its baud rate, its identity, and its refusal of the command, if any."""

    baud: int
    info: SensorInfo
    refusal: CommandRefused | None


def silenced(dialogue: Dialogue, item: str, baud: int | None) -> Answer:
    """Switch the output of the sensor off, at `baud`, or at the detected baud rate if `baud` is None.

    The first command may be lost in a running stream, so several attempts are made. Raises DeviceNotFound if nothing
    responds, InvalidInput for `item` if the sensor responds at a baud rate other than `baud`, CommandRefused if it
    rejects the command or continues to stream.
    """
    first, *others = BAUDS if baud is None else (baud, *(other for other in BAUDS if other != baud))
    answer = _answer(dialogue, first, _SILENCE, tries=3) or _search(dialogue, others, _SILENCE)
    if answer is None:
        raise DeviceNotFound(
            f"{dialogue.who} does not respond at any baud rate: switch the sensor on, check that the two RS422 "
            "pairs are not swapped or reversed, and that the data output is not set to its web interface"
        )
    if baud is not None and answer.baud != baud:
        allowed = f"{dialogue.who} responds at {answer.baud} baud: set this baud rate, or omit the key"
        raise InvalidInput(item, baud, allowed)
    if answer.refusal is not None:
        raise answer.refusal
    return answer


def detect_sensor(dialogue: Dialogue) -> Answer | None:
    """Detect the sensor and its baud rate without changing its settings; None if nothing responds."""
    return _search(dialogue, BAUDS, "GETUSERLEVEL")


def _search(dialogue: Dialogue, bauds: Sequence[int], command: str) -> Answer | None:
    answers = (_answer(dialogue, baud, command, tries=1) for baud in bauds)
    return next((answer for answer in answers if answer is not None), None)


def _answer(dialogue: Dialogue, baud: int, command: str, tries: int) -> Answer | None:
    if not has_baud(dialogue.port, baud):
        return None
    for _ in range(tries):
        try:
            refusal = _refusal(dialogue, command)
        except DeviceTimeout:
            continue
        # noise may resemble a prompt, so only a reply that contains a name and a measuring range is accepted
        if (found := _identity(dialogue)) is not None:
            return Answer(baud, found, refusal)
    return None


def _refusal(dialogue: Dialogue, command: str) -> CommandRefused | None:
    """The error if the sensor rejects a command at every attempt; None as soon as it executes the command. Raises
    DeviceTimeout.
    """
    refusal = None
    for _ in range(_TRIES):
        try:
            dialogue.ask(command, _PROBE)
        except CommandRefused as error:
            refusal = error
            continue
        # an error message interleaved with values can be missed, so the effect of the command is checked
        if command != _SILENCE or dialogue.drain(_QUIET, _DRAINED):
            return None
        refusal = CommandRefused(dialogue.who, command, "values continue to arrive")
    return refusal


def _identity(dialogue: Dialogue) -> SensorInfo | None:
    dialogue.drain(_QUIET, _DRAINED)
    try:
        return info_in(dialogue.ask(_IDENTITY))
    except (CommandRefused, DeviceTimeout):
        return None


@dataclass(frozen=True)
class FoundLaser:
    """Search result of one serial port: the sensor and its baud rate if one responds, and the reason, if any, why it
    cannot be used.
    """

    port: str
    baud: int | None
    info: SensorInfo | None
    problem: str | None


def find_lasers(ports: Sequence[str] | None = None) -> list[FoundLaser]:
    """One search result per port of `ports`, by default of all ports that the system lists.

    Sends only queries, at each possible baud rate, so a sensor's settings do not change and a running stream continues.
    The ports are searched in parallel; a port at which no sensor responds takes about 4 s.
    """
    names = list(dict.fromkeys(listed_ports() if ports is None else ports))
    if not names:
        return []
    return in_threads(_probed, names, threads=len(names))


def _probed(port: str) -> FoundLaser:
    try:
        with open_port("the port", port, FACTORY_BAUD) as opened:
            answer = detect_sensor(Dialogue(port, opened))
    except RigError as error:
        return FoundLaser(port, None, None, str(error))
    if answer is None:
        silent = "no sensor responds at any baud rate; check its power and the two RS422 pairs"
        return FoundLaser(port, None, None, silent)
    problem = None if answer.info.supported else "not an ILD1420: this driver does not support its data format"
    return FoundLaser(port, answer.baud, answer.info, problem)
