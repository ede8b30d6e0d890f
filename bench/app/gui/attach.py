"""Detection of runs started by other windows and terminals on this computer, and attachment to them."""

from PySide6.QtCore import QObject, QTimer

from bench.app.gui.controller import Controller
from bench.app.ipc.sessions import running_sessions

PERIOD = 1000
"""Interval between searches for sessions [ms]."""


class SessionWatch(QObject):
    """Searches for sessions while the window has no run. The first search also attaches the window to a session under
    way, if any.
    """

    def __init__(self, controller: Controller, parent: QObject) -> None:
        super().__init__(parent)
        self._controller = controller
        self._timer = QTimer(self, interval=PERIOD)
        self._timer.timeout.connect(self.look)
        self._timer.start()
        # the window must exist before it shows a run
        QTimer.singleShot(0, self, self._attach_at_once)

    def look(self) -> None:
        """Update `controller.elsewhere`, the session of another window or terminal."""
        controller = self._controller
        if controller.running:
            return
        found = next(iter(running_sessions()), None)
        if found != controller.elsewhere:
            controller.elsewhere = found
            controller.changed.emit()

    def toggle(self) -> None:
        """Attach to the session under way elsewhere, or detach from the attached session."""
        if self._controller.session.attached is not None and self._controller.running:
            self._controller.detach()
            self.look()
        elif self._controller.elsewhere is not None:
            self._controller.attach(self._controller.elsewhere)

    def _attach_at_once(self) -> None:
        self.look()
        if self._controller.elsewhere is not None and not self._controller.running:
            self.toggle()
