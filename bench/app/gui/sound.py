"""Signal tones for a question, an abort and the end of a run."""

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QApplication

from bench.app.gui.controller import Controller
from bench.app.ipc.messages import Ended, Question, Refused
from bench.events import Event, State, StateChanged

QUESTION, END, ABORT = 1, 2, 5
"""Numbers of beeps for a question, for the end of a run, and for an abort or a failure."""

INTERVAL = 220
"""Time between two beeps [ms], long enough for the bell of a desktop to sound separately."""

GOOD = ("completed", "stopped")
"""Statuses of runs that did not end because of a fault."""


class Sounds(QObject):
    """Beeps with the bell of the desktop, which is silent without a sound device. `muted` disables it."""

    def __init__(self, controller: Controller, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.muted = False
        self._left = 0
        self._aborted = False
        self._timer = QTimer(self, interval=INTERVAL)
        self._timer.timeout.connect(self._beep)
        controller.began.connect(self._began)
        controller.question_changed.connect(self._asked)
        controller.event_received.connect(self._follow)
        controller.ended.connect(self._ended)

    def sound(self, beeps: int) -> None:
        """Begin a sequence of beeps. It replaces a sequence in progress only if fewer beeps of that one are left."""
        if self.muted or beeps <= self._left:
            return
        self._left = beeps
        if not self._timer.isActive():
            self._beep()
            self._timer.start()

    def _beep(self) -> None:
        if self.muted or not self._left:
            self._left = 0
            self._timer.stop()
            return
        self._left -= 1
        QApplication.beep()

    def _began(self) -> None:
        self._aborted = False

    def _asked(self, question: Question | None) -> None:
        if question is not None:
            self.sound(QUESTION)

    def _follow(self, event: Event) -> None:
        """Sound an abort when it begins, once in a run."""
        if isinstance(event, StateChanged) and event.after in (State.ABORTING, State.HALTED):
            self._abort()

    def _ended(self, ended: Ended | Refused) -> None:
        if isinstance(ended, Ended) and ended.status in GOOD:
            self.sound(END)
        else:
            self._abort()

    def _abort(self) -> None:
        if not self._aborted:
            self._aborted = True
            self.sound(ABORT)
