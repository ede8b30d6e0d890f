"""The events of a run: every one declared once, with its columns in the data file, its line in the journal and its word
in the log.

Recorder, live analysis, console and window are subscribers: functions that take an event. The engine calls them in
its own thread, in the order of their subscription, so a subscriber that has work to do queues it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from math import nan
from typing import ClassVar, TypeVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from drivers.rig import Alignment, Block, Handwork
from sim.identified import Identified
from sim.parameters import Parameters, column
from sim.specimen import Specimen

Array = NDArray[np.float64]


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

    table: ClassVar[str] = ""
    """Where the data file keeps its columns, below /entry; empty when only the journal has it."""
    journalled: ClassVar[bool] = True
    """Whether the journal has a line of it; what comes many times a second would hide the rest."""
    notice: ClassVar[str] = ""
    """Its word in the log of terminal and window; empty for what is not logged."""
    grave: ClassVar[bool] = False
    """Whether the operator should look."""

    time: float = field(default=nan, kw_only=True, metadata={"unit": "s", "description": "bench time"})

    @property
    def line(self) -> str:
        """One line for the journal."""
        names = (each.name for each in fields(self) if each.name != "time")
        return ", ".join(f"{name} = {getattr(self, name)}" for name in names)


E = TypeVar("E", bound=Event)


@dataclass_transform(frozen_default=True, field_specifiers=(column, field))
def event(
    *, table: str = "", journalled: bool = True, notice: str = "", grave: bool = False, eq: bool = True
) -> Callable[[type[E]], type[E]]:
    """Declare a frozen event; see the class variables of `Event`.

    The columns of its `table` are the fields declared by `column`. A field of shape (n,), or a tuple of dataclasses
    with columns of their own, makes as many rows of one event; these have no column of the time.
    """

    def declare(kind: type[E]) -> type[E]:
        kind.table, kind.journalled, kind.notice, kind.grave = table, journalled, notice, grave
        return dataclass(frozen=True, eq=eq)(kind)

    return declare


@event()
class StateChanged(Event):
    """The bench went from one state to another, and why."""

    before: State
    after: State
    reason: str

    @property
    def line(self) -> str:
        return f"{self.before} -> {self.after}: {self.reason}"


@event(journalled=False)
class Acquired(Event):
    """A block of samples as read, and the drive [V], shape (n,), that was played while it was taken.

    `run` counts the times the rig has been armed; the block's `first` sample index is counted within that run.
    `signals`, shape (n, n_signals), are in SI units from the zero of the run, as `bench.analysis.signals` numbers them.
    """

    run: int
    block: Block
    drive: Array
    signals: Array = field(default_factory=lambda: np.empty((0, 0)))


@event()
class SpecimenMounted(Event):
    """A person has done `work`, by `amount` where it has one: `specimen` is what stands on the table now."""

    specimen: Specimen
    work: Handwork
    amount: float | None = None

    @property
    def line(self) -> str:
        amount = "" if self.amount is None else f" {self.amount:g}"
        label = self.specimen.label
        return f"{self.work}{amount}: {'bare frame' if label is None else f'beta = {label:g}'}"


@event(table="instrument/alignments")
class SensorsAligned(Event):
    """How sensors with clocks of their own were placed on the sample clock in `run`; published when the run is over."""

    run: int = column("1", "how many times the rig had been armed")
    alignments: tuple[Alignment, ...] = column("", "one row for each sensor")

    @property
    def line(self) -> str:
        return "; ".join(map(str, self.alignments))


@event(notice="step")
class StepStarted(Event):
    """A step of the plan began; `text` says which, as the lab sheet would."""

    text: str

    @property
    def line(self) -> str:
        return self.text


@event(journalled=False)
class Progress(Event):
    """Share of the campaign that is done, 0 to 1, what is being done, and the estimated bench time left [s]."""

    fraction: float
    remaining: float
    activity: str


@event(table="live_values", journalled=False)
class LiveValue(Event):
    """A number that a protocol follows while it measures, by its `label`; NaN while it is not known."""

    label: str = column("", "what the number is")
    value: float = column("of the row", "its value so far, in the unit of the row")
    unit: str = column("", 'SI unit of the row; "1" for a pure number', default="1")
    uncertainty: float = column("of the row", "its expanded uncertainty (k = 2); NaN if unknown", default=nan)
    predicted: float = column("of the row", "predicted value; NaN if there is none", default=nan)


@event(table="estimates", journalled=False)
class Estimate(Event):
    """The running gain coefficient of the point being tested; NaN while it is not known.

    `predicted` is for the layer that the point is started towards.
    """

    omega: float = column("rad/s", "circular frequency of the base motion")
    beta: float | None = column("1", "stiffness ratio of the coupling spring; absent for the bare frame")
    cycles: int = column("1", "cycles over which the estimate was made")
    drift_peak: float = column("m", "peak drift")
    alpha_2: float = column("1", "running gain of the peak drift, coupled over bare")
    uncertainty: float = column("1", "expanded uncertainty of alpha_2 (k = 2)")
    predicted: float = column("1", "predicted alpha_2")


@event(table="running_gains", journalled=False)
class RunningGain(Event):
    """The gain under a record so far, `seconds` into it: the ratio of the peaks until now, measured and predicted.

    Peaks are largest magnitudes of the drift since the record began; of the bare frame until the same second.
    NaN while it is not known; `beta` is None for the bare frame.
    """

    record: str = column("", "the record that was played")
    beta: float | None = column("1", "stiffness ratio of the coupling spring; absent for the bare frame")
    seconds: float = column("s", "time into the record")
    drift_peak: float = column("m", "peak drift since the record began")
    alpha_2: float = column("1", "ratio of the peak drifts so far, coupled over bare")
    predicted: float = column("1", "predicted alpha_2 so far")


TWIN_TRACE = ("seconds", "u1", "u2", "theta", "drift_low", "drift_high")
"""Columns of the trace of a `TwinEstimate`, in SI units."""


@event(table="twin", journalled=False, eq=False)
class TwinEstimate(Event):
    """Where the model is that runs with the test, and where the specimen: at the sample that the lasers took
    `seconds` into `run`, the last that both are known for; `time` is when its block had been read.

    `_low` and `_high` are the ends of the model's band, `_measured` what the lasers saw. `alpha_2` is known once the
    protocol has stated one. `residual` is the root mean square of measured minus modelled drift over the last second,
    `excess` that of what of the measured drift lies outside the band, both over the largest of the drift itself so far.
    `members` make the band, with the nominal model. NaN where there is no such value.

    `trace`, shape (n, 6), is the model since the estimate before, every 10 ms: columns TWIN_TRACE.
    """

    time: float = column("s", "bench time at which the block had been read", default=nan, kw_only=True)
    run: int = column("1", "how many times the rig had been armed")
    seconds: float = column("s", "time of the run that the values are for")
    members: int = column("1", "models that made the band, besides the nominal one")
    standing: float = column("1", "share of them whose block stood")
    u1: float = column("m", "u1, of the model")
    u1_low: float = column("m", "u1, where the model's band began")
    u1_high: float = column("m", "u1, where it ended")
    u1_measured: float = column("m", "u1, as measured")
    u2: float = column("m", "u2, of the model")
    u2_low: float = column("m", "u2, where the model's band began")
    u2_high: float = column("m", "u2, where it ended")
    u2_measured: float = column("m", "u2, as measured")
    drift: float = column("m", "the drift, of the model")
    drift_low: float = column("m", "the drift, where the model's band began")
    drift_high: float = column("m", "the drift, where it ended")
    drift_measured: float = column("m", "the drift, as measured")
    drift_peak: float = column("m", "the largest drift since the rig was armed, of the model")
    drift_peak_low: float = column("m", "the largest drift since the rig was armed, where the model's band began")
    drift_peak_high: float = column("m", "the largest drift since the rig was armed, where it ended")
    drift_peak_measured: float = column("m", "the largest drift since the rig was armed, as measured")
    alpha_2: float = column("1", "the gain of the peak drift, coupled over bare, of the model")
    alpha_2_low: float = column("1", "the gain of the peak drift, coupled over bare, where the model's band began")
    alpha_2_high: float = column("1", "the gain of the peak drift, coupled over bare, where it ended")
    alpha_2_measured: float = column("1", "the gain of the peak drift, coupled over bare, as measured")
    theta: float = column("rad", "angle of the model's block")
    residual: float = column("1", "rms of measured minus modelled drift over a second, over the drift's largest")
    excess: float = column("1", "the same of what of the measured drift lay outside the band")
    trace: Array


@event(table="passes", notice="pass")
class PassFinished(Event):
    """A drive was played to make the table follow `motion`: how well it did, pass `number` of a replication.

    `error`, `repeatable`, `peak_error` and `spectrum_error` are relative, see `bench.control.passes.Pass`; `text`
    says all of it.
    """

    time: float = column("s", "bench time at which the pass was over", default=nan, kw_only=True)
    motion: str = column("", "the motion that the table was to follow")
    number: int = column("1", "number of the pass, from 1 for each replication")
    error: float = column("1", "root mean square error over that of the target, as measured")
    repeatable: float = column("1", "the same without the part that does not repeat")
    peak_error: float = column("1", "largest error over the peak of the target")
    spectrum_error: float = column("1", "largest relative deviation of the response spectrum")
    accepted: bool = column("1", "whether the error was the smallest so far; else the drive went back")
    text: str

    @property
    def line(self) -> str:
        return f"{self.motion}: {self.text}"


@event(table="table_response", notice="table", eq=False)
class TableIdentified(Event):
    """The response of the table to its drive is known: values at the lines, each of shape (n_lines,), in the units of
    `bench.control.table_model.TableModel`; `text` says when, with what on the table, and at what level.
    """

    text: str
    frequency: Array = column("Hz", "line of the identification")
    real: Array = column("m/s2/V", "table acceleration per drive, real part, exp(+i omega t)")
    imaginary: Array = column("m/s2/V", "imaginary part")
    uncertainty: Array = column("m/s2/V", "its standard uncertainty, noise and distortion together")
    distortion: Array = column("m/s2/V", "standard deviation of one realisation by nonlinear distortion alone")
    coherence: Array = column("1", "share of the acceleration's power that the drive explains")
    noise: Array = column("m/s2/Hz^0.5", "spectral density of the noise in the acceleration")

    @property
    def line(self) -> str:
        return self.text


@dataclass(frozen=True, eq=False)
class Series:
    """Values over the axis of a fit, shape (n,), their unit in SI symbols ("1" for a number), and what they are."""

    values: Array
    unit: str
    description: str


@dataclass(frozen=True)
class FittedParameter:
    """What a fit found for a parameter of its model; the standard uncertainty has the same unit, NaN if unknown."""

    value: float
    uncertainty: float
    unit: str


@event(notice="fit", eq=False)
class FitFinished(Event):
    """A model was fitted to a stretch of a recording; `name` is short and unique within a session, `text` one line.

    `columns` by name, all of one length: first the axis (such as the time), then what was measured, and to be compared
    with it what was fitted, what is left, and so on. Names are fit for a file. Raises ValueError when they are not.
    `bench.record.fits` keeps them.
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

    @property
    def line(self) -> str:
        return f"{self.name}: {self.text}"


