"""Displayed status of the bench: state, connection, specimen and lasers. Independent of Qt."""

from dataclasses import dataclass
from typing import Literal

from bench.app.display import texts
from bench.events import SpecimenMounted, State
from drivers.rig import OperatorTask

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
class Status:
    """Displayed word and reason, and the level (colour) and shape that represent them."""

    word: str
    reason: str
    level: Level
    shape: Shape


def bench_status(
    link: Literal["none", "starting", "linked", "no link", "over"], state: State, reason: str, silence: float
) -> Status:
    """Status to be displayed for a state and a connection; `silence` is the time since the last message [s]. Without a
    connection, the last known state is not shown.
    """
    match link:
        case "none":
            return Status(texts.NO_SESSION, texts.NO_SESSION_WHY, "calm", "ring")
        case "starting":
            return Status(texts.STARTING, texts.STARTING_WHY, "calm", "ring")
        case "no link":
            return Status(texts.NO_LINK, texts.NO_LINK_WHY.format(age=silence), "alarm", "cross")
        case "linked" | "over":
            level, shape = _LOOKS[state]
            return Status(texts.WORDS[state], reason, level, shape)


@dataclass
class Arrangement:
    """The specimen on the table and the target of laser 2, from the operator's actions.

    `face` is the height above the table [m] at which laser 2 measures the block's face, None while it measures storey
    2. `tilt` is the rotation [rad] from which the block was released; at this rotation, the displacement measured on
    the face is zero.
    """

    block: bool = False
    spring: bool = False
    face: float | None = None
    tilt: float = 0.0

    def follow(self, event: SpecimenMounted) -> None:
        """Apply an operator's action."""
        match event.work:
            case OperatorTask.MOUNT_SPRING | OperatorTask.HOLD_BLOCK:
                self.block = self.spring = True
            case OperatorTask.REMOVE_BLOCK | OperatorTask.LOCK_FRAME:
                self.block = self.spring = False
            case OperatorTask.WATCH_BLOCK:
                self.block, self.spring, self.face, self.tilt = True, False, event.amount, 0.0
            case OperatorTask.WATCH_STOREYS:
                self.face = None
            case OperatorTask.TILT_BLOCK:
                self.tilt = event.amount or 0.0
            case _:
                pass
