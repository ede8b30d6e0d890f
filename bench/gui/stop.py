"""STOP: a button that never moves, is never disabled and never asks back, and a key that works from everywhere."""

from PySide6.QtCore import QEvent, QObject, QPoint, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent
from PySide6.QtWidgets import QApplication, QPushButton, QWidget

from bench.gui import texts
from bench.gui.controller import DELIBERATE, Controller

KEY = Qt.Key.Key_F12


class StopButton(QPushButton):
    """Asks for the end of the run; the emergency stop is hardware."""

    def __init__(self, controller: Controller, parent: QWidget | None = None) -> None:
        super().__init__(texts.STOP, parent)
        self.setObjectName("stop")
        self.setAccessibleName(texts.STOP_NAME)
        self.setToolTip(f"{texts.STOP_TIP.format(after=DELIBERATE)}\n{texts.GUARD}")
        # a key has its own way: a space bar must not press it by chance, and clicking must not move the focus
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        # at once, not when the finger leaves
        self.pressed.connect(controller.press_stop)

    def holds(self, place: QPoint) -> bool:
        """Whether a place on the screen is on the button, as far as it can be seen."""
        return self.isVisible() and self.rect().contains(self.mapFromGlobal(place))


class StopFilter(QObject):
    """Sees key and mouse before every widget and dialog of the application.

    A shortcut would not hear the key behind a modal dialog; and a press on `button` beside a list that is open would do
    no more than close the list.
    """

    def __init__(self, controller: Controller, button: StopButton) -> None:
        super().__init__(controller)
        self._controller, self._button = controller, button

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: ARG002 - the signature is Qt's
        """Take what is meant for STOP; a key that is held down counts once."""
        if isinstance(event, QKeyEvent) and event.key() == KEY:
            return self._take_key(event)
        if isinstance(event, QMouseEvent) and event.type() == QEvent.Type.MouseButtonPress:
            return self._take_press(event)
        return False

    def _take_key(self, event: QKeyEvent) -> bool:
        if event.type() == QEvent.Type.KeyPress:
            if not event.isAutoRepeat():
                self._controller.press_stop()
            return True
        # a focused widget could otherwise claim the key as its own shortcut
        if event.type() == QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        return False

    def _take_press(self, event: QMouseEvent) -> bool:
        popup, place = QApplication.activePopupWidget(), event.globalPosition().toPoint()
        # without a list that is open the button hears of it itself
        if popup is None or not self._button.holds(place) or popup.frameGeometry().contains(place):
            return False
        if event.button() is not Qt.MouseButton.LeftButton:
            return False
        self._controller.press_stop()
        popup.close()
        return True
