"""Between the link and the widgets: what was heard becomes state and signals, what is pressed becomes a request.

It holds no knowledge of experiments: whatever it does, the command line does too.
"""

from collections.abc import Mapping
from contextlib import suppress
from math import inf

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from bench.cli.scene import Notice, Scene
from bench.events import State, StateChanged
from bench.gui import texts
from bench.gui.standing import DRIVEN, Standing, standing
from bench.link.client import Link
from bench.link.messages import (
    BEAT,
    SILENCE,
    Beat,
    Ended,
    FromSession,
    Opened,
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
"""Between two drawings [ms]: a little over thirty a second; and at most between two looks at the link."""

DELIBERATE = 0.7
"""After the first press of STOP the next counts from so many seconds on: a double click is one press."""


class Controller(QObject):
    """The one place that talks to the link; lives in the thread of the window."""

    changed = Signal()
    """The state, a time or the link changed."""
    opened = Signal(object)
    """`Opened`: the rig of the run is open."""
    traced = Signal(object)
    """A list of `Traces`."""
    noticed = Signal(object)
    """A `bench.cli.scene.Notice` for the log."""
    told = Signal(object)
    """An event of the engine."""
    asked = Signal(object)
    """A `Question`, or None when it stands no longer."""
    surveyed = Signal(object, object)
    """`Surveyed` or `Refused`, and who asked: the answer to `survey`."""
    began = Signal(object)
    """The `Run` that was just started."""
    ended = Signal(object)
    """`Ended` or `Refused`: how the run ended."""
    _heard = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._link: Link | None = None
        self._surveys: dict[object, Link] = {}
        self._running = False
        self._question: Question | None = None
        self._spoken = self._started = 0.0
        self._stopped_at: float | None = None
        self.scene = Scene()
        self.inputs: Mapping[str, bool] = {}
        self._inputs_heard: float | None = None
        self.driven = False
        """Whether the rig was armed in the run that is under way, or was the last."""
        self.held = ""
        """Why nobody but the queue may start a run; empty when anybody may."""
        self.lost = (0, 0)
        self._quiet, self._longest_quiet = 0.0, inf
        self._failure = ""
        self.latched = False
        """STOP was pressed and not cleared since."""
        self._pressed_at = 0.0
        self._timer = QTimer(self, interval=PERIOD, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._look)
        self._timer.start()
        self._called = False
        self._heard.connect(self._hear, Qt.ConnectionType.QueuedConnection)

    @property
    def running(self) -> bool:
        """Whether a run is under way, or was when the link was lost."""
        return self._running

    @property
    def inputs_age(self) -> float | None:
        """Seconds since the safety inputs of the run that is under way were heard of; None when they never were."""
        if not self._running or self._inputs_heard is None:
            return None
        return now() - self._inputs_heard

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
        if link.standing == "linked" and scene.state in DRIVEN and self._quiet > self._longest_quiet:
            # the process lives, its engine does not turn: the last known state says nothing of the bench
            return standing("no link", scene.state, scene.reason, self._quiet)
        return standing(link.standing, scene.state, scene.reason, link.silence)

    def survey(self, asked: Survey, by: object) -> None:
        """Have a plan computed, also while a run is under way; `surveyed` brings the answer.

        An earlier one that was asked for `by` the same is given up.
        """
        self.give_up(by)
        self._surveys[by] = Link(asked, self._call)

    def give_up(self, by: object) -> None:
        """Forget what was asked for `by` somebody."""
        if (link := self._surveys.pop(by, None)) is not None:
            link.leave()

    def start(self, run: Run) -> None:
        """Start a run. Nothing happens while one is under way or STOP is latched."""
        if self._running or self.latched:
            return
        self.scene, self.inputs, self.lost, self._failure = Scene(), {}, (0, 0), ""
        self._inputs_heard, self.driven = None, False
        # a simulated bench that does not keep the pace of the clock is as late as its model
        paced = run.realtime or run.configuration.backend != "simulated"
        self._quiet, self._longest_quiet = 0.0, SILENCE + run.configuration.acquisition.block_duration if paced else inf
        self._link, self._running = Link(run, self._call), True
        self._started, self._stopped_at = now(), None
        self.began.emit(run)
        self.changed.emit()

    def press_stop(self) -> None:
        """STOP: the first press ramps out fast, one at least `DELIBERATE` later cuts the enable line. It latches."""
        first = not self.latched
        if first:
            self._pressed_at = now()
        if self._link is not None and (first or now() - self._pressed_at >= DELIBERATE):
            self._link.ask("abort" if first else "halt")
        self.latched = True
        self.changed.emit()

    def clear_stop(self) -> None:
        """Allow a new run; not while the stopped one is still under way."""
        self.latched = self.latched and self._running
        self.changed.emit()

    def ramp_out(self) -> None:
        """End the run gently."""
        if self._link is not None:
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
        for by in list(self._surveys):
            self.give_up(by)
        link, self._link, self._running = self._link, None, False
        if link is not None:
            link.leave()

    def _call(self) -> None:
        """In a thread of the link: there is something to take. One call waits at a time."""
        if not self._called:
            self._called = True
            # the window may be gone already
            with suppress(RuntimeError):
                self._heard.emit()

    def _hear(self) -> None:
        self._called = False
        self._look()

    def _look(self) -> None:
        links = [*self._surveys.values(), *([self._link] if self._link is not None else [])]
        if links and now() - self._spoken >= BEAT / 2:
            self._spoken = now()
            for link in links:
                link.alive()
            self.changed.emit()
        for by, link in list(self._surveys.items()):
            for message in link.take():
                self._take_answer(by, message)
        if self._link is None:
            return
        messages = self._link.take()
        # how many columns traces have is known before they are drawn
        for message in messages:
            if isinstance(message, Opened):
                self.opened.emit(message)
        if traces := [message for message in messages if isinstance(message, Traces)]:
            self.traced.emit(traces)
        for message in messages:
            self._take(message)

    def _take_answer(self, by: object, message: FromSession) -> None:
        if isinstance(message, Surveyed | Refused) and self._surveys.pop(by, None) is not None:
            self.surveyed.emit(message, by)
            self.changed.emit()

    def _take(self, message: FromSession) -> None:
        match message:
            case Told(event):
                notice = self.scene.update(event)
                self.told.emit(event)
                if notice is not None:
                    self.noticed.emit(notice)
                if isinstance(event, StateChanged):
                    self._entered(event.after)
            case Beat():
                # also true when the change itself was lost on the way
                self.scene.state, self.scene.reason, self.scene.time = message.state, message.reason, message.time
                self.driven = self.driven or message.state in DRIVEN
                self.lost, self._quiet = (message.lost_events, message.lost_traces), message.quiet
            case Question():
                self._question = message
                self.asked.emit(message)
            case SafetyInputs():
                self.inputs, self._inputs_heard = message.good, now()
            case Ended():
                self._over(message, Notice(self.scene.time, "end", f"{message.status}: {message.reason}"))
            case Refused():
                self._over(message, Notice(self.scene.time, "end", message.text, grave=True))
            case _:
                return
        self.changed.emit()

    def _entered(self, state: State) -> None:
        self.driven = self.driven or state in DRIVEN
        if state is not State.WAITING and self._question is not None:
            self._question = None
            self.asked.emit(None)

    def _over(self, message: Ended | Refused, notice: Notice) -> None:
        self._link, self._running, self._question = None, False, None
        self._stopped_at = now()
        if isinstance(message, Refused):
            self.scene.state = State.CLOSED
            self.scene.reason = message.text
            self._failure = texts.FAILED.format(text=message.text) if message.failed else ""
        self.asked.emit(None)
        self.noticed.emit(notice)
        self.ended.emit(message)
