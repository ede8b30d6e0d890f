"""Errors of the window itself: told in it, and no end of anything."""

import sys
import threading
from collections.abc import Callable
from traceback import format_exception
from types import TracebackType

from PySide6.QtCore import QObject, Qt, Signal

from bench.cli.scene import Notice
from bench.gui import texts
from bench.gui.controller import Controller
from bench.gui.trouble import TroublePanel
from bench.gui.troubles import Trouble

Kind = type[BaseException]


class OwnErrors(QObject):
    """Stands in for `sys.excepthook` and that of the threads, from `install` until what it returns is called.

    An error may come from any thread: it is told in the thread of the window. The same error is told once. What is
    wrong at the bench goes before it: a trouble that stands is not replaced, the log has the error all the same.
    """

    _raised = Signal(object)

    def __init__(self, controller: Controller, panel: TroublePanel) -> None:
        super().__init__(controller)
        self._controller, self._panel = controller, panel
        self._told = set[str]()
        self._raised.connect(self._tell, Qt.ConnectionType.QueuedConnection)

    def install(self) -> Callable[[], None]:
        """Hear of every error from now on; returns what undoes it."""
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

    def _tell(self, error: BaseException) -> None:
        said = f"{type(error).__name__}: {error}"
        if said in self._told:
            return
        self._told.add(said)
        text = texts.OWN_ERROR.format(error=said)
        self._controller.noticed.emit(Notice(self._controller.scene.time, "window", text, grave=True))
        if self._panel.isHidden():
            details = "".join(format_exception(error))
            what = texts.OWN_TROUBLE.format(error=said)
            self._panel.show_trouble(Trouble(what, texts.OWN_DID, texts.OWN_NOW, details))
