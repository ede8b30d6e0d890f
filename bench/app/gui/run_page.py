"""The Run page: meters of the limits, verdict, the protocol's plot, picture, traces, points and log."""

from typing import Any

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QPushButton,
    QSplitter,
    QStackedWidget,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from bench.analysis.uncertainty import COVERAGE
from bench.app.catalogue import load_protocol
from bench.app.formatting import ABSENT, clock, measurement
from bench.app.gui import texts
from bench.app.gui.buffers import BlockAngle
from bench.app.gui.campaign_matrix import MatrixView
from bench.app.gui.controller import PERIOD, Controller
from bench.app.gui.gain_plot import GainPlot
from bench.app.gui.live_plot import LivePlot
from bench.app.gui.log_panel import LogPanel
from bench.app.gui.meters import MetersView
from bench.app.gui.motion_plot import KINDS, MotionPlot
from bench.app.gui.palette import Theme
from bench.app.gui.picture import PhysicalPicture
from bench.app.gui.status import Arrangement
from bench.app.gui.steadiness import SteadyView
from bench.app.gui.traces import TracePlot
from bench.app.gui.verdict import VerdictLabel, running_verdict, verdict_of
from bench.app.gui.widgets import (
    FITTING,
    ElidingLabel,
    give_key,
    in_screen_unit,
    label,
    scrolling,
    set_level,
    typeset,
)
from bench.app.ipc.messages import Opened, Run, Traces
from bench.datafile.tables import Table
from bench.events import Event, PointFinished, SpecimenMounted, StepStarted
from bench.findings import FitFinished, TableIdentified
from bench.live_values import Estimate, LiveValue, RunningGain, TwinEstimate
from bench.protocol import Protocol

GAINS_HEIGHT, LOWEST = 150, 540
"""Minimum heights [px] of the protocol's plot, for a readable axis, and of the page, for a complete picture."""
OLD = 0.5
"""Age of the newest sample [s] above which this age is shown during a run."""
SHARES = (20, 50, 30)
"""Widths of meters, verdict with plot, and picture with traces, in per cent."""


