"""Displayed status of the bench: state, connection, specimen and lasers. Independent of Qt."""

from dataclasses import dataclass
from typing import Literal

from bench.app.display import texts
from bench.events import SpecimenMounted, State
from drivers.rig import OperatorTask
from sim.specimen import Specimen

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
    """Status to be displayed for a state and a connection; `silence` is the time since the last message [s]. If the
    connection is lost, the status states this instead of the last known state.
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
    """The specimen on the table, its clamps and the target of laser 2, from the operator's actions.

    `face` is the height above the table [m] at which laser 2 measures the block's face, None while it measures storey
    2. `tilt` is the rotation [rad] from which the block was released, and `pull` the displacement [m] from which storey
    2 was released; in that position, the measured displacements are zero.
    """

    block: bool = False
    spring: bool = False
    face: float | None = None
    tilt: float = 0.0
    pull: float = 0.0
    frame_clamped: bool = False
    block_clamped: bool = False
    table_locked: bool = False

    @staticmethod
    def of(specimen: Specimen) -> "Arrangement":
        """The arrangement of a specimen before the first action."""
        return Arrangement(block=specimen.beta is not None, spring=bool(specimen.beta))

    def follow(self, event: SpecimenMounted) -> None:
        """Apply an operator's action."""
        match event.work:
            case OperatorTask.MOUNT_SPRING | OperatorTask.HOLD_BLOCK:
                self._mount(block=True, spring=True)
                self.block_clamped = event.work is OperatorTask.HOLD_BLOCK
            case OperatorTask.REMOVE_BLOCK | OperatorTask.LOCK_FRAME:
                self._mount(block=False, spring=False)
                self.frame_clamped = event.work is OperatorTask.LOCK_FRAME
            case OperatorTask.UNLOCK_FRAME:
                self.frame_clamped = False
            case OperatorTask.WATCH_BLOCK:
                self._mount(block=True, spring=False)
                self.face = event.amount
            case OperatorTask.WATCH_STOREYS:
                self.face = None
            case OperatorTask.TILT_BLOCK:
                self.tilt = event.amount or 0.0
            case OperatorTask.STAND_BLOCK_UP:
                self.tilt = 0.0
            case OperatorTask.PULL_FRAME:
                self.pull = event.amount or 0.0
            case OperatorTask.LOCK_TABLE | OperatorTask.UNLOCK_TABLE:
                self.table_locked = event.work is OperatorTask.LOCK_TABLE

    def _mount(self, *, block: bool, spring: bool) -> None:
        self.block, self.spring, self.tilt, self.pull = block, spring, 0.0, 0.0
        self.frame_clamped = self.block_clamped = False
