"""Panel that shows fault reports, and reporting of uncaught errors in the window's own code."""

import sys
import threading
from collections.abc import Callable
from traceback import format_exception
from types import TracebackType

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QLabel, QPlainTextEdit, QPushButton, QVBoxLayout

from bench.app.display import texts
from bench.app.display.trouble import Trouble, trouble_of
from bench.app.display.typography import typeset
from bench.app.gui.controller import Controller
from bench.app.gui.widgets import give_key, set_level
from bench.app.ipc.messages import Ended, Refused
from bench.app.run_display import Notice

OWN_TROUBLE = "An error in the window, not in the bench: {error}."
OWN_DID = "The run continues in its own process; this window may be incomplete."
OWN_NOW = "Reopen the window after the run, and report the details to the developers."


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
        trouble = trouble_of(ended, driven=self._controller.session.driven)
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
        self._controller.noticed.emit(Notice(self._controller.session.scene.time, "window", text, grave=True))
        if self._panel.isHidden():
            details = "".join(format_exception(error))
            what = OWN_TROUBLE.format(error=message)
            self._panel.show_trouble(Trouble(what, OWN_DID, OWN_NOW, details))
