"""Fault reports for the operator (event, reaction of the bench, next step), and the panel that shows them."""

import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from traceback import format_exception
from types import TracebackType

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QLabel, QPlainTextEdit, QPushButton, QVBoxLayout

from bench.app.gui import texts
from bench.app.gui.controller import Controller
from bench.app.gui.widgets import give_key, set_level, typeset
from bench.app.ipc.messages import Ended, Refused
from bench.app.run_display import Notice
from bench.guard.sensors import TIMING
from sim.errors import Cause, CauseCode

QUIET = ("completed", "stopped")
"""Endings that require no action."""


RUN_ENDED = "The run was {status}: {reason}."
DID = {
    "aborted": "The drive was ramped to zero fast, and the rig was stopped.",
    "halted": "The enable line was cut at once, without a ramp.",
    "failed": "The output was ramped to zero, or cut if the rig no longer responded.",
}
DID_NOTHING = "The table was not driven."
KEPT = "The data recorded until then are in {out}."
DID_REFUSE = "The run was not started: nothing was armed or written."
DID_NOT_START = "The rig was never armed; all devices were closed again."
DID_LOSE = (
    "The output is brought to zero whenever a session ends; if its process crashed, by the watchdog and the heartbeat "
    "where they are configured. The data recorded until then remain readable."
)
NOW_REFUSED = "Change the value named above, then check the plan again."
NOW_LOOK = (
    "Look at the bench: if the table moves, press the emergency stop. Then run the loop check on the Setup page before "
    "the next test."
)
NOW_LIMIT = (
    "A limit was exceeded ({subject}): inspect specimen and sensors before the next test. If they are in order, "
    "check the margins of the plan and reduce the motion."
)
NOW_LATE = (
    "The computer or the link to a device was too slow ({subject}); the motion was within its limits. "
    "Close other programs, check cables and network, then start again."
)
_NOW_DEVICE = (
    "Check power and cables of the device named above, then search for devices and run the loop check on the Setup "
    "page."
)
_NOW_DISK = (
    'Free disk space, or enter a folder on another disk in the field "Results in". `rockbench file info` describes '
    "the recorded file."
)
NOW = {
    "request": "Clear STOP in the bar at the top when the bench is safe. A new run starts from the beginning.",
    "client_lost": (
        "This window did not respond for some seconds. Close other programs, then start again. With the option "
        '"Continue without this window", a run continues in this case.'
    ),
    "declined": "Complete the task, or remove it from the plan, then start again.",
    "safety_input": (
        "Find the cause at the bench and reset the input there. In the next run, the header must show that it is good."
    ),
    "limit": NOW_LIMIT,
    "disk": _NOW_DISK,
    "data_file": _NOW_DISK,
    "memory": "Close other programs, or restart the computer, then start again.",
    "device_timeout": _NOW_DEVICE,
    "connection_lost": _NOW_DEVICE,
    "device_not_found": _NOW_DEVICE,
    "command_refused": _NOW_DEVICE,
}
"""Next step by code of the cause; NOW_LOOK for all other codes."""
OWN_TROUBLE = "An error in the window, not in the bench: {error}."
OWN_DID = "The run continues in its own process; this window may be incomplete."
OWN_NOW = "Reopen the window after the run, and report the details to the developers."


@dataclass(frozen=True)
class Trouble:
    """A fault report: event, reaction and next step; `details` are shown on request."""

    what: str
    did: str
    now: str
    details: str = ""


def trouble_of(ended: Ended | Refused, *, driven: bool) -> Trouble | None:
    """The fault report of a run, None if it ended without a fault. `driven` is whether the rig was armed in the run."""
    if isinstance(ended, Refused):
        return _of_refusal(ended, driven=driven)
    if ended.status in QUIET:
        return None
    did = DID[ended.status] if driven else DID_NOTHING
    what = RUN_ENDED.format(**vars(ended))
    return Trouble(what, f"{did} {KEPT.format(out=ended.out)}", advice(ended.cause))


def _of_refusal(refused: Refused, *, driven: bool) -> Trouble:
    if not refused.failed:
        now = NOW.get(refused.cause.code, NOW_REFUSED).format(subject=refused.cause.subject)
        return Trouble(refused.text, DID_REFUSE, now, refused.details)
    if driven:
        return Trouble(refused.text, DID_LOSE, NOW_LOOK, refused.details)
    return Trouble(refused.text, DID_NOT_START, advice(refused.cause), refused.details)


