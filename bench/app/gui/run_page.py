"""The Run page: live traces, running gain with its prediction, steadiness, picture, gain plot and log."""

from math import isfinite
from typing import Any

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QSizePolicy,
    QSplitter,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from bench.analysis.uncertainty import COVERAGE
from bench.app.catalogue import load_protocol
from bench.app.formatting import ABSENT, clock, difference, measurement, number, plus_minus
from bench.app.gui import texts
from bench.app.gui.buffers import BlockAngle
from bench.app.gui.controller import PERIOD, Controller
from bench.app.gui.gain_plot import GainPlot
from bench.app.gui.live_plot import LivePlot
from bench.app.gui.palette import Theme
from bench.app.gui.picture import PhysicalPicture
from bench.app.gui.status import Arrangement
from bench.app.gui.steadiness import SteadyView
from bench.app.gui.traces import TracePlot
from bench.app.gui.widgets import (
    FITTING,
    give_key,
    in_screen_unit,
    label,
    scrolling,
    set_level,
    typeset,
    unit_text,
)
from bench.app.ipc.messages import Opened, Run, Traces
from bench.app.run_display import Notice
from bench.datafile.tables import Table
from bench.events import (
    Estimate,
    Event,
    FitFinished,
    LiveValue,
    PointFinished,
    RunningGain,
    SpecimenMounted,
    StepStarted,
    TableIdentified,
    TwinEstimate,
)
from bench.protocol import Protocol

LOG_LINES = 2000
GAINS_HEIGHT, LOWEST = 150, 540
"""Minimum heights of the gain plot, for a readable axis, and of the page, for a complete picture [px]."""
OLD = 0.5
"""Age of the newest sample above which that age is shown during a run [s]."""


