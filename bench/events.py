"""Events of a run, each declared once with its columns in the data file, its journal line and its label in the log.

The recorder, the live analysis, the console and the window are subscribers: functions that the engine calls with each
event, in its own thread and in the order of subscription. A subscriber must therefore queue long computations.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from math import nan
from typing import ClassVar, TypeVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from drivers.rig import Alignment, Block, OperatorTask, RawValues
from sim.identified import Identified
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
    """Event at `time` [s], counted by the bench's clock from the start of the session.

    If `time` is NaN, the stream sets it to the time of publication.
    """

    table: ClassVar[str] = ""
    """Path of its columns in the data file, below /entry; empty for an event that is stored only in the journal."""
    journalled: ClassVar[bool] = True
    """Whether the event is written to the journal; frequent events are not."""
    notice: ClassVar[str] = ""
    """Label in the logs of the terminal and the window; empty for events that are not logged."""
    grave: ClassVar[bool] = False
    """Whether the event needs the operator's attention."""

    time: float = field(default=nan, kw_only=True, metadata={"unit": "s", "description": "bench time"})

    @property
    def line(self) -> str:
        """Line for the journal."""
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
    A subscriber may call it only until the subscriber itself returns.
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
    """The operator has completed the action `work`, with its `amount` if it has one; `specimen` is now on the table."""

    specimen: Specimen
    work: OperatorTask = column("", "action of the operator")
    amount: float | None = column(
        "of the action", "amount involved in the action; absent if there is none", default=None
    )

    @property
    def line(self) -> str:
        amount = "" if self.amount is None else f" {self.amount:g}"
        label = self.specimen.label
        return f"{self.work}{amount}: {'bare frame' if label is None else f'beta = {label:g}'}"


@event(table="instrument/alignments")
class SensorsAligned(Event):
    """Alignment of sensors with free-running clocks to the sample clock in `run`; published at the end of the run."""

    run: int = column("1", "number of armings of the rig")
    alignments: tuple[Alignment, ...] = column("", "one row for each sensor")

    @property
    def line(self) -> str:
        return "; ".join(map(str, self.alignments))


@event(notice="step")
class StepStarted(Event):
    """A step of the plan, described by `text`, has begun."""

    text: str

    @property
    def line(self) -> str:
        return self.text


@event(journalled=False)
class Progress(Event):
    """Completed fraction of the campaign (0 to 1), present step, and estimated remaining bench time [s]."""

    fraction: float
    remaining: float
    activity: str


@event(table="live_values", journalled=False)
class LiveValue(Event):
    """Running value of a quantity that a protocol measures, with its `label`; NaN while unknown."""

    label: str = column("", "description of the quantity")
    value: float = column("of the row", "present value, in the unit of the row")
    unit: str = column("", 'SI unit of the row; "1" for a pure number', default="1")
    uncertainty: float = column("of the row", "its expanded uncertainty (k = 2); NaN if unknown", default=nan)
    predicted: float = column("of the row", "predicted value; NaN if there is none", default=nan)


@event(table="estimates", journalled=False)
class Estimate(Event):
    """Running gain coefficient of the point under test; NaN while unknown.

    `predicted` is the prediction for the branch of steady motion that the point's start-up aims at.
    """

    omega: float = column("rad/s", "circular frequency of the base motion")
    beta: float | None = column("1", "stiffness ratio of the coupling spring; absent for the bare frame")
    cycles: int = column("1", "number of cycles of the estimate")
    drift_peak: float = column("m", "peak drift")
    alpha_2: float = column("1", "running gain of the peak drift, coupled over bare")
    uncertainty: float = column("1", "expanded uncertainty of alpha_2 (k = 2)")
    predicted: float = column("1", "predicted alpha_2")


@event(table="hold_cycles", journalled=False)
class HoldCycle(Event):
    """One cycle of an unstable motion that a stabiliser holds; values are NaN if the cycle could not be measured."""

    omega: float = column("rad/s", "circular frequency of the base motion")
    beta: float | None = column("1", "stiffness ratio of the coupling spring")
    cycle: int = column("1", "number of the cycle since the beginning of the hold")
    drift_peak: float = column("m", "peak drift in the cycle")
    deviation: float = column("1", "estimated deviation from the periodic motion, relative to that motion")
    control: float = column("1", "magnitude of the control in the cycle, relative to the table's amplitude")


