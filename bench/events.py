"""The one stream of typed events that leaves the engine.

Recorder, live analysis, console and window are subscribers: functions that take an event. The engine calls them in
its own thread, in the order of their subscription, so a subscriber that has work to do queues it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import nan

import numpy as np
from numpy.typing import NDArray

from drivers.rig import Alignment, Block, Handwork
from sim.identified import Identified
from sim.parameters import Parameters
from sim.specimen import Specimen


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
    """Something that happened at `time`: seconds of the bench's clock since the session began.

    The stream stamps the time of publication on an event that has none (NaN).
    """

    time: float = field(default=nan, kw_only=True)


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
class SpecimenMounted(Event):
    """A person has done `work`, by `amount` where it has one: `specimen` is what stands on the table now."""

    specimen: Specimen
    work: Handwork
    amount: float | None = None


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


TWIN_TRACE = ("seconds", "u1", "u2", "theta", "drift_low", "drift_high")
"""Columns of the trace of a `TwinEstimate`, in SI units."""


@dataclass(frozen=True, eq=False)
class TwinEstimate(Event):
    """Where the model is that runs beside the test, and where the specimen: at the sample that the lasers took
    `seconds` into `run`, the last that both are known for; `time` is when its block had been read.

    u1, u2, drift and `drift_peak`, the largest since the rig was armed, are in m; `_low` and `_high` are the ends of
    the model's band, `_measured` what the lasers saw. `theta` [rad]; `alpha_2` once the protocol has stated one.
    `residual` is the root mean square of measured minus modelled drift over the last second, `excess` that of what of
    the measured drift lies outside the band, both over the largest of the drift itself so far. `members` make the band,
    with the nominal model; `standing` is the share of both whose block stands. NaN where there is no such value.

    `trace`, shape (n, 6), is the model since the estimate before, every 10 ms: columns TWIN_TRACE.
    """

    run: int
    seconds: float
    members: int
    standing: float
    u1: float
    u1_low: float
    u1_high: float
    u1_measured: float
    u2: float
    u2_low: float
    u2_high: float
    u2_measured: float
    drift: float
    drift_low: float
    drift_high: float
    drift_measured: float
    drift_peak: float
    drift_peak_low: float
    drift_peak_high: float
    drift_peak_measured: float
    alpha_2: float
    alpha_2_low: float
    alpha_2_high: float
    alpha_2_measured: float
    theta: float
    residual: float
    excess: float
    trace: NDArray[np.float64]


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


@dataclass(frozen=True, eq=False)
class Series:
    """Values over the axis of a fit, shape (n,), their unit in SI symbols ("1" for a number), and what they are."""

    values: NDArray[np.float64]
    unit: str
    description: str


@dataclass(frozen=True)
class FittedParameter:
    """What a fit found for a parameter of its model; the standard uncertainty has the same unit, NaN if unknown."""

    value: float
    uncertainty: float
    unit: str


@dataclass(frozen=True, eq=False)
class FitFinished(Event):
    """A model was fitted to a stretch of a recording; `name` is short and its own within a session, `text` one line.

    `columns` by name, all of one length: first the axis (such as the time), then what was measured, and to be compared
    with it what was fitted, what is left, and so on. Names are fit for a file. Raises ValueError when they are not.
    """

    name: str
    text: str
    columns: Mapping[str, Series]
    parameters: Mapping[str, FittedParameter]

    def __post_init__(self) -> None:
        shapes = {series.values.shape for series in self.columns.values()}
        if len(shapes) != 1 or len(*shapes) != 1:
            raise ValueError(f"columns of the fit {self.name} have shapes {shapes}; they need to be one, (n,)")
        for name in (self.name, *self.columns):
            if not name.strip(".") or "/" in name:
                raise ValueError(f"{name!r} in the fit {self.name} is no name for a file")


@dataclass(frozen=True)
class SpecimenIdentified(Event):
    """What is known of the specimen by now: what was known before, with the findings of this run."""

    identified: Identified


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
    """The plan waits for a person: what to do and why, and of which kind the work is, where that is known."""

    request: str
    work: Handwork | None = None


@dataclass(frozen=True)
class OperatorAnswered(Event):
    """The person (or the policy of an unattended run, `by`) says that it is done."""

    request: str
    by: str


Subscriber = Callable[[Event], None]
