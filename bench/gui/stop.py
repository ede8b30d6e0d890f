"""STOP: a button that never moves, is never disabled and never asks back, and a key that works from everywhere."""

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QPushButton, QWidget

from bench.gui import texts
from bench.gui.controller import Controller

KEY = Qt.Key.Key_F12


class StopButton(QPushButton):
    """Asks for the end of the run; the emergency stop is hardware."""

    def __init__(self, controller: Controller, parent: QWidget | None = None) -> None:
        super().__init__(texts.STOP, parent)
        self.setObjectName("stop")
        self.setAccessibleName("STOP")
        self.setToolTip(f"{texts.STOP_TIP}\n{texts.GUARD}")
        # the key has its own way: a space bar must not press it by chance, and clicking must not move the focus
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        # at once, not when the finger leaves
        self.pressed.connect(controller.press_stop)


class StopKey(QObject):
    """Sees the key before every widget and dialog of the application; a shortcut would not behind a modal one."""

    def __init__(self, controller: Controller) -> None:
        super().__init__(controller)
        self._controller = controller

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: ARG002 - the signature is Qt's
        """Take the key; a key that is held down counts once."""
        if isinstance(event, QKeyEvent) and event.key() == KEY:
            if event.type() == QEvent.Type.KeyPress:
                if not event.isAutoRepeat():
                    self._controller.press_stop()
                return True
            # a focused widget could otherwise claim the key as its own shortcut
            if event.type() == QEvent.Type.ShortcutOverride:
                event.accept()
                return True
        return False
