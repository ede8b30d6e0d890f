"""Finding the baud rate of a sensor, and who it is."""

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.errors import DeviceNotFound, DeviceTimeout
from drivers.optoncdt import info
from drivers.optoncdt.dialogue import CommandRefused, Dialogue
from drivers.optoncdt.info import SensorInfo
from drivers.optoncdt.port import BAUDS, has_baud
from sim.errors import InvalidInput

_PROBE = 0.3
"""How long an answer is waited for at one baud rate [s]."""
_QUIET = 0.05
"""The line is quiet when nothing came for so long: adapters hold back data for up to 16 ms [s]."""
_SILENCE = "OUTPUT NONE"
_TRIES = 3
"""How often a command is given: what was heard at other baud rates spoils the first one that is understood."""
_DRAINED = 1.0
"""How long a line may take to become quiet [s]."""


@dataclass(frozen=True)
class Answer:
    """The baud rate at which something answers, the sensor that it says it is, and whether it refused the command."""

    baud: int
    info: SensorInfo
    refusal: CommandRefused | None


def silenced(dialogue: Dialogue, item: str, baud: int | None) -> Answer:
    """Switch the output of the sensor off, at `baud` or at the baud rate that it turns out to have.

    The stream may be running, so that the first command may be lost. Raises DeviceNotFound when nothing answers,
    InvalidInput about `item` when the sensor answers at another baud rate than `baud`, CommandRefused when it goes on
    streaming.
    """
    first, *others = BAUDS if baud is None else (baud, *(other for other in BAUDS if other != baud))
    answer = _answer(dialogue, first, _SILENCE, tries=3) or _search(dialogue, others, _SILENCE)
    if answer is None:
        raise DeviceNotFound(
            f"{dialogue.who} says nothing at any baud rate: switch the sensor on, check that the two RS422 pairs are"
            " not swapped or reversed, and that the data output is not set to its web interface"
        )
    if baud is not None and answer.baud != baud:
        allowed = f"{dialogue.who} answers at {answer.baud}: set the baud rate to that, or leave it out"
        raise InvalidInput(item, baud, allowed)
    if answer.refusal is not None:
        raise answer.refusal
    return answer


def asked(dialogue: Dialogue) -> Answer | None:
    """Find out the baud rate and the sensor without changing its settings; None when nothing answers."""
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
        # noise may look like a prompt; only a name and a range are an answer
        if (found := _identity(dialogue)) is not None:
            return Answer(baud, found, refusal)
    return None


def _refusal(dialogue: Dialogue, command: str) -> CommandRefused | None:
    """What the sensor has against a command whenever it is given; None when it is carried out. DeviceTimeout."""
    refusal = None
    for _ in range(_TRIES):
        try:
            dialogue.ask(command, _PROBE)
        except CommandRefused as error:
            refusal = error
            continue
        # an error that stands within a value is not seen: what counts is what the sensor does
        if command != _SILENCE or dialogue.drain(_QUIET, _DRAINED):
            return None
        refusal = CommandRefused(dialogue.who, command, "values keep coming")
    return refusal


def _identity(dialogue: Dialogue) -> SensorInfo | None:
    dialogue.drain(_QUIET, _DRAINED)
    try:
        return info.info_in(dialogue.ask(info.COMMAND))
    except (CommandRefused, DeviceTimeout):
        return None
