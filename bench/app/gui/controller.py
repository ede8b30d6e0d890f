"""The connection between session and widgets: converts messages into state and signals, and user input into requests.

It contains nothing specific to a protocol, and no operation that the command line does not offer.
"""

from collections import deque
from contextlib import suppress

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from bench.app.display import texts
from bench.app.display.session_state import SessionState
from bench.app.display.status import DRIVEN, Status
from bench.app.ipc.client import AttachedClient, ClientConnection, SessionClient
from bench.app.ipc.messages import (
    BEAT,
    Attached,
    Control,
    Ended,
    FromSession,
    Opened,
    PlanCheck,
    PlanChecked,
    Published,
    Question,
    Refused,
    Run,
    Traces,
)
from bench.app.ipc.sessions import RunningSession
from drivers.clock import now

PERIOD = 28
"""Redraw interval [ms], for about 35 redraws per second; also the longest interval between checks of the connection."""

BUDGET = 0.02
"""Maximum time for handling messages in one iteration of the main loop [s]; the others wait for the next iteration."""

DELIBERATE = 0.7
"""Time after the first press of STOP [s] during which further presses are ignored: a double click counts once."""


class Controller(QObject):
    """The only user of the connection to the session; it runs in the window's thread."""

    changed = Signal()
    """Emitted when the state, a time or the connection has changed."""
    opened = Signal(object)
    """Emits `Opened` when the rig of the run is open."""
    traced = Signal(object)
    """Emits a list of `Traces`."""
    noticed = Signal(object)
    """Emits a `bench.app.run_display.Notice` for the log."""
    event_received = Signal(object)
    """Emits an event of the engine."""
    question_changed = Signal(object)
    """Emits a `Question`, and None when it is no longer open."""
    plan_checked = Signal(object, object)
    """Emits the result of `check_plan`, a `PlanChecked` or a `Refused`, and the object that requested it."""
    began = Signal(object)
    """Emits the `Run` that was just started, or to which the window was just attached."""
    ended = Signal(object)
    """Emits the end of the run: an `Ended` or a `Refused`."""
    _message_received = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._link: ClientConnection | None = None
        self._plan_checks: dict[object, SessionClient] = {}
        self._waiting = deque[FromSession]()
        self._running = False
        self._spoken = 0.0
        self.session = SessionState()
        """State of the current or last run."""
        self.elsewhere: RunningSession | None = None
        """A session under way on this computer to which this window is not attached; None if there is none."""
        self.held = ""
        """Reason why only the queue may start a run; empty if there is none."""
        self.latched = False
        """Whether STOP was pressed and not cleared since."""
        self._pressed_at: float | None = None
        self._timer = QTimer(self, interval=PERIOD, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._look)
        self._timer.start()
        self._called = False
        self._message_received.connect(self._process_messages, Qt.ConnectionType.QueuedConnection)

    @property
    def running(self) -> bool:
        """Whether a run is in progress, or was when the connection was lost."""
        return self._running

    @property
    def why_busy(self) -> str:
        """Reason why no further run can begin; empty if one can. Simulated benches may run concurrently."""
        if self._running:
            return texts.START_BUSY
        return texts.START_ELSEWHERE if self.elsewhere is not None and self.elsewhere.real else ""

    @property
    def cuts_next(self) -> bool:
        """Whether STOP has been pressed during this run: the next press cuts the enable line."""
        return self._running and self._pressed_at is not None

    @property
    def owner(self) -> str:
        """Text that states whose run is shown and what this window may do; empty without a run."""
        if not self._running:
            return ""
        attached, run = self.session.attached, self.session.run
        if attached is not None:
            owner = texts.OWNERS.get(attached.owner, attached.owner)
            right = texts.ATTACHED_CONTROLS if self.session.controls else texts.ATTACHED_READ_ONLY.format(owner=owner)
            return f"{texts.ATTACHED_RUN.format(owner=owner.capitalize(), run=attached.title)} {right}"
        by = run.about.get("operator", "") if run is not None else ""
        told = "" if run is None else f"{run.protocol}{f' by {by}' if by else ''}, {run.out}"
        return texts.OWN_RUN.format(run=told)

    @property
    def armed(self) -> bool:
        """Whether the rig is armed, or its state is unknown."""
        return self._running and (self.session.scene.state in DRIVEN or self.status.level == "alarm")

    @property
    def status(self) -> Status:
        """Status shown in the header."""
        link = self._link if self._running else None
        if link is not None:
            return self.session.status(link.status, link.silence, lives=link.lives)
        if self.elsewhere is not None and not self.session.failed:
            return Status(texts.RUN_ELSEWHERE, texts.ELSEWHERE.format(run=self.elsewhere.title), "wait", "ring")
        return self.session.status(None)

    def check_plan(self, plan: PlanCheck, by: object) -> None:
        """Request a plan check, also while a run is under way; `plan_checked` emits the result. A new request replaces
        an earlier one made `by` the same object.
        """
        self.cancel_check(by)
        self._plan_checks[by] = SessionClient(plan, self._call)

    def cancel_check(self, by: object) -> None:
        """Cancel the plan check requested `by` this object."""
        if (link := self._plan_checks.pop(by, None)) is not None:
            link.leave()

    def start(self, run: Run) -> None:
        """Start a run. Has no effect while one is under way or STOP is latched."""
        if self._running or self.latched:
            return
        self._use(SessionClient(run, self._call), None)
        self.session.begin(run)
        self._begin(run)

    def attach(self, session: RunningSession) -> None:
        """Attach to a session that another window or a terminal has started, and show its run, which this window can
        stop.
        """
        if not self._running:
            self._use(AttachedClient(session, self._call), session)
            self.changed.emit()

    def detach(self) -> None:
        """Detach from a session; its run is not affected."""
        link = self._link
        if link is not None and self.session.attached is not None:
            self._link, self._running, self.session = None, False, SessionState()
            link.leave()
            self.question_changed.emit(None)
            self.changed.emit()

    def _use(self, link: ClientConnection, attached: RunningSession | None) -> None:
        self.session, self.elsewhere = SessionState(attached), None
        self._waiting.clear()
        self._link, self._running, self._pressed_at = link, True, None

    def _begin(self, run: Run) -> None:
        self.began.emit(run)
        self.changed.emit()

    def press_stop(self) -> None:
        """Handle a press of STOP, which latches: the first press during a run ramps the output quickly to zero; another
        press, at least `DELIBERATE` seconds after the first, cuts the enable line. A run that is under way elsewhere,
        and is named in the header, is attached and ended in the same way.
        """
        if not self._running and self.elsewhere is not None:
            self.attach(self.elsewhere)
        if self._link is not None:
            if self._pressed_at is None:
                self._pressed_at = now()
                self._link.ask("abort")
            elif now() - self._pressed_at >= DELIBERATE:
                self._link.ask("halt")
        self.latched = True
        self.changed.emit()

    def clear_stop(self) -> None:
        """Clear STOP, which allows a new run; has no effect while the stopped run is still under way."""
        self.latched = self.latched and self.cuts_next
        self.changed.emit()

    def ramp_out(self) -> None:
        """Request a gentle ramp-out, which ends the run."""
        if self._link is not None and self.session.controls:
            self._link.ask("stop")

    def note(self, text: str) -> None:
        """Add a note to the log and to the data file of the run."""
        if self._link is not None and text.strip():
            run = self.session.run
            by = "" if run is None else run.about.get("operator", "")
            self._link.note(text.strip(), by or texts.UNNAMED)

    def answer(self, *, agreed: bool) -> None:
        """Answer the open question."""
        session = self.session
        if self._link is not None and session.question is not None and session.controls:
            self._link.answer(session.question.number, agreed=agreed)
            session.question = None
            self.question_changed.emit(None)

    def close(self) -> None:
        """Disconnect from the session: the run ramps out, unless it is to continue without a client."""
        self._timer.stop()
        for by in list(self._plan_checks):
            self.cancel_check(by)
        link, self._link, self._running = self._link, None, False
        if link is not None:
            link.leave()

    def _call(self) -> None:
        """Called in a thread of the connection when messages have arrived; at most one call is pending."""
        if not self._called:
            self._called = True
            # the window may have been closed
            with suppress(RuntimeError):
                self._message_received.emit()

    def _process_messages(self) -> None:
        self._called = False
        self._look()

    def _look(self) -> None:
        links = [*self._plan_checks.values(), *([self._link] if self._link is not None else [])]
        if links and now() - self._spoken >= BEAT / 2:
            self._spoken = now()
            for link in links:
                link.alive()
            self.changed.emit()
        for by, link in list(self._plan_checks.items()):
            for message in link.take():
                self._take_answer(by, message)
        if self._link is None:
            return
        messages = self._link.take()
        # `opened` precedes traces, which need the number of columns; in an attached session, the run precedes `opened`
        for message in messages:
            if isinstance(message, Attached):
                self._take(message)
            elif isinstance(message, Opened):
                self.opened.emit(message)
        if traces := [message for message in messages if isinstance(message, Traces)]:
            self.traced.emit(traces)
        self._waiting.extend(message for message in messages if not isinstance(message, Traces | Attached))
        if self._waiting:
            self._handle_waiting()

    def _handle_waiting(self) -> None:
        """Handle messages in order for up to `BUDGET` seconds, and emit `changed` once."""
        end = now() + BUDGET
        while self._waiting:
            self._take(self._waiting.popleft())
            if now() >= end:
                break
        self.changed.emit()
        if self._waiting:
            self._call()

    def _take_answer(self, by: object, message: FromSession) -> None:
        if isinstance(message, PlanChecked | Refused) and self._plan_checks.pop(by, None) is not None:
            self.plan_checked.emit(message, by)
            self.changed.emit()

    def _take(self, message: FromSession) -> None:
        session, question = self.session, self.session.question
        notice = session.follow(message)
        match message:
            case Published(event):
                self.event_received.emit(event)
                if notice is not None:
                    self.noticed.emit(notice)
                if question is not None and session.question is None:
                    self.question_changed.emit(None)
            case Attached():
                self._begin(message.run)
            case Control():
                self.question_changed.emit(session.question if message.granted else None)
            case Question():
                if session.controls:
                    self.question_changed.emit(message)
            case Ended() | Refused():
                self._link, self._running = None, False
                self.question_changed.emit(None)
                self.noticed.emit(notice)
                self.ended.emit(message)
            case _:
                pass
