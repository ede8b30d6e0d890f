"""The one stream of typed events that leaves the engine.

Recorder, live analysis, console and window are subscribers: functions that take an event. The engine calls them in
its own thread, in the order of their subscription, so a subscriber that has work to do queues it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from drivers.rig import Alignment, Block
from sim.parameters import Parameters


class State(StrEnum):
    """What the bench is doing."""

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
    """Something that happened at `time`: seconds of the bench's clock since the session began."""

    time: float


@dataclass(frozen=True)
class StateChanged(Event):
    """The bench went from one state to another, and why."""

    before: State
    after: State
    reason: str


@dataclass(frozen=True)
class Acquired(Event):
    """A block of samples as read, and the drive [V], shape (n,), that was played while it was taken.

    `run` counts the times the rig has been armed; the block's `first` sample index is counted within that run.
    """

    run: int
    block: Block
    drive: NDArray[np.float64]


@dataclass(frozen=True)
class SensorsAligned(Event):
    """How sensors with clocks of their own were placed on the sample clock in `run`; told when the run is over."""

    run: int
    alignments: tuple[Alignment, ...]


@dataclass(frozen=True)
class StepStarted(Event):
    """A step of the plan began; `text` says which, as the lab sheet would."""

    text: str


@dataclass(frozen=True)
class Progress(Event):
    """Share of the campaign that is done, 0 to 1, what is being done, and the estimated bench time left [s]."""

    fraction: float
    remaining: float
    activity: str


@dataclass(frozen=True)
class Estimate(Event):
    """The running gain coefficient of the point being tested; NaN while it is not known.

    `uncertainty` is expanded (k = 2). `predicted` is for the layer that the point is started towards.
    """

    omega: float
    beta: float | None
    cycles: int
    drift_peak: float
    alpha_2: float
    uncertainty: float
    predicted: float


@dataclass(frozen=True)
class RunningGain(Event):
    """The gain under a record so far, `seconds` into it: the ratio of the peaks until now, measured and predicted.

    Peaks are largest magnitudes of the drift [m] since the record began; of the bare frame until the same second.
    NaN while it is not known; `beta` is None for the bare frame.
    """

    record: str
    beta: float | None
    seconds: float
    drift_peak: float
    alpha_2: float
    predicted: float


@dataclass(frozen=True)
class PassFinished(Event):
    """A drive was played to make the table follow `motion`: how well it did, pass `number` of a replication.

    `error`, `repeatable`, `peak_error` and `spectrum_error` are relative [1], see `bench.control.passes.Pass`; `text`
    says all of it.
    """

    motion: str
    number: int
    error: float
    repeatable: float
    peak_error: float
    spectrum_error: float
    accepted: bool
    text: str


@dataclass(frozen=True, eq=False)
class TableIdentified(Event):
    """The response of the table to its drive is known: values at the lines, each of shape (n_lines,), in the units of
    `bench.control.table_model.TableModel`; `text` says when, with what on the table, and at what level.
    """

    text: str
    frequency: NDArray[np.float64]
    real: NDArray[np.float64]
    imaginary: NDArray[np.float64]
    uncertainty: NDArray[np.float64]
    distortion: NDArray[np.float64]
    coherence: NDArray[np.float64]
    noise: NDArray[np.float64]


@dataclass(frozen=True)
class PointFinished(Event):
    """A point of the campaign has its result: an instance of the protocol's `point_type`."""

    point: Parameters


@dataclass(frozen=True)
class Warned(Event):
    """Something that the operator should know and that does not end the run."""

    text: str


@dataclass(frozen=True)
class LimitExceeded(Event):
    """The guard ended the run: `quantity` reached `value` where `limit` is allowed, both in `unit`."""

    quantity: str
    value: float
    limit: float
    unit: str


@dataclass(frozen=True)
class OperatorAsked(Event):
    """The plan waits for a person: what to do and why."""

    request: str


@dataclass(frozen=True)
class OperatorAnswered(Event):
    """The person (or the policy of an unattended run, `by`) says that it is done."""

    request: str
    by: str


Subscriber = Callable[[Event], None]