class RunPage(QWidget):
    """Live view of a run; draws only while visible."""

    def __init__(self, controller: Controller, theme: Theme) -> None:
        super().__init__()
        self._controller = controller
        self.traces, self.gains, self.steady = TracePlot(theme), GainPlot(theme), SteadyView()
        self.motion = tuple(MotionPlot(theme, kind) for kind in KINDS)
        self.live, self.shown_plot = LivePlot(theme), QStackedWidget()
        for plot in (self.gains, self.live):
            self.shown_plot.addWidget(plot)
        self._protocol: Protocol[Any] | None = None
        self._has_live_value = False
        self.picture, self.block = PhysicalPicture(theme), BlockAngle()
        self.arrangement = Arrangement()
        self.meters, self.matrix = MetersView(theme), MatrixView(theme)
        self.panel = LogPanel(controller)
        self.log = self.panel.text
        self.point, self.verdict = ElidingLabel(), VerdictLabel()
        self.verdict.show_sentence(texts.NO_GAIN)
        # always one line, so that they neither widen the page nor move the content below
        self.lost, self.twin = ElidingLabel(), ElidingLabel()
        self.ramp_out = QPushButton(texts.RAMP_OUT)
        self.ramp_out.setToolTip(texts.RAMP_OUT_TIP)
        give_key(self.ramp_out, "Ctrl+E")
        self.ramp_out.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.ramp_out.clicked.connect(controller.ramp_out)
        self._arrange()
        controller.opened.connect(self._open)
        controller.traced.connect(self._trace)
        controller.event_received.connect(self._tell)
        controller.changed.connect(self._refresh)
        controller.began.connect(self._begin)
        self._timer = QTimer(self, interval=PERIOD, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._draw)
        self._timer.start()
        self._refresh()

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        for part in (self.traces, self.gains, self.live, self.picture, self.meters, self.matrix, *self.motion):
            part.use_theme(theme)

    def predict(self, prediction: Table) -> None:
        """Show the predicted lines of the next run."""
        self.gains.predict(prediction)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Choose the size of the verdict."""
        super().resizeEvent(event)
        self.verdict.allow(max(self.height(), LOWEST))

    def _arrange(self) -> None:
        left, middle, right = QWidget(), QWidget(), QSplitter(Qt.Orientation.Vertical)
        column = QVBoxLayout(left)
        column.addWidget(self.meters, 1)
        column.addWidget(self.steady)
        column = QVBoxLayout(middle)
        row = QHBoxLayout()
        row.addWidget(self.point, 1)
        row.addWidget(self.ramp_out)
        column.addLayout(row)
        column.addWidget(self.verdict)
        self.shown_plot.setMinimumHeight(GAINS_HEIGHT)
        column.addWidget(self.shown_plot, 1)
        column.addStretch(0)
        for part in (self.twin, self.lost):
            column.addWidget(part)
        self.tabs = QTabWidget()
        self.tabs.setObjectName("motion")
        self.tabs.addTab(self.traces, texts.TRACES_TAB)
        for plot in self.motion:
            number = self.tabs.addTab(plot, plot.kind)
            self.tabs.setTabToolTip(number, texts.MOTION_NAMES[plot.kind])
        right.addWidget(self.picture)
        right.addWidget(self.tabs)
        right.setSizes([200, 320])
        upper, lower = QSplitter(), QSplitter()
        upper.addWidget(left)
        upper.addWidget(middle)
        upper.setSizes([SHARES[0] * 12, SHARES[1] * 12])
        lower.addWidget(self.matrix)
        lower.addWidget(self.panel)
        lower.setSizes([400, 500])
        stacked = QSplitter(Qt.Orientation.Vertical)
        stacked.addWidget(upper)
        stacked.addWidget(lower)
        stacked.setSizes([420, 120])
        whole = QSplitter()
        whole.addWidget(stacked)
        whole.addWidget(right)
        whole.setSizes([(SHARES[0] + SHARES[1]) * 12, SHARES[2] * 12])
        for splitter in (upper, lower, stacked, whole, right):
            splitter.setChildrenCollapsible(False)
        for part in (left, middle):
            layout = part.layout()
            if layout is not None:
                layout.setContentsMargins(0, 0, 0, 0)
                layout.setSpacing(4)
        QVBoxLayout(self).addWidget(scrolling(whole, FITTING[0], LOWEST))

    def _begin(self, run: Run) -> None:
        self.traces.clear()
        for plot in self.motion:
            plot.forget()
        self.panel.clear()
        protocol = self._protocol = load_protocol(run.protocol)
        has_gain = "alpha_2" in protocol.point.model_fields
        self.live.forget()
        self.shown_plot.setCurrentWidget(self.gains if has_gain else self.live)
        # without a gain there is nothing to draw before the first result
        self.shown_plot.setVisible(has_gain)
        self._has_live_value = False
        self._show_point("")
        self.verdict.show_sentence(texts.NO_GAIN if has_gain else texts.NO_RESULT)
        self.arrangement = Arrangement()
        self.picture.use(run.configuration.known_specimen)
        self.traces.watch_block(None)
        self.steady.begin(run)
        self.block = BlockAngle()
        self.meters.use(run.configuration)
        self.matrix.begin(protocol, run)

    def _open(self, opened: Opened) -> None:
        self.traces.use_further(opened.further)
        if self._controller.run is not None and opened.margins:
            self.meters.use(self._controller.run.configuration, opened.margins)
        if self._controller.attached is not None:
            self.gains.predict(opened.prediction)

    def _trace(self, traces: list[Traces]) -> None:
        self.traces.add(traces)
        self.steady.add(traces)
        self.meters.add(traces)
        for block in traces:
            self.block.place(block)
        # immediately, not at the next tick
        self._draw()

    def _draw(self) -> None:
        if not self.isVisible():
            return
        shown = self.tabs.currentWidget()
        self.traces.draw()
        if isinstance(shown, MotionPlot):
            shown.draw(self.traces.ring)
        moment = self.block.nearest(self.traces.moment)
        self.picture.move_to(self.traces.ring.at(moment), self.block.at(moment))
        self.picture.show_age(self.traces.stale)
        self.meters.show_live(live=self.traces.stale is None and self._controller.running)

    def _tell(self, event: Event) -> None:
        self.matrix.follow(event, self._controller.scene.time_left)
        match event:
            case Estimate():
                self._show_point(texts.MEASURING.format(point=_sine(event.omega, event.beta)))
                self.verdict.show_sentence(running_verdict(event))
                self.gains.show_running(event)
                self.steady.point(event.omega, event.beta)
                for plot in self.motion:
                    plot.omega = event.omega
                self._couple(event.beta)
            case RunningGain():
                self._show_point(texts.MEASURING.format(point=_record_point_name(event.record, event.beta)))
                self.verdict.show_sentence(running_verdict(event))
                self.gains.show_running(event)
                self._couple(event.beta)
            case LiveValue():
                self._has_live_value = True
                self.verdict.show_sentence(running_verdict(event))
            case PointFinished():
                self._finish(event)
            case FitFinished() | TableIdentified() if self.shown_plot.currentWidget() is self.live:
                self.shown_plot.show()
                self.live.show_result(event)
                self._show_result(event)
            case StepStarted():
                self.steady.finish()
                for plot in self.motion:
                    plot.omega = None
            case TwinEstimate():
                self.block.add(event)
                for plot in self.motion:
                    plot.add(event)
            case SpecimenMounted():
                self.arrangement.follow(event)
                self.picture.show_arrangement(self.arrangement)
                self.traces.watch_block(self.arrangement.face)
            case _:
                pass

    def _finish(self, event: PointFinished) -> None:
        """Show the result of a point, with the same uncertainty as in the log and the data file."""
        point, protocol = event.point.model_dump(), self._protocol
        if protocol is None:
            return
        if protocol.log_line is not None:
            self.verdict.show_sentence(typeset(protocol.log_line(event.point)))
        elif protocol.view.headline or not self._has_live_value:
            # for a protocol without a headline, the live value is the verdict
            self.verdict.show_sentence(verdict_of(protocol.view, event.point))
        if "alpha_2" not in point:
            return
        self.shown_plot.setCurrentWidget(self.gains)
        self.shown_plot.show()
        self.gains.add(point)
        omega, beta = point.get("omega_rad_s"), point.get("beta")
        where = (
            _record_point_name(point["record"], beta)
            if "record" in point
            else ""
            if omega is None
            else _sine(omega, beta)
        )
        self._show_point(texts.LAST_POINT.format(status=point.get("status", ""), point=where))

    def _show_result(self, event: FitFinished | TableIdentified) -> None:
        if isinstance(event, FitFinished) and event.parameters:
            name, found = next(iter(event.parameters.items()))
            factor, unit = in_screen_unit(found.unit)
            value = measurement(factor * found.value, COVERAGE * factor * found.uncertainty, unit)
            self.verdict.show_sentence(f"{label(name)} {value}")
            self._show_point(f"{typeset(event.name)}: {typeset(event.text)}")
        else:
            self._show_point(typeset(event.text))

    def _show_point(self, text: str) -> None:
        self.point.setText(text)

    def _couple(self, beta: float | None) -> None:
        coupled = beta is not None
        if coupled != self.arrangement.spring:
            self.arrangement.block = self.arrangement.spring = coupled
            self.picture.show_arrangement(self.arrangement)

    def _refresh(self) -> None:
        events, traces = self._controller.lost
        lost = [text.format(n=n) for n, text in zip((events, traces), texts.LOST_PARTS, strict=True) if n]
        said = [texts.LOST.format(what=texts.AND.join(lost))] if lost else []
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


def _record_point_name(record: str, beta: float | None) -> str:
    """Name of a point under a record."""
    return (texts.BARE_RECORD if beta is None else texts.RECORD_POINT).format(record=record, beta=beta)
