"""Between the link and the widgets: what was heard becomes state and signals, what is pressed becomes a request.

It holds no knowledge of experiments: whatever it does, the command line does too.
"""

from collections.abc import Mapping
from typing import Literal

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from bench.cli.scene import Notice, Scene
from bench.events import State, StateChanged
from bench.gui import texts
from bench.gui.standing import DRIVEN, Standing, standing
from bench.link.client import Link
from bench.link.messages import (
    BEAT,
    Beat,
    Ended,
    FromSession,
    Question,
    Refused,
    Run,
    SafetyInputs,
    Survey,
    Surveyed,
    Told,
    Traces,
)
from drivers.clock import now

PERIOD = 28
"""Between two looks at the link, and between two drawings [ms]: a little over thirty a second."""


class Controller(QObject):
    """The one place that talks to the link; lives in the thread of the window."""

    changed = Signal()
    """The state, a time or the link changed."""
    traced = Signal(object)
    """A list of `Traces`."""
    noticed = Signal(object)
    """A `bench.cli.scene.Notice` for the log."""
    told = Signal(object)
    """An event of the engine."""
    asked = Signal(object)
    """A `Question`, or None when it stands no longer."""
    surveyed = Signal(object)
    """`Surveyed` or `Refused`: the answer to `survey`."""
    began = Signal(object)
    """The `Run` that was just started."""
    ended = Signal(object)
    """`Ended` or `Refused`: how the run ended."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._link: Link | None = None
        self._running = False
        self._question: Question | None = None
        self._spoken = self._started = 0.0
        self._stopped_at: float | None = None
        self.scene = Scene()
        self.inputs: Mapping[str, bool] = {}
        self.lost = (0, 0)
        self._failure = ""
        self.latched = False
        """STOP was pressed and not cleared since."""
        self._timer = QTimer(self, interval=PERIOD, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._look)
        self._timer.start()

    @property
    def running(self) -> bool:
        """Whether a run is under way, or was when the link was lost."""
        return self._running

    @property
    def busy(self) -> bool:
        """Whether a run or a survey is under way."""
        return self._link is not None

    @property
    def armed(self) -> bool:
        """Whether the rig is, or may be, armed."""
        return self._running and (self.scene.state in DRIVEN or self.standing.level == "alarm")

    @property
    def elapsed(self) -> float:
        """Seconds of the wall clock since the run was started."""
        if not self._started:
            return 0.0
        return (self._stopped_at or now()) - self._started

    @property
    def standing(self) -> Standing:
        """What the header says."""
        link, scene = self._link if self._running else None, self.scene
        if self._failure:
            return Standing(texts.FAILED_WORD, self._failure, "alarm", "cross")
        if link is None:
            return standing("over" if self._started else "none", scene.state, scene.reason, 0.0)
        return standing(link.standing, scene.state, scene.reason, link.silence)

    def survey(self, asked: Survey) -> None:
        """Have the plan computed; `surveyed` brings the answer. A survey under way is given up."""
        if not self._running:
            self._let_go()
            self._link = Link(asked)

    def start(self, run: Run) -> None:
        """Start a run. Nothing happens while one is under way or STOP is latched."""
        if self._running or self.latched:
            return
        self._let_go()
        self.scene, self.inputs, self.lost, self._failure = Scene(), {}, (0, 0), ""
        self._link, self._running = Link(run), True
        self._started, self._stopped_at = now(), None
        self.began.emit(run)
        self.changed.emit()

    def press_stop(self) -> None:
        """STOP: the first press ramps out fast, the next cuts the enable line. It latches."""
        if self._link is not None and self._running:
            self._link.ask("halt" if self.latched else "abort")
        self.latched = True
        self.changed.emit()

    def clear_stop(self) -> None:
        """Allow a new run; not while the stopped one is still under way."""
        self.latched = self.latched and self._running
        self.changed.emit()

    def ramp_out(self) -> None:
        """End the run gently."""
        if self._link is not None and self._running:
            self._link.ask("stop")

    def answer(self, *, agreed: bool) -> None:
        """Answer the question that stands."""
        if self._link is not None and self._question is not None:
            self._link.answer(self._question.number, agreed=agreed)
            self._question = None
            self.asked.emit(None)

    def close(self) -> None:
        """Leave the session to itself: it ramps out, unless it was told to go on."""
        self._timer.stop()
        self._let_go()

    def _let_go(self) -> None:
        link, self._link, self._running = self._link, None, False
        if link is not None:
            link.leave()

    def _look(self) -> None:
        link = self._link
        if link is None:
            return
        if now() - self._spoken >= BEAT / 2:
            self._spoken = now()
            link.alive()
            self.changed.emit()
        messages = link.take()
        if traces := [message for message in messages if isinstance(message, Traces)]:
            self.traced.emit(traces)
        for message in messages:
            self._take(message)

    def _take(self, message: FromSession) -> None:
        match message:
            case Told(event):
                notice = self.scene.update(event)
                self.told.emit(event)
                if notice is not None:
                    self.noticed.emit(notice)
                if isinstance(event, StateChanged):
                    self._left_waiting(event.after)
            case Beat():
                # also true when the change itself was lost on the way
                self.scene.state, self.scene.reason, self.scene.time = message.state, message.reason, message.time
                self.lost = (message.lost_events, message.lost_traces)
            case Question():
                self._question = message
                self.asked.emit(message)
            case SafetyInputs():
                self.inputs = message.good
            case Surveyed():
                self._let_go()
                self.surveyed.emit(message)
            case Ended():
                self._over(message, Notice(self.scene.time, "end", f"{message.status}: {message.reason}"))
            case Refused():
                self._over(message, Notice(self.scene.time, "end", message.text, grave=True))
            case _:
                return
        self.changed.emit()

    def _left_waiting(self, after: State) -> None:
        if after is not State.WAITING and self._question is not None:
            self._question = None
            self.asked.emit(None)

    def _over(self, message: Ended | Refused, notice: Notice) -> None:
        was: Literal["run", "survey"] = "run" if self._running else "survey"
        self._link, self._running, self._question = None, False, None
        self._stopped_at = now()
        if was == "survey":
            self.surveyed.emit(message)
            return
        if isinstance(message, Refused):
            self.scene.state = State.CLOSED
            self.scene.reason = message.text
            self._failure = texts.FAILED.format(text=message.text) if message.failed else ""
        self.asked.emit(None)
        self.noticed.emit(notice)
        self.ended.emit(message)
