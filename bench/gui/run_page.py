"""The run while it goes on: traces, the running gain beside its prediction, the spectrum, the log."""

from math import isfinite

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPlainTextEdit, QPushButton, QSplitter, QVBoxLayout, QWidget

from bench.cli.scene import Notice
from bench.cli.words import clock, difference, gain, number
from bench.events import Estimate, Event, PointFinished, RunningGain
from bench.gui import texts
from bench.gui.controller import PERIOD, Controller
from bench.gui.gain_plot import GainPlot
from bench.gui.header import set_level
from bench.gui.palette import Theme
from bench.gui.physical import PhysicalPicture
from bench.gui.traces import TracePlot
from bench.link.messages import Run, Traces
from bench.record.tables import Table

LOG_LINES = 2000


class RunPage(QWidget):
    """Follows the controller; draws only while it can be seen."""

    def __init__(self, controller: Controller, theme: Theme) -> None:
        super().__init__()
        self._controller = controller
        self.traces, self.gains = TracePlot(theme), GainPlot(theme)
        self.picture = PhysicalPicture(theme)
        self.alpha = QLabel(texts.NO_GAIN)
        self.alpha.setProperty("role", "value")
        self.alpha.setAccessibleName("running gain")
        self.predicted, self.lost = QLabel(), QLabel()
        self.log = QPlainTextEdit(readOnly=True, maximumBlockCount=LOG_LINES)
        self.log.setAccessibleName("event log")
        self.ramp_out = QPushButton(texts.RAMP_OUT)
        self.ramp_out.setToolTip(texts.RAMP_OUT_TIP)
        self.ramp_out.setShortcut("Ctrl+E")
        self.ramp_out.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.ramp_out.clicked.connect(controller.ramp_out)
        self._arrange()
        controller.traced.connect(self._trace)
        controller.told.connect(self._tell)
        controller.noticed.connect(self._note)
        controller.changed.connect(self._refresh)
        controller.began.connect(self._begin)
        self._timer = QTimer(self, interval=PERIOD, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._draw)
        self._timer.start()
        self._refresh()

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
        column.addWidget(self.predicted)
        column.addWidget(self.lost)
        for part in (numbers, self.gains, self.picture, self.log):
            right.addWidget(part)
        right.setSizes([90, 300, 210, 130])
        whole = QSplitter()
        whole.addWidget(self.traces)
        whole.addWidget(right)
        whole.setSizes([640, 620])
        QVBoxLayout(self).addWidget(whole)

    def _begin(self, run: Run) -> None:
        self.traces.clear()
        self.log.clear()
        self.alpha.setText(texts.NO_GAIN)
        self.predicted.setText("")
        self.picture.use(run.configuration.specimen)

    def _trace(self, traces: list[Traces]) -> None:
        self.traces.add(traces)

    def _draw(self) -> None:
        if self.isVisible():
            self.traces.draw()
            self.picture.move_to(self.traces.ring.last())

    def _tell(self, event: Event) -> None:
        match event:
            case Estimate():
                self._show(event.alpha_2, event.uncertainty, event.predicted, f"{event.cycles} cycles")
                self.gains.show_running(event)
                self.picture.coupled = event.beta is not None
            case RunningGain():
                self._show(event.alpha_2, None, event.predicted, f"{event.seconds:.1f} s of {event.record}")
                self.picture.coupled = event.beta is not None
            case PointFinished():
                self.gains.add(event.point.model_dump())
            case _:
                pass

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
        self.lost.setText(texts.LOST.format(events=events, traces=traces) if events or traces else "")
        set_level(self.lost, "wait")
        self.ramp_out.setEnabled(self._controller.running)