@event()
class SpecimenIdentified(Event):
    """What is known of the specimen by now: what was known before, with the findings of this run.

    `bench.record.findings` keeps it.
    """

    identified: Identified

    @property
    def line(self) -> str:
        return "; ".join(
            f"{each.name} = {each.value:.7g} +- {each.standard_uncertainty:.2g} (k = 1)"
            for each in self.identified.findings
        )


@event(notice="point")
class PointFinished(Event):
    """A point of the campaign has its result: an instance of the protocol's `point_type`, a row of `points`."""

    point: Parameters


@event(notice="warning", grave=True)
class Warned(Event):
    """Something that the operator should know and that does not end the run."""

    text: str

    @property
    def line(self) -> str:
        return self.text


@event(notice="LIMIT", grave=True)
class LimitExceeded(Event):
    """The guard ended the run: `quantity` reached `value` where `limit` is allowed, both in `unit`."""

    quantity: str
    value: float
    limit: float
    unit: str

    @property
    def line(self) -> str:
        return f"{self.quantity} reached {self.value:.6g} {self.unit}; limit {self.limit:.6g} {self.unit}"


@event(notice="asked")
class OperatorAsked(Event):
    """The plan waits for a person: what to do and why, and of which kind the work is, where that is known."""

    request: str
    work: Handwork | None = None

    @property
    def line(self) -> str:
        return self.request


@event(notice="done")
class OperatorAnswered(Event):
    """The person (or the policy of an unattended run, `by`) says that it is done."""

    request: str
    by: str

    @property
    def line(self) -> str:
        return f"{self.request} (answered by {self.by})"


Subscriber = Callable[[Event], None]
