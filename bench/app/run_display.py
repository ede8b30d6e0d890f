"""Displayed state of a run, updated from the stream of events; used by all clients."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, nan
from time import monotonic
from typing import Any

from bench.app.formatting import ABSENT, difference, measurement, number, one_line, plus_minus, setpoint
from bench.document.typography import counted
from bench.events import Event, PointFinished, Progress, State, StateChanged, StepStarted
from bench.live_values import Estimate, LiveValue, RunningGain, TwinEstimate

NOTICES = 5
"""Maximum number of displayed notices; the latest are kept."""

LONG = 80
"""Fewest characters of a remark that is not repeated in the lines of further points."""


@dataclass(frozen=True)
class Notice:
    """A line of the log, with bench `time` [s]; `grave` is True for a line that needs the operator's attention."""

    time: float
    kind: str
    text: str
    grave: bool = False


@dataclass(frozen=True)
class Row:
    """Texts of a point, finished or in progress; under an earthquake record, `omega` contains the record's name."""

    omega: str
    beta: str
    status: str
    alpha_2: str
    predicted: str
    difference: str
    agrees: str
    effort: str
    under_record: bool = False

    @staticmethod
    def finished(point: Mapping[str, Any]) -> "Row":
        """Row of a finished point; missing values are shown as `ABSENT`."""
        value, predicted = point.get("alpha_2"), point.get("alpha_2_predicted")
        agrees, starts = point.get("agrees"), point.get("starts_tried")
        unstable = point.get("predicted_stable") is False
        if "cycles_measured" in point:
            effort = counted(point["cycles_measured"], "cycle")
        else:
            effort = counted(point.get("passes", 0), "pass", "passes")
        return Row(
            omega=one_line(str(point["record"])) if "record" in point else setpoint(point.get("omega_rad_s")),
            beta=setpoint(point.get("beta")),
            status=str(point.get("status", ABSENT)),
            alpha_2=plus_minus(value, point.get("alpha_2_uncertainty")),
            predicted=number(predicted) + (" unstable" if unstable else ""),
            # without a verdict, the motion may be on a solution branch other than the predicted one
            difference=ABSENT if agrees is None else difference(value, predicted),
            agrees=ABSENT if agrees is None else "yes" if agrees else "NO",
            effort=f"{effort}, {starts} starts" if starts and starts > 1 else effort,
            under_record="record" in point,
        )

    @staticmethod
    def running(estimate: Estimate) -> "Row":
        """Row of the current point, from its running estimate."""
        return Row(
            omega=setpoint(estimate.omega),
            beta="bare" if estimate.beta is None else setpoint(estimate.beta),
            status="measuring",
            alpha_2=plus_minus(estimate.alpha_2, estimate.uncertainty),
            predicted=number(estimate.predicted),
            difference=difference(estimate.alpha_2, estimate.predicted),
            agrees=ABSENT,
            effort=counted(estimate.cycles, "cycle"),
        )

    @staticmethod
    def during_record(running: RunningGain) -> "Row":
        """Row of the point under the current record, from its running gain."""
        return Row(
            omega=one_line(running.record),
            beta="bare" if running.beta is None else setpoint(running.beta),
            status="measuring",
            alpha_2=number(running.alpha_2),
            predicted=number(running.predicted),
            difference=difference(running.alpha_2, running.predicted),
            agrees=ABSENT,
            effort=f"{running.seconds:.1f} s",
            under_record=True,
        )

    @property
    def where(self) -> str:
        """The circular frequency with its unit, or the name of the earthquake record."""
        return self.omega if self.under_record else f"omega {self.omega} rad/s"

    @property
    def sentence(self) -> str:
        """The row as a log line."""
        return (
            f"{self.where}, beta {self.beta}: {self.status}, alpha_2 {self.alpha_2}, "
            f"predicted {self.predicted}, difference {self.difference}, agrees: {self.agrees}, {self.effort}"
        )


def live_line(live: LiveValue) -> str:
    """A live value of a protocol with its prediction, as text."""
    text = f"{one_line(live.label)}  {measurement(live.value, live.uncertainty, live.unit)}"
    if not isfinite(live.predicted):
        return text
    predicted = measurement(live.predicted, nan, live.unit)
    return f"{text}, predicted {predicted}, difference {difference(live.value, live.predicted)}"


def notice_of(event: Event, told: set[str] | None = None) -> Notice | None:
    """The event as a line of the log; None for an event that is not logged.

    Long remarks on a point that have been `told` are counted instead of repeated; those of this point are added.
    """
    match event:
        case PointFinished():
            if "alpha_2" not in type(event.point).model_fields:
                return None
            point = event.point.model_dump()
            remarks = _shortened(one_line(str(point.get("reason") or "")), set() if told is None else told)
            text = Row.finished(point).sentence + (f" ({remarks})" if remarks else "")
            return Notice(event.time, event.notice, text, grave=point.get("status") == "overturned")
        case StateChanged(after=State.ABORTING | State.HALTED):
            return Notice(event.time, str(event.after), one_line(event.reason), grave=True)
        case _:
            return Notice(event.time, event.notice, one_line(event.line), grave=event.grave) if event.notice else None