@event(table="running_gains", journalled=False)
class RunningGain(Event):
    """Gain under a record during its first `seconds`: ratio of the peak drifts so far, measured and predicted.

    Peaks are the largest magnitudes of the drift since the start of the record, for the coupled and the bare frame.
    Values are NaN while unknown; `beta` is None for the bare frame.
    """

    record: str = column("", "name of the record")
    beta: float | None = column("1", "stiffness ratio of the coupling spring; absent for the bare frame")
    seconds: float = column("s", "time into the record")
    drift_peak: float = column("m", "peak drift since the record began")
    alpha_2: float = column("1", "ratio of the peak drifts so far, coupled over bare")
    predicted: float = column("1", "predicted alpha_2 so far")


TWIN_TRACE = ("seconds", "u1", "u2", "theta", "drift_low", "drift_high")
"""Columns of the trace of a `TwinEstimate`, in SI units."""


@event(table="twin", journalled=False, eq=False)
class TwinEstimate(Event):
    """State of the live model and of the specimen at the last sample for which both are known, `seconds` into `run`.
    `time` is the instant at which the block with that sample had been read.

    `_low` and `_high` are the ends of the model's band, `_measured` the values of the lasers. `alpha_2` is available
    once the protocol has published a gain. `residual` is the root mean square of measured minus modelled drift over the
    last second, `excess` that of the measured drift outside the band, both relative to the largest drift so far. The
    band is formed by `members` models together with the nominal one. Values that do not exist are NaN.

    `trace`, shape (n, 6), is the model's motion since the previous estimate, every 10 ms, with the columns TWIN_TRACE.
    """

    time: float = column("s", "bench time at which the block had been read", default=nan, kw_only=True)
    run: int = column("1", "number of armings of the rig")
    seconds: float = column("s", "time in the run to which the values apply")
    members: int = column("1", "number of models that form the band, excluding the nominal one")
    standing: float = column("1", "fraction of the models of the band whose block is standing")
    u1: float = column("m", "u1 of the model")
    u1_low: float = column("m", "u1, lower end of the model's band")
    u1_high: float = column("m", "u1, upper end of the model's band")
    u1_measured: float = column("m", "u1, measured")
    u2: float = column("m", "u2 of the model")
    u2_low: float = column("m", "u2, lower end of the model's band")
    u2_high: float = column("m", "u2, upper end of the model's band")
    u2_measured: float = column("m", "u2, measured")
    drift: float = column("m", "drift of the model")
    drift_low: float = column("m", "drift, lower end of the model's band")
    drift_high: float = column("m", "drift, upper end of the model's band")
    drift_measured: float = column("m", "drift, measured")
    drift_peak: float = column("m", "peak drift of the model since arming")
    drift_peak_low: float = column("m", "peak drift since arming, lower end of the model's band")
    drift_peak_high: float = column("m", "peak drift since arming, upper end of the model's band")
    drift_peak_measured: float = column("m", "measured peak drift since arming")
    alpha_2: float = column("1", "gain of the model's peak drift, coupled over bare")
    alpha_2_low: float = column("1", "gain of the peak drift, coupled over bare, lower end of the model's band")
    alpha_2_high: float = column("1", "gain of the peak drift, coupled over bare, upper end of the model's band")
    alpha_2_measured: float = column("1", "measured gain of the peak drift, coupled over bare")
    theta: float = column("rad", "rocking angle of the model")
    residual: float = column("1", "rms of measured minus modelled drift over 1 s, relative to the largest drift")
    excess: float = column("1", "rms of the measured drift outside the band over 1 s, relative to the largest drift")
    trace: Array


