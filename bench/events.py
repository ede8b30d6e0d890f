"""Events of a run, each declared once with its columns in the data file, its journal line and its label in the log.

The recorder, the live analysis, the console and the window are subscribers: functions called with each event in the
engine's thread, in the order of subscription. A subscriber must therefore queue long computations.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from math import nan
from typing import ClassVar, TypeVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from drivers.rig import Alignment, Block, OperatorTask, RawValues
from sim.parameters import Parameters, column
from sim.specimen import Specimen

Array = NDArray[np.float64]


class State(StrEnum):
    """State of the bench."""

    IDLE = "idle"
    ARMED = "armed"
    RUNNING = "running"
    WAITING = "waiting for the operator"
    STOPPING = "stopping"
    ABORTING = "aborting"
    HALTED = "halted"
    CLOSED = "closed"


@dataclass(frozen=True)
class Event:
    """Event at `time` [s] on the bench's clock, counted from the start of the session.

    If `time` is NaN, the stream sets it to the time of publication.
    """

    table: ClassVar[str] = ""
    """Path, below /entry, of the data file's table with the columns of the event; empty for an event without one."""
    journalled: ClassVar[bool] = True
    """Whether the event is written to the journal; frequent events are not."""
    notice: ClassVar[str] = ""
    """Label in the logs of the terminal and the window; empty for events that are not logged."""
    grave: ClassVar[bool] = False
    """Whether the event needs the operator's attention."""

    time: float = field(default=nan, kw_only=True, metadata={"unit": "s", "description": "bench time"})

    @property
    def line(self) -> str:
        """Text of the event in the journal."""
        names = (each.name for each in fields(self) if each.name != "time")
        return ", ".join(f"{name} = {getattr(self, name)}" for name in names)


E = TypeVar("E", bound=Event)


@dataclass_transform(frozen_default=True, field_specifiers=(column, field))
def event(
    *, table: str = "", journalled: bool = True, notice: str = "", grave: bool = False, eq: bool = True
) -> Callable[[type[E]], type[E]]:
    """Class decorator that declares a frozen event; see the class variables of `Event`.

    The columns of its `table` are the fields declared by `column`. A field of shape (n,), or a tuple of n dataclasses
    with their own columns, gives n rows per event; such rows have no time column.
    """

    def declare(kind: type[E]) -> type[E]:
        kind.table, kind.journalled, kind.notice, kind.grave = table, journalled, notice, grave
        return dataclass(frozen=True, eq=eq)(kind)

    return declare


@event(table="state_changes")
class StateChanged(Event):
    """Transition of the bench from one state to another, with its reason, and the `code` and `subject` of the cause."""

    before: State = column("", "state before the transition")
    after: State = column("", "state after the transition")
    reason: str = column("", "reason, as in the journal")
    code: str = column("", "code of the cause of an ending; empty for an ordinary transition", default="")
    subject: str = column("", "subject of the cause: kind of request, limited quantity or open inputs", default="")

    @property
    def line(self) -> str:
        return f"{self.before} -> {self.after}: {self.reason}"


@event(journalled=False)
class Acquired(Event):
    """A block of samples as read, and the drive [V], shape (n,), played during its acquisition.

    `run` counts the armings of the rig; the block's `first` sample index is relative to the start of the run.
    `signals`, shape (n, n_signals), are in SI units, tared for the run, in the order of `bench.analysis.signals`.
    `magnitudes` returns the largest magnitude in the block of each quantity that the guard limits, by key, in SI units.
    A subscriber may call `magnitudes` only before it returns.
    """

    run: int
    block: Block
    drive: Array
    signals: Array = field(default_factory=lambda: np.empty((0, 0)))
    magnitudes: Callable[[], Mapping[str, float]] = dict[str, float]


@event(journalled=False)
class ValuesReceived(Event):
    """Values of sensors with free-running clocks, received in `run` since the previous event of this kind."""

    run: int
    raw: tuple[RawValues, ...]


@event(table="operator_actions")
class SpecimenMounted(Event):
    """The operator has completed the action `work`, which may have an `amount`; `specimen` is now on the table."""

    specimen: Specimen
    work: OperatorTask = column("", "action of the operator")
    amount: float | None = column(
        "of the action", "amount of the action, in SI units; absent if it has none", default=None
    )
    beta: float | None = column(
        "1", "stiffness ratio of the mounted spring; absent for the bare frame", default=None, init=False
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "beta", self.specimen.label)

    @property
    def line(self) -> str:
        amount = "" if self.amount is None else f" {self.amount:g}"
        return f"{self.work}{amount}: {'bare frame' if self.beta is None else f'beta = {self.beta:g}'}"


@event(table="instrument/alignments")
class SensorsAligned(Event):
    """Alignment of sensors with free-running clocks to the sample clock in `run`; published at the end of the run."""

    run: int = column("1", "number of the run; each arming of the rig begins one")
    alignments: tuple[Alignment, ...] = column("", "one row for each sensor")

    @property
    def line(self) -> str:
        return "; ".join(map(str, self.alignments))


@event(notice="step")
class StepStarted(Event):
    """A step of the plan has begun; `text` describes the step."""

    text: str

    @property
    def line(self) -> str:
        return self.text


@event(journalled=False)
class Progress(Event):
    """Completed fraction of the campaign (0 to 1), current step, and estimated remaining bench time [s]."""

    fraction: float
    remaining: float
    activity: str


@event(notice="point")
class PointFinished(Event):
    """A point of the campaign is finished; its result, an instance of the protocol's `point`, is a row of `points`."""

    point: Parameters


@event(table="warnings", notice="warning", grave=True)
class Warned(Event):
    """Warning to the operator that does not end the run."""

    text: str
    realtime: bool = column("1", "whether the warning depends on the speed of the computer", default=False)

    @property
    def line(self) -> str:
        return self.text


@event(table="exceeded_limits", notice="LIMIT", grave=True)
class LimitExceeded(Event):
    """A limit of the guard was exceeded: `quantity` reached `value`, which is beyond `limit`; both are in `unit`."""

    quantity: str = column("", "limited quantity")
    value: float = column("of the row", "value of the quantity")
    limit: float = column("of the row", "largest value allowed")
    unit: str = column("", "SI unit of the row")
    timing: bool = column(
        "1", "whether the limit concerns the arrival times of blocks, which the samples do not contain", default=False
    )

    @property
    def line(self) -> str:
        return f"{self.quantity} reached {self.value:.6g} {self.unit}; limit {self.limit:.6g} {self.unit}"


@event(table="operator_requests", notice="asked")
class OperatorAsked(Event):
    """The plan waits for the operator. `request` describes the requested action; `work` is its kind, if known."""

    request: str
    work: OperatorTask | None = column("", "kind of the requested action; empty if unknown", default=None)

    @property
    def line(self) -> str:
        return self.request


@event(table="operator_answers", notice="done")
class OperatorAnswered(Event):
    """The request was confirmed by `by`: the operator, or the policy of an unattended run."""

    request: str
    by: str = column("", "person or policy that confirmed the request")

    @property
    def line(self) -> str:
        return f"{self.request} (answered by {self.by})"


@event(table="operator_notes", notice="note")
class OperatorNote(Event):
    """A note that the operator has written during the run."""

    text: str = column("", "text of the note")
    by: str = column("", "person who wrote it")

    @property
    def line(self) -> str:
        return f"{self.text} ({self.by})"


Subscriber = Callable[[Event], None]
