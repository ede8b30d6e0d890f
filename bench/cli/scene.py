"""What the operator sees, gathered from the stream of events. Knows nothing of how it is shown."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, nan
from time import monotonic
from typing import Any

from bench.cli.twin_line import twin_line
from bench.cli.words import ABSENT, difference, gain, measured, number, one_line, setting
from bench.events import (
    Estimate,
    Event,
    LiveValue,
    PointFinished,
    Progress,
    RunningGain,
    State,
    StateChanged,
    StepStarted,
    TwinEstimate,
)

NOTICES = 5
"""How many of the last events are shown."""


@dataclass(frozen=True)
class Notice:
    """One line of the log: `kind` is a word, `grave` says that the operator should look."""

    time: float
    kind: str
    text: str
    grave: bool = False


@dataclass(frozen=True)
class Row:
    """A point of the campaign, finished or in progress, in words; a record's name stands in place of a frequency."""

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
        """From the values of a protocol's point; what the point does not have is absent."""
        value, predicted = point.get("alpha_2"), point.get("alpha_2_predicted")
        agrees, starts = point.get("agrees"), point.get("starts_tried")
        unstable = point.get("predicted_stable") is False
        passes = f"{point.get('passes', 0)} passes"
        effort = f"{point['cycles_measured']} cycles" if "cycles_measured" in point else passes
        return Row(
            omega=one_line(str(point["record"])) if "record" in point else setting(point.get("omega_rad_s")),
            beta=setting(point.get("beta")),
            status=str(point.get("status", ABSENT)),
            alpha_2=gain(value, point.get("alpha_2_uncertainty")),
            predicted=number(predicted) + (" unstable" if unstable else ""),
            difference=difference(value, predicted),
            agrees=ABSENT if agrees is None else "yes" if agrees else "NO",
            effort=f"{effort}, {starts} starts" if starts and starts > 1 else effort,
            under_record="record" in point,
        )

    @staticmethod
    def running(estimate: Estimate) -> "Row":
        """From the running estimate of the point that is being tested."""
        return Row(
            omega=setting(estimate.omega),
            beta="bare" if estimate.beta is None else setting(estimate.beta),
            status="measuring",
            alpha_2=gain(estimate.alpha_2, estimate.uncertainty),
            predicted=number(estimate.predicted),
            difference=difference(estimate.alpha_2, estimate.predicted),
            agrees=ABSENT,
            effort=f"{estimate.cycles} cycles",
        )

    @staticmethod
    def during_record(running: RunningGain) -> "Row":
        """From the running gain under the record that is being played."""
        return Row(
            omega=one_line(running.record),
            beta="bare" if running.beta is None else setting(running.beta),
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
        """The frequency with its unit, or the record."""
        return self.omega if self.under_record else f"omega {self.omega} rad/s"

    @property
    def sentence(self) -> str:
        """The row as one line of a log."""
        return (
            f"{self.where}, beta {self.beta}: {self.status}, alpha_2 {self.alpha_2}, "
            f"predicted {self.predicted}, difference {self.difference}, agrees: {self.agrees}, {self.effort}"
        )


def live_line(live: LiveValue) -> str:
    """A number that a protocol follows, with what was predicted for it."""
    text = f"{one_line(live.label)}  {measured(live.value, live.uncertainty, live.unit)}"
    if not isfinite(live.predicted):
        return text
    predicted = measured(live.predicted, nan, live.unit)
    return f"{text}, predicted {predicted}, difference {difference(live.value, live.predicted)}"


def notice_of(event: Event) -> Notice | None:
    """The event as a line of the log, or None when it is not worth one."""
    match event:
        case PointFinished():
            if "alpha_2" not in type(event.point).model_fields:
                return None
            point = event.point.model_dump()
            reason = one_line(str(point.get("reason") or ""))
            text = Row.finished(point).sentence + (f" ({reason})" if reason else "")
            return Notice(event.time, event.notice, text, grave=point.get("status") == "overturned")
        case StateChanged(after=State.ABORTING | State.HALTED):
            return Notice(event.time, str(event.after), one_line(event.reason), grave=True)
        case _:
            return Notice(event.time, event.notice, one_line(event.line), grave=event.grave) if event.notice else None


@dataclass
class Scene:
    """The present picture: `rows` of finished points, the last `notices` that are no points, and the rest as it is.

    `live` are the numbers that the protocol follows, in one line each, by their label.
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
    _begun: float = 0.0
    _prepares: bool = False

    def prepare(self, phase: str, done: int, total: int) -> None:
        """Take in what is done before the rig is opened or after it is closed."""
        now = monotonic()
        if phase != self.reason:
            self.reason, self._begun = one_line(phase), now
        self.fraction = done / total if total else 0.0
        self.remaining = (now - self._begun) * (total - done) / done if done else float("nan")
        self._prepares = True

    def update(self, event: Event) -> Notice | None:
        """Take in an event that is not a block of samples; returns its line of the log, if it has one."""
        if self._prepares:
            self.fraction, self.remaining, self._prepares = 0.0, float("nan"), False
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
                self.remaining, self.activity = event.remaining, one_line(event.activity)
            case Estimate():
                self.running = Row.running(event)
            case RunningGain():
                self.running = Row.during_record(event)
            case PointFinished() if "alpha_2" in type(event.point).model_fields:
                self.rows.append(Row.finished(event.point.model_dump()))
                self.running = None
            case _:
                pass
        notice = notice_of(event)
        if notice is not None and not isinstance(event, PointFinished):
            self.notices.append(notice)
        return notice
