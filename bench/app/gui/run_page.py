"""The Run page: limit meters, verdict, the protocol's plot, picture of the specimen, traces, points and log."""

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QPushButton,
    QSplitter,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from bench.app.display import texts
from bench.app.display.buffers import BlockAngle
from bench.app.display.run_contents import RunContents
from bench.app.display.theme import Theme
from bench.app.display.typography import typeset
from bench.app.formatting import ABSENT, clock
from bench.app.gui.campaign_matrix import MatrixView
from bench.app.gui.controller import PERIOD, Controller
from bench.app.gui.live_view import LiveViewArea
from bench.app.gui.log_panel import LogPanel
from bench.app.gui.meters import MetersView
from bench.app.gui.motion_plot import KINDS, MotionPlot
from bench.app.gui.picture import PhysicalPicture
from bench.app.gui.steadiness import SteadyView
from bench.app.gui.traces import TracePlot
from bench.app.gui.verdict import VerdictLabel
from bench.app.gui.widgets import FITTING, ElidingLabel, give_key, scrolling, set_level
from bench.app.ipc.messages import Opened, Run, Traces
from bench.datafile.tables import Table
from bench.events import Event, StepStarted
from bench.live_values import Estimate, TwinEstimate

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
        self._controller, self._running = controller, False
        self.traces, self.live, self.steady = TracePlot(theme), LiveViewArea(theme), SteadyView()
        self.gains = self.live.gains
        self.motion = tuple(MotionPlot(theme, kind) for kind in KINDS)
        self.contents = RunContents()
        self.picture, self.block = PhysicalPicture(theme), BlockAngle()
        self.meters, self.matrix = MetersView(theme), MatrixView(theme)
        self.panel = LogPanel(controller)
        self.log = self.panel.text
        self.point, self.verdict = ElidingLabel(), VerdictLabel()
        self.verdict.show_sentence(self.contents.sentence)
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
        for part in (self.traces, self.live, self.picture, self.meters, self.matrix, *self.motion):
            part.use_theme(theme)

    def predict(self, prediction: Table) -> None:
        """Show the predicted lines of the next run."""
        self.live.predict(prediction)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Limit the height of the verdict to a fraction of the height of the page."""
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
        self.live.setMinimumHeight(GAINS_HEIGHT)
        column.addWidget(self.live, 1)
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
        contents = self.contents = RunContents(run)
        self.point.setText("")
        self.verdict.show_sentence(contents.sentence)
        self.picture.use(run.configuration.known_specimen)
        self.traces.watch_block(None)
        self.steady.begin(run)
        self.block = BlockAngle()
        self.meters.use(run.configuration)
        if self._controller.session.attached is not None:
            # the gains of an earlier run; those of a window's own run were predicted before
            self.live.predict({})
        if contents.protocol is not None:
            self.live.begin(contents.protocol, run)
            self.matrix.begin(contents.protocol, run)

    def _open(self, opened: Opened) -> None:
        self.traces.use_further(opened.further)
        if self._controller.session.run is not None and opened.margins:
            self.meters.use(self._controller.session.run.configuration, opened.margins)
        if self._controller.session.attached is not None:
            self.live.predict(opened.prediction)
        self.live.open(opened.prediction)
        self.matrix.open(opened.prediction)

    def _trace(self, traces: list[Traces]) -> None:
        self.traces.add(traces)
        self.steady.add(traces)
        self.meters.add(traces)
        for block in traces:
            self.block.place(block)
        # draw new samples at once, without waiting for the timer
        self._draw_motion()

    def _draw(self) -> None:
        self._draw_motion()
        if self.isVisible():
            self.live.draw()

    def _draw_motion(self) -> None:
        if not self.isVisible():
            return
        shown = self.tabs.currentWidget()
        self.traces.draw()
        if isinstance(shown, MotionPlot):
            shown.draw(self.traces.ring)
        moment = self.block.nearest(self.traces.moment)
        self.picture.move_to(*self.contents.instant(self.traces.ring, self.block, moment))
        self.picture.show_age(self.traces.stale)
        self.meters.show_live(live=self.traces.stale is None and self._controller.running)

    def _tell(self, event: Event) -> None:
        self.matrix.follow(event, self._controller.session.scene.time_left)
        self.live.follow(event)
        contents = self.contents
        contents.follow(event)
        self.point.setText(contents.point)
        self.verdict.show_sentence(contents.sentence)
        if contents.arrangement != self.picture.canvas.arrangement:
            self.picture.show_arrangement(contents.arrangement)
            self.traces.watch_block(contents.arrangement.face, contents.arranged)
        match event:
            case Estimate():
                self.steady.point(event.omega, event.beta)
                for plot in self.motion:
                    plot.begin_sine(event.omega, event.time)
            case StepStarted():
                self.steady.finish()
                for plot in self.motion:
                    plot.end_sine()
            case TwinEstimate():
                self.block.add(event)
                for plot in self.motion:
                    plot.add(event)
            case _:
                pass

    def _end(self) -> None:
        """Show that nothing is being measured any more: the run has ended, or the window was detached from it."""
        self.steady.finish()
        self.matrix.end()
        self.live.end_step()
        self.contents.end_step()
        self.point.setText(self.contents.point)
        self.verdict.show_sentence(self.contents.sentence)

    def _refresh(self) -> None:
        was_running, self._running = self._running, self._controller.running
        if was_running and not self._running:
            self._end()
        events, traces = self._controller.session.lost
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
        self.ramp_out.setEnabled(self._controller.running and self._controller.session.controls)

    def _show_twin(self) -> None:
        # an estimate may arrive after the end of the run
        twin = self._controller.session.scene.twin if self._controller.running else ""
        self.twin.setText(f"{texts.TWIN}: {typeset(twin) or ABSENT}")