def advice(cause: Cause) -> str:
    """Next step for a cause, by its code."""
    if cause.code == CauseCode.LIMIT and cause.subject in TIMING:
        return NOW_LATE.format(subject=cause.subject)
    return NOW.get(cause.code, NOW_LOOK).format(subject=cause.subject)


class TroublePanel(QFrame):
    """Panel with the latest report; a new run hides it."""

    def __init__(self, controller: Controller) -> None:
        super().__init__()
        self.setObjectName("trouble")
        self._controller = controller
        self.title = QLabel(f"▲ {texts.TROUBLE}")
        set_level(self.title, "alarm")
        self.answers = tuple(QLabel(wordWrap=True) for _ in texts.TROUBLE_PARTS)
        self.details = QPlainTextEdit(readOnly=True)
        self.details.setAccessibleName(texts.NAMES["details"])
        self.details.setMaximumHeight(160)
        self.more, self.close_it = QPushButton(texts.TROUBLE_DETAILS), QPushButton(texts.TROUBLE_CLOSE)
        self.more.setCheckable(True)
        self._arrange()
        self.hide()
        self.more.toggled.connect(self.details.setVisible)
        self.close_it.clicked.connect(self.hide)
        controller.began.connect(self._begin)
        controller.ended.connect(self._end)

    def show_trouble(self, trouble: Trouble) -> None:
        message = (trouble.what, trouble.did, trouble.now)
        for label, text in zip(self.answers, message, strict=True):
            label.setText(typeset(text))
        self.details.setPlainText(trouble.details)
        self.more.setVisible(bool(trouble.details))
        self.more.setChecked(False)
        self.details.hide()
        self.show()

    def _begin(self) -> None:
        self.hide()

    def _end(self, ended: Ended | Refused) -> None:
        trouble = trouble_of(ended, driven=self._controller.driven)
        if trouble is not None:
            self.show_trouble(trouble)

    def _arrange(self) -> None:
        self.more.setToolTip(texts.TROUBLE_DETAILS_TIP)
        give_key(self.more, "Ctrl+Shift+I")
        self.close_it.setToolTip(texts.TROUBLE_CLOSE_TIP)
        give_key(self.close_it, "Ctrl+Shift+H")
        grid = QGridLayout()
        for row, (name, label) in enumerate(zip(texts.TROUBLE_PARTS, self.answers, strict=True)):
            part = QLabel(name)
            part.setProperty("role", "faint")
            grid.addWidget(part, row, 0, Qt.AlignmentFlag.AlignTop)
            grid.addWidget(label, row, 1)
            label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        grid.setColumnStretch(1, 1)
        buttons = QHBoxLayout()
        buttons.addWidget(self.title, 1)
        buttons.addWidget(self.more)
        buttons.addWidget(self.close_it)
        column = QVBoxLayout(self)
        column.addLayout(buttons)
        column.addLayout(grid)
        column.addWidget(self.details)


Kind = type[BaseException]


class OwnErrors(QObject):
    """Reports the uncaught errors of all threads, each error once, in the window's thread. An error is always logged;
    the panel shows it unless a report, which may concern the bench, is already shown.
    """

    _raised = Signal(object)

    def __init__(self, controller: Controller, panel: TroublePanel) -> None:
        super().__init__(controller)
        self._controller, self._panel = controller, panel
        self._reported = set[str]()
        self._raised.connect(self._report, Qt.ConnectionType.QueuedConnection)

    def install(self) -> Callable[[], None]:
        """Replace `sys.excepthook` and `threading.excepthook`; returns a function that restores them."""
        before, before_in_thread = sys.excepthook, threading.excepthook

        def hook(kind: Kind, error: BaseException, trace: TracebackType | None) -> None:
            before(kind, error, trace)
            self._raised.emit(error)

        def thread_hook(given: threading.ExceptHookArgs) -> None:
            before_in_thread(given)
            if given.exc_value is not None and not isinstance(given.exc_value, SystemExit):
                self._raised.emit(given.exc_value)

        sys.excepthook, threading.excepthook = hook, thread_hook

        def undo() -> None:
            sys.excepthook, threading.excepthook = before, before_in_thread

        return undo

    def _report(self, error: BaseException) -> None:
        message = f"{type(error).__name__}: {error}"
        if message in self._reported:
            return
        self._reported.add(message)
        text = texts.OWN_ERROR.format(error=message)
        self._controller.noticed.emit(Notice(self._controller.scene.time, "window", text, grave=True))
        if self._panel.isHidden():
            details = "".join(format_exception(error))
            what = OWN_TROUBLE.format(error=message)
            self._panel.show_trouble(Trouble(what, OWN_DID, OWN_NOW, details))