@event(table="passes", notice="pass")
class PassFinished(Event):
    """Pass `number` of a replication, the iteration that makes the table follow `motion`, has ended.

    `error`, `repeatable`, `peak_error` and `spectrum_error` are relative, see `bench.control.passes.Pass`; `text`
    summarises the pass.
    """

    time: float = column("s", "bench time at the end of the pass", default=nan, kw_only=True)
    motion: str = column("", "motion commanded to the table")
    number: int = column("1", "number of the pass, from 1 for each replication")
    error: float = column("1", "measured rms error relative to the rms of the target")
    repeatable: float = column("1", "error excluding its non-repeatable part")
    peak_error: float = column("1", "largest error relative to the peak of the target")
    spectrum_error: float = column("1", "largest relative deviation of the response spectrum")
    accepted: bool = column("1", "whether the error is the smallest so far; otherwise the previous drive is restored")
    text: str

    @property
    def line(self) -> str:
        return f"{self.motion}: {self.text}"


@event(table="table_response", notice="table", eq=False)
class TableIdentified(Event):
    """The response of the table has been identified. The arrays, each of shape (n_lines,), hold the values at the
    frequency lines, in the units of `bench.control.table_model.TableModel`; `text` states the date, the mounted
    specimen and the level.
    """

    text: str
    frequency: Array = column("Hz", "frequency line of the identification")
    real: Array = column("m/s2/V", "table acceleration per drive, real part, exp(+i omega t)")
    imaginary: Array = column("m/s2/V", "table acceleration per drive, imaginary part")
    uncertainty: Array = column("m/s2/V", "standard uncertainty of the response, from noise and distortion")
    distortion: Array = column("m/s2/V", "standard deviation of one realisation due to nonlinear distortion alone")
    coherence: Array = column("1", "fraction of the acceleration's power that is coherent with the drive")
    noise: Array = column("m/s2/Hz^0.5", "spectral density of the noise in the acceleration")

    @property
    def line(self) -> str:
        return self.text


@dataclass(frozen=True, eq=False)
class Series:
    """Values along the axis of a fit, shape (n,), with their unit in SI symbols ("1" for a pure number) and a
    description.
    """

    values: Array
    unit: str
    description: str


@dataclass(frozen=True)
class FittedParameter:
    """Fitted value of a model parameter; the standard uncertainty has the same unit and is NaN if unknown."""

    value: float
    uncertainty: float
    unit: str


@event(notice="fit", eq=False)
class FitFinished(Event):
    """A model was fitted to a section of a recording; `name` is short and unique within a session, `text` is one line.

    `columns` holds series of equal length by name: first the axis (such as time), then the measured values and, for
    comparison, the fitted values, residuals and so on. Raises ValueError unless all names are valid in a data file.
    Stored by `bench.datafile.declared`.
    """

    name: str
    text: str
    columns: Mapping[str, Series]
    parameters: Mapping[str, FittedParameter]

    def __post_init__(self) -> None:
        shapes = {series.values.shape for series in self.columns.values()}
        if len(shapes) != 1 or len(*shapes) != 1:
            raise ValueError(
                f"columns of the fit {self.name} have shapes {shapes}; they must all have the same shape (n,)"
            )
        for name in (self.name, *self.columns):
            if not name.strip(".") or "/" in name:
                raise ValueError(f"{name!r} in the fit {self.name} is not a valid name in a data file")

    @property
    def line(self) -> str:
        return f"{self.name}: {self.text}"


@event()
class SpecimenIdentified(Event):
    """The specimen as identified so far: findings of this and earlier runs; stored by `bench.datafile.declared`."""

    identified: Identified

    @property
    def line(self) -> str:
        return "; ".join(
            f"{each.name} = {each.value:.7g} +- {each.standard_uncertainty:.2g} (k = 1)"
            for each in self.identified.findings
        )


@event(notice="point")
class PointFinished(Event):
    """A point of the campaign is finished; its result, an instance of `point_type`, is a row of `points`."""

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
    """The guard ended the run: `quantity` reached `value` beyond `limit`, both in `unit`."""

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
    """The plan waits for the operator. `request` is the requested action with its reason, `work` its kind, if known."""

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