def _shortened(reason: str, told: set[str]) -> str:
    remarks = reason.split("; ")
    new = [each for each in remarks if each not in told]
    told.update(each for each in new if len(each) >= LONG)
    repeated = len(remarks) - len(new)
    return "; ".join([*new, *([f"{counted(repeated, 'remark')} as before"] if repeated else [])])


def twin_line(event: TwinEstimate) -> str:
    """Peak drifts, residual, gains with the model's band if known, and fraction of standing blocks if below 1."""
    words = [f"drift peak {_millimetres(event.drift_peak_measured)}, model {_millimetres(event.drift_peak)}"]
    words.append(f"residual {_share(event.residual)}, excess over the band {_share(event.excess)}")
    if isfinite(event.alpha_2):
        band = f"{number(event.alpha_2_low)} to {number(event.alpha_2_high)}"
        words.append(f"alpha_2 {number(event.alpha_2_measured)}, model {number(event.alpha_2)} ({band})")
    if event.standing < 1.0:
        words.append(f"blocks standing {event.standing:.0%}")
    return "; ".join(words)


def _millimetres(metres: float) -> str:
    return f"{1e3 * metres:.2f} mm" if isfinite(metres) else ABSENT


def _share(value: float) -> str:
    return f"{100.0 * value:.1f} %" if isfinite(value) else ABSENT


@dataclass
class RunDisplay:
    """The displayed state of a run.

    rows, running : rows of the finished points, and row of the point in progress.
    twin : latest line on the live twin.
    live : live values of the protocol, one line each, by label.
    notices : latest log lines about other events.
    """

    time: float = 0.0
    state: State = State.IDLE
    reason: str = ""
    step: str = ""
    activity: str = ""
    fraction: float = 0.0
    remaining: float = float("nan")
    rows: list[Row] = field(default_factory=list[Row])
    running: Row | None = None
    twin: str = ""
    live: dict[str, str] = field(default_factory=dict[str, str])
    notices: deque[Notice] = field(default_factory=lambda: deque[Notice](maxlen=NOTICES))
    preparing: bool = False
    """Whether the session is computing before the rig is opened or after it is closed."""
    _begun: float = 0.0
    _estimated_at: float = 0.0
    _told: set[str] = field(default_factory=set[str])

    def prepare(self, phase: str, done: int, total: int) -> None:
        """Show a stage before the rig is opened or after it is closed; `done` of its `total` parts are complete."""
        now = monotonic()
        if phase != self.reason:
            self.reason, self._begun = one_line(phase), now
        self.fraction = done / total if total else 0.0
        self.remaining = (now - self._begun) * (total - done) / done if done else float("nan")
        self._estimated_at, self.preparing = self.time, True

    def expect(self, duration: float | None) -> None:
        """Show the planned `duration` [s], None if unknown; called once the rig is open. The first progress event that
        has a remaining time replaces it.
        """
        self.fraction, self.remaining, self.preparing = 0.0, nan if duration is None else duration, False
        self.reason, self._estimated_at = "", self.time

    @property
    def time_left(self) -> float:
        """Remaining time [s], less the bench time elapsed since it was estimated; NaN if unknown."""
        return max(self.remaining - max(self.time - self._estimated_at, 0.0), 0.0) if isfinite(self.remaining) else nan

    def update(self, event: Event) -> Notice | None:
        """Update the state with an event other than a block of samples; returns the event's log line, if any."""
        if self.preparing:
            self.fraction, self.remaining, self.preparing = 0.0, float("nan"), False
        self.time = max(self.time, event.time)
        match event:
            case StateChanged():
                self.state, self.reason = event.after, one_line(event.reason)
                if event.after in (State.IDLE, State.HALTED, State.CLOSED):
                    self.twin = ""
                    self.live.clear()
            case TwinEstimate():
                self.twin = twin_line(event)
            case LiveValue():
                self.live[one_line(event.label)] = live_line(event)
            case StepStarted():
                self.step, self.running = one_line(event.text), None
            case Progress():
                self.fraction = min(max(event.fraction, 0.0), 1.0)
                self.activity = one_line(event.activity)
                if isfinite(event.remaining):
                    self.remaining, self._estimated_at = event.remaining, self.time
            case Estimate():
                self.running = Row.running(event)
            case RunningGain():
                self.running = Row.during_record(event)
            case PointFinished() if "alpha_2" in type(event.point).model_fields:
                self.rows.append(Row.finished(event.point.model_dump()))
                self.running = None
            case _:
                pass
        notice = notice_of(event, self._told)
        if notice is not None and not isinstance(event, PointFinished):
            self.notices.append(notice)
        return notice
