"""What the header says of the bench, from what was heard and how long ago. Knows nothing of Qt."""

from dataclasses import dataclass
from typing import Literal

from bench.events import State
from bench.gui import texts

Level = Literal["calm", "good", "wait", "alarm"]
Shape = Literal["ring", "disc", "triangle", "square", "octagon", "cross"]

_LOOKS: dict[State, tuple[Level, Shape]] = {
    State.IDLE: ("calm", "ring"),
    State.ARMED: ("wait", "triangle"),
    State.RUNNING: ("good", "disc"),
    State.WAITING: ("wait", "square"),
    State.STOPPING: ("wait", "octagon"),
    State.ABORTING: ("alarm", "octagon"),
    State.HALTED: ("alarm", "octagon"),
    State.CLOSED: ("calm", "ring"),
}
DRIVEN = frozenset({State.ARMED, State.RUNNING, State.STOPPING, State.ABORTING})
"""States in which the rig is armed."""


@dataclass(frozen=True)
class Standing:
    """Word, reason, and the look that says the same again in colour and in shape."""

    word: str
    reason: str
    level: Level
    shape: Shape


def standing(
    link: Literal["none", "starting", "linked", "no link", "over"], state: State, reason: str, silence: float
) -> Standing:
    """`silence` [s] is how long nothing was heard: without a link no last known state is shown."""
    match link:
        case "none":
            return Standing(texts.NO_SESSION, texts.NO_SESSION_WHY, "calm", "ring")
        case "starting":
            return Standing(texts.STARTING, texts.STARTING_WHY, "calm", "ring")
        case "no link":
            return Standing(texts.NO_LINK, texts.NO_LINK_WHY.format(age=silence), "alarm", "cross")
        case "linked" | "over":
            level, shape = _LOOKS[state]
            return Standing(texts.WORDS[state], reason, level, shape)
