"""The run while it goes on: traces, the running gain beside its prediction, what is steady, the gains, the log."""

from math import isfinite

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QSizePolicy,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from bench.cli.scene import Notice
from bench.cli.words import ABSENT, clock, difference, gain, measured, number
from bench.events import Estimate, Event, LiveValue, PointFinished, RunningGain, StepStarted, TwinEstimate
from bench.gui import texts
from bench.gui.buttons import give_key
from bench.gui.controller import PERIOD, Controller
from bench.gui.gain_plot import GainPlot
from bench.gui.header import set_level
from bench.gui.palette import Theme
from bench.gui.physical import BlockAngle, PhysicalPicture
from bench.gui.steady_view import SteadyView
from bench.gui.traces import TracePlot
from bench.link.messages import Opened, Run, Traces
from bench.record.tables import Table

LOG_LINES = 2000
GAINS_HEIGHT = 170
"""The least that the gains are drawn in [px]: in less their axis cannot be read."""
OLD = 0.5
"""Age of the newest sample from which it is told while a run goes on [s]."""


class RunPage(QWidget):
    """Follows the controller; draws only while it can be seen."""

    def __init__(self, controller: Controller, theme: Theme) -> None:
        super().__init__()
        self._controller = controller
        self.traces, self.gains, self.steady = TracePlot(theme), GainPlot(theme), SteadyView()
        self.picture, self.block = PhysicalPicture(theme), BlockAngle()
        self.alpha = QLabel(texts.NO_GAIN)
        self.alpha.setProperty("role", "value")
        self.alpha.setAccessibleName(texts.NAMES["alpha"])
        self.predicted, self.lost = QLabel(wordWrap=True), QLabel(wordWrap=True)
        self.twin = QLabel()
        # one line whatever it says: nothing below may jump
        self.twin.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.log = QPlainTextEdit(readOnly=True, maximumBlockCount=LOG_LINES)
        self.log.setAccessibleName(texts.NAMES["log"])
        self.ramp_out = QPushButton(texts.RAMP_OUT)
        self.ramp_out.setToolTip(texts.RAMP_OUT_TIP)
        give_key(self.ramp_out, "Ctrl+E")
        self.ramp_out.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.ramp_out.clicked.connect(controller.ramp_out)
        self._arrange()
        controller.opened.connect(self._open)
        controller.traced.connect(self._trace)
        controller.told.connect(self._tell)
        controller.noticed.connect(self._note)
        controller.changed.connect(self._refresh)
        controller.began.connect(self._begin)
        self._timer = QTimer(self, interval=PERIOD, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._draw)
        self._timer.start()
        self._refresh()

    def use_theme(self, theme: Theme) -> None:
        """Take these colours."""
        for part in (self.traces, self.gains, self.picture):
            part.use_theme(theme)

    def predict(self, prediction: Table) -> None:
        """The lines on which the points of the next run belong."""
        self.gains.predict(prediction)

    def _arrange(self) -> None:
        right = QSplitter(Qt.Orientation.Vertical)
        numbers = QWidget()
        column = QVBoxLayout(numbers)
        column.setContentsMargins(0, 0, 0, 0)
        row = QHBoxLayout()
        row.addWidget(self.alpha, 1)
        row.addWidget(self.ramp_out)
        column.addLayout(row)
        for part in (self.predicted, self.twin, self.steady, self.lost):
            column.addWidget(part)
        self.gains.setMinimumHeight(GAINS_HEIGHT)
        for part in (self.gains, self.picture, self.log):
            right.addWidget(part)
        right.setSizes([280, 260, 90])
        column.addWidget(right, 1)
        whole = QSplitter()
        whole.addWidget(self.traces)
        whole.addWidget(numbers)
        whole.setSizes([600, 660])
        QVBoxLayout(self).addWidget(whole)

    def _begin(self, run: Run) -> None:
        self.traces.clear()
        self.log.clear()
        self.alpha.setText(texts.NO_GAIN)
        self.predicted.setText("")
        self.picture.use(run.configuration.known_specimen)
        self.steady.begin(run)
        self.block = BlockAngle()

    def _open(self, opened: Opened) -> None:
        self.traces.use_further(opened.further)

    def _trace(self, traces: list[Traces]) -> None:
        self.traces.add(traces)
        self.steady.add(traces)
        for block in traces:
            self.block.place(block)
        # at once, not with the next tick: what is new waits for nothing
        self._draw()

    def _draw(self) -> None:
        if self.isVisible():
            self.traces.draw()
            moment = self.block.nearest(self.traces.moment)
            self.picture.move_to(self.traces.ring.at(moment), self.block.at(moment))

    def _tell(self, event: Event) -> None:
        match event:
            case Estimate():
                self._show(event.alpha_2, event.uncertainty, event.predicted, texts.CYCLES.format(cycles=event.cycles))
                self.gains.show_running(event)
                self.steady.point(event.omega, event.beta)
                self._couple(event.beta)
            case RunningGain():
                self._show(
                    event.alpha_2,
                    None,
                    event.predicted,
                    texts.SO_FAR.format(seconds=event.seconds, record=event.record),
                )
                self.gains.show_running(event)
                self._couple(event.beta)
            case LiveValue():
                self.alpha.setText(f"{event.label}  {measured(event.value, event.uncertainty, event.unit)}")
                off = difference(event.value, event.predicted)
                predicted = f"{texts.PREDICTED} {number(event.predicted)}, difference {off}"
                self.predicted.setText(predicted if isfinite(event.predicted) else "")
            case PointFinished():
                self.gains.add(event.point.model_dump())
            case StepStarted():
                self.steady.over()
            case TwinEstimate():
                self.block.add(event)
                self._show_twin()
            case _:
                pass

    def _couple(self, beta: float | None) -> None:
        self.picture.couple(beta is not None)

    def _show(self, value: float, uncertainty: float | None, predicted: float, effort: str) -> None:
        known = isfinite(value)
        self.alpha.setText(f"{texts.ALPHA}  {gain(value, uncertainty)}" if known else texts.NO_GAIN)
        beside = f"{texts.PREDICTED} {number(predicted)}, difference {difference(value, predicted)}, {effort}"
        self.predicted.setText(beside if known else effort)

    def _note(self, notice: Notice) -> None:
        mark = "▲ " if notice.grave else ""
        self.log.appendPlainText(f"{clock(notice.time):>8}  {mark}{notice.kind}: {notice.text}")

    def _refresh(self) -> None:
        events, traces = self._controller.lost
        said = [texts.LOST.format(events=events, traces=traces)] if events or traces else []
        if self._controller.armed and self.traces.age > OLD:
            said.append(texts.DATA_AGE.format(age=self.traces.age))
        self.lost.setText(" ".join(said))
        self.lost.setVisible(bool(said))
        set_level(self.lost, "wait")
        self._show_twin()
        self.ramp_out.setEnabled(self._controller.running)

    def _show_twin(self) -> None:
        self.twin.setText(f"{texts.TWIN}: {self._controller.scene.twin or ABSENT}")