class RunPage(QWidget):
    """Live view of a run; draws only while visible."""

    def __init__(self, controller: Controller, theme: Theme) -> None:
        super().__init__()
        self._controller = controller
        self.traces, self.gains, self.steady = TracePlot(theme), GainPlot(theme), SteadyView()
        self.live, self.shown_plot = LivePlot(theme), QStackedWidget()
        for plot in (self.gains, self.live):
            self.shown_plot.addWidget(plot)
        self._protocol: Protocol[Any] | None = None
        self.picture, self.block = PhysicalPicture(theme), BlockAngle()
        self.arrangement = Arrangement()
        self.point, self.alpha = QLabel(), QLabel(texts.NO_GAIN)
        # a long name is truncated, so that it does not widen the page
        self.point.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.alpha.setProperty("role", "value")
        self.alpha.setAccessibleName(texts.NAMES["alpha"])
        self.predicted, self.lost = QLabel(wordWrap=True), QLabel(wordWrap=True)
        self.twin = QLabel()
        # always one line, so that the content below does not move
        self.twin.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.log = QPlainTextEdit(readOnly=True, maximumBlockCount=LOG_LINES)
        self.log.setMinimumHeight(50)
        self.log.setAccessibleName(texts.NAMES["log"])
        self.ramp_out = QPushButton(texts.RAMP_OUT)
        self.ramp_out.setToolTip(texts.RAMP_OUT_TIP)
        give_key(self.ramp_out, "Ctrl+E")
        self.ramp_out.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.ramp_out.clicked.connect(controller.ramp_out)
        self._arrange()
        controller.opened.connect(self._open)
        controller.traced.connect(self._trace)
        controller.event_received.connect(self._tell)
        controller.noticed.connect(self._note)
        controller.changed.connect(self._refresh)
        controller.began.connect(self._begin)
        self._timer = QTimer(self, interval=PERIOD, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._draw)
        self._timer.start()
        self._refresh()

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        for part in (self.traces, self.gains, self.live, self.picture):
            part.use_theme(theme)

    def predict(self, prediction: Table) -> None:
        """Show the predicted lines of the next run."""
        self.gains.predict(prediction)

    def _arrange(self) -> None:
        right = QSplitter(Qt.Orientation.Vertical)
        numbers = QWidget()
        column = QVBoxLayout(numbers)
        column.setContentsMargins(0, 0, 0, 0)
        row = QHBoxLayout()
        row.addWidget(self.alpha, 1)
        row.addWidget(self.ramp_out)
        column.addWidget(self.point)
        column.addLayout(row)
        for part in (self.predicted, self.twin, self.steady, self.lost):
            column.addWidget(part)
        self.shown_plot.setMinimumHeight(GAINS_HEIGHT)
        for part in (self.shown_plot, self.picture, self.log):
            right.addWidget(part)
        right.setSizes([280, 260, 90])
        column.addWidget(right, 1)
        whole = QSplitter()
        whole.addWidget(self.traces)
        whole.addWidget(numbers)
        whole.setSizes([600, 660])
        QVBoxLayout(self).addWidget(scrolling(whole, FITTING[0], LOWEST))

    def _begin(self, run: Run) -> None:
        self.traces.clear()
        self.log.clear()
        self._protocol = load_protocol(run.protocol)
        has_gain = "alpha_2" in self._protocol.point.model_fields
        self.live.forget()
        self.shown_plot.setCurrentWidget(self.gains if has_gain else self.live)
        # without a gain there is nothing to draw before the first result
        self.shown_plot.setVisible(has_gain)
        self._show_point("")
        self.alpha.setText(texts.NO_GAIN if has_gain else texts.NO_RESULT)
        self.predicted.setText("")
        self.arrangement = Arrangement()
        self.picture.use(run.configuration.known_specimen)
        self.traces.watch_block(None)
        self.steady.begin(run)
        self.block = BlockAngle()

    def _open(self, opened: Opened) -> None:
        self.traces.use_further(opened.further)
        if self._controller.attached is not None:
            self.gains.predict(opened.prediction)

    def _trace(self, traces: list[Traces]) -> None:
        self.traces.add(traces)
        self.steady.add(traces)
        for block in traces:
            self.block.place(block)
        # immediately, not at the next tick
        self._draw()

    def _draw(self) -> None:
        if self.isVisible():
            self.traces.draw()
            moment = self.block.nearest(self.traces.moment)
            self.picture.move_to(self.traces.ring.at(moment), self.block.at(moment))
            self.picture.show_age(self.traces.stale)

    def _tell(self, event: Event) -> None:
        match event:
            case Estimate():
                self._show_point(texts.MEASURING.format(point=_sine(event.omega, event.beta)))
                self._show(event.alpha_2, event.uncertainty, event.predicted, texts.CYCLES.format(cycles=event.cycles))
                self.gains.show_running(event)
                self.steady.point(event.omega, event.beta)
                self._couple(event.beta)
            case RunningGain():
                self._show_point(texts.MEASURING.format(point=_under(event.record, event.beta)))
                self._show(
                    event.alpha_2,
                    None,
                    event.predicted,
                    texts.SO_FAR.format(seconds=event.seconds, record=event.record),
                )
                self.gains.show_running(event)
                self._couple(event.beta)
            case LiveValue():
                value = measurement(event.value, event.uncertainty, unit_text(event.unit))
                self.alpha.setText(f"{typeset(event.label)}  {value}")
                off = difference(event.value, event.predicted)
                predicted = f"{texts.PREDICTED} {number(event.predicted)}, difference {off}"
                self.predicted.setText(predicted if isfinite(event.predicted) else "")
            case PointFinished():
                self._finish(event)
            case FitFinished() | TableIdentified() if self.shown_plot.currentWidget() is self.live:
                self.shown_plot.show()
                self.live.show_result(event)
                self._show_result(event)
            case StepStarted():
                self.steady.over()
            case TwinEstimate():
                self.block.add(event)
            case SpecimenMounted():
                self.arrangement.follow(event)
                self.picture.show_arrangement(self.arrangement)
                self.traces.watch_block(self.arrangement.face)
            case _:
                pass

    def _finish(self, event: PointFinished) -> None:
        """Show the result of a point, with the uncertainty that the log and the file state."""
        point = event.point.model_dump()
        if "alpha_2" not in point:
            if self._protocol is not None and self._protocol.log_line is not None:
                self.predicted.setText(typeset(self._protocol.log_line(event.point)))
            return
        self.shown_plot.setCurrentWidget(self.gains)
        self.shown_plot.show()
        self.gains.add(point)
        status, value = str(point.get("status", "")), point["alpha_2"]
        predicted, omega, beta = point.get("alpha_2_predicted"), point.get("omega_rad_s"), point.get("beta")
        where = _under(point["record"], beta) if "record" in point else "" if omega is None else _sine(omega, beta)
        self._show_point(texts.LAST_POINT.format(status=status, point=where))
        if value is None:
            self.alpha.setText(texts.NO_GAIN_OF.format(status=status))
            self.predicted.setText(typeset(str(point.get("reason") or "")))
        else:
            self.alpha.setText(f"{texts.ALPHA}  {plus_minus(value, point.get('alpha_2_uncertainty'))}")
            off = difference(value, predicted)
            self.predicted.setText(f"{texts.PREDICTED} {number(predicted)}, difference {off}")

    def _show_result(self, event: FitFinished | TableIdentified) -> None:
        self.predicted.setText(typeset(event.text))
        if isinstance(event, FitFinished) and event.parameters:
            name, found = next(iter(event.parameters.items()))
            factor, unit = in_screen_unit(found.unit)
            value = measurement(factor * found.value, COVERAGE * factor * found.uncertainty, unit)
            self._show_point(typeset(event.name))
            self.alpha.setText(f"{label(name)}  {value}")

    def _show_point(self, text: str) -> None:
        self.point.setText(text)
        self.point.setToolTip(text)

    def _couple(self, beta: float | None) -> None:
        coupled = beta is not None
        if coupled != self.arrangement.spring:
            self.arrangement.block = self.arrangement.spring = coupled
            self.picture.show_arrangement(self.arrangement)

    def _show(self, value: float, uncertainty: float | None, predicted: float, effort: str) -> None:
        known = isfinite(value)
        self.alpha.setText(f"{texts.ALPHA}  {plus_minus(value, uncertainty)}" if known else texts.NO_GAIN)
        beside = f"{texts.PREDICTED} {number(predicted)}, difference {difference(value, predicted)}, {effort}"
        self.predicted.setText(beside if known else effort)

    def _note(self, notice: Notice) -> None:
        mark = "▲ " if notice.grave else ""
        self.log.appendPlainText(f"{clock(notice.time):>8}  {mark}{notice.kind}: {typeset(notice.text)}")

    def _refresh(self) -> None:
        events, traces = self._controller.lost
        said = [texts.LOST.format(events=events, traces=traces)] if events or traces else []
        if self._controller.armed and self.traces.age > OLD:
            said.append(texts.DATA_AGE.format(age=self.traces.age))
        elif self.traces.stale is not None:
            said.append(texts.TRACES_OLD.format(age=clock(self.traces.age)))
        self.lost.setText(" ".join(said))
        self.lost.setVisible(bool(said))
        set_level(self.lost, "wait")
        self._show_twin()
        self.ramp_out.setEnabled(self._controller.running and self._controller.controls)

    def _show_twin(self) -> None:
        # an estimate may arrive after the end of the run
        twin = self._controller.scene.twin if self._controller.running else ""
        self.twin.setText(f"{texts.TWIN}: {typeset(twin) or ABSENT}")


def _sine(omega: float, beta: float | None) -> str:
    """Name of a point under a sine."""
    return (texts.BARE_SINE if beta is None else texts.SINE_POINT).format(omega=omega, beta=beta)


def _under(record: str, beta: float | None) -> str:
    """Name of a point under a record."""
    return (texts.BARE_RECORD if beta is None else texts.RECORD_POINT).format(record=record, beta=beta)
