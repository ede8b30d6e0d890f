"""The header, always visible: state of the bench and STOP and, as the window size allows, times, step and inputs."""

from collections.abc import Callable
from typing import cast

from PySide6.QtCore import QEvent, QObject, QPoint, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent
from PySide6.QtWidgets import (
    QApplication,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from bench.app.display import texts
from bench.app.display.session_state import STALE
from bench.app.display.theme import Theme
from bench.app.display.typography import typeset
from bench.app.formatting import clock
from bench.app.gui.controller import DELIBERATE, Controller
from bench.app.gui.global_key import GlobalKey
from bench.app.gui.widgets import ElidingLabel, Lamp, give_key, set_level

KEY = Qt.Key.Key_F12


class StopButton(QPushButton):
    """The STOP button, which requests the end of the run; it is not the emergency stop, which is hardware."""

    def __init__(self, controller: Controller, parent: QWidget | None = None) -> None:
        super().__init__(texts.STOP, parent)
        self.setObjectName("stop")
        self.setAccessibleName(texts.STOP_NAME)
        self.setToolTip(f"{texts.STOP_TIP.format(after=DELIBERATE)}\n{texts.GUARD}")
        # `StopFilter` handles F12; without focus, the space bar cannot press the button by accident
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        # acts on press, not on release
        self.pressed.connect(controller.press_stop)

    def holds(self, place: QPoint) -> bool:
        """Whether a point of the screen is within the button, covered or not, while it is shown."""
        return self.isVisible() and self.rect().contains(self.mapFromGlobal(place))


class StopFilter(QObject):
    """Receives key and mouse events before every widget and dialog of the application. This is necessary because a
    shortcut does not receive the key while a modal dialog is open, and a press on `button` while a list is open would
    only close the list.
    """

    def __init__(self, controller: Controller, button: StopButton) -> None:
        super().__init__(controller)
        self._controller, self._button = controller, button

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: ARG002 - the signature is Qt's
        """Consume events meant for STOP; a key held down counts once."""
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
        # without an open list the button receives the press itself
        if popup is None or not self._button.holds(place) or popup.frameGeometry().contains(place):
            return False
        if event.button() is not Qt.MouseButton.LeftButton:
            return False
        self._controller.press_stop()
        popup.close()
        return True


HEIGHT, LOW = 96, 72
"""Height of the header, and its height in a small window [px]. Both are fixed, so that text never moves STOP."""
ROOMY, MEDIUM = (1150, 600), 700
"""Window size below which the header is low, and width below which a low header shows neither times nor lamp [px]."""


class Header(QWidget):
    """The header, updated by the controller's signals."""

    def __init__(self, controller: Controller, theme: Theme, toggle: Callable[[], None] = lambda: None) -> None:
        super().__init__()
        self._controller = controller
        self.lamp = Lamp(theme)
        self.word, self.reason = _label("word"), _label("faint")
        self.word.setAccessibleName(texts.NAMES["state"])
        self.reason.setWordWrap(True)
        self.inputs, self.step, self.owner = ElidingLabel(), ElidingLabel(), ElidingLabel()
        self.elapsed, self.remaining = _label("value"), _label("value")
        self.inputs.setToolTip(texts.INPUTS_TIP.format(stale=STALE))
        self.progress = QProgressBar(maximum=1000, textVisible=False)
        self.progress.setMaximumHeight(8)
        self.stop, self.clear = StopButton(controller), QPushButton(texts.CLEAR)
        self.clear.setObjectName("clear")
        self.clear.setToolTip(texts.CLEAR_TIP)
        # a key press meant for the form must not clear STOP
        self.clear.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        give_key(self.clear, "Ctrl+Shift+K")
        self.clear.clicked.connect(controller.clear_stop)
        self.attach = QPushButton()
        self.attach.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        give_key(self.attach, "Ctrl+Shift+A")
        self.attach.clicked.connect(toggle)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setObjectName("header")
        words = QVBoxLayout()
        words.addWidget(self.word)
        words.addWidget(self.reason)
        self.times = QWidget()
        times = QGridLayout(self.times)
        times.setContentsMargins(0, 0, 0, 0)
        for column, (name, value) in enumerate(((texts.ELAPSED, self.elapsed), (texts.REMAINING, self.remaining))):
            times.addWidget(_label("faint", name), 0, column)
            times.addWidget(value, 1, column)
            value.setMinimumWidth(110)
        self.details = QWidget()
        details = QGridLayout(self.details)
        details.setContentsMargins(0, 0, 0, 0)
        rows = ((texts.OWNER, self.owner), (texts.STEP, self.step), (texts.INPUTS, self.inputs))
        for row, (name, value) in enumerate(rows):
            details.addWidget(_label("faint", name), row, 0)
            details.addWidget(value, row, 1)
        details.addWidget(self.progress, len(rows), 0, 1, 2)
        details.setColumnStretch(1, 1)
        for part in (self.word, self.reason):
            # a long text is truncated, with the full text in the tooltip, so that it does not widen the header
            part.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        words.setSpacing(0)
        row = QHBoxLayout(self)
        row.setContentsMargins(6, 4, 6, 4)
        row.addWidget(self.lamp)
        row.addLayout(words, 3)
        row.addWidget(self.times)
        row.addWidget(self.details, 4)
        row.addWidget(self.attach)
        row.addWidget(self.clear)
        row.addWidget(self.stop)
        self.setFixedHeight(HEIGHT)
        controller.changed.connect(self.refresh)
        application().applicationStateChanged.connect(self.refresh)
        self.key = GlobalKey(self)
        self.key.pressed.connect(controller.press_stop)
        self.refresh()

    def fit(self, width: int, height: int) -> None:
        """Choose the layout for a window of this size [px]: a small window hides the details, and a narrow one
        also hides the times and the lamp.
        """
        low = width < ROOMY[0] or height < ROOMY[1]
        self.details.setVisible(not low)
        self.times.setVisible(not low or width >= MEDIUM)
        self.lamp.setVisible(not low or width >= MEDIUM)
        self.setFixedHeight(LOW if low else HEIGHT)
        for part in (self.stop, self.word):
            _set_property(part, "low", "yes" if low else "no")

    def refresh(self) -> None:
        """Show the current state."""
        controller, scene = self._controller, self._controller.session.scene
        shown = controller.status
        self.lamp.show_as(shown.shape, shown.level, on_red=controller.latched)
        self.word.setText(shown.word)
        set_level(self.word, shown.level)
        active = application().applicationState() == Qt.ApplicationState.ApplicationActive
        # while the window has the focus, `StopFilter` takes the key
        self.key.hold(wanted=controller.running and not active)
        key_acts = active or self.key.held
        # a header with details shows the step in a separate field
        reason = "" if shown.reason == scene.step and self.details.isVisibleTo(self) else shown.reason
        said = ([texts.STOPPED + "."] if controller.latched else []) + [typeset(reason)]
        if controller.session.attached is not None and controller.running:
            # the owner of the run has priority over the rest of the reason
            said.insert(0, controller.owner)
        if not key_acts:
            said.insert(0, texts.KEY_NEEDS_FOCUS)
        self.reason.setText(" ".join(said))
        self.reason.setToolTip(self.reason.text())
        _set_property(self, "latched", "yes" if controller.latched else "no")
        self.elapsed.setText(clock(controller.session.elapsed))
        self.remaining.setText(clock(scene.time_left if controller.running else float("nan")))
        now = (scene.step, scene.activity) if controller.running else ()
        step = " · ".join(typeset(part) for part in now if part)
        self.step.setText(step or "–")
        self.progress.setValue(round(1000 * scene.fraction))
        again = controller.cuts_next
        self.stop.setText(texts.STOP_AGAIN if again else texts.STOP if key_acts else texts.STOP_BY_MOUSE)
        self.clear.setVisible(controller.latched)
        self.clear.setEnabled(not again)
        self.clear.setToolTip(texts.CLEAR_BUSY if again else texts.CLEAR_TIP)
        self._show_inputs()
        self._show_owner()

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self.lamp.use_theme(theme)

    def _show_owner(self) -> None:
        controller = self._controller
        self.owner.setText(controller.owner or "–")
        attached = controller.session.attached is not None and controller.running
        self.attach.setVisible(attached or (controller.elsewhere is not None and not controller.running))
        self.attach.setText(texts.DETACH if attached else texts.ATTACH)
        self.attach.setToolTip(texts.DETACH_TIP if attached else texts.ATTACH_TIP)

    def _show_inputs(self) -> None:
        text, level = self._controller.session.inputs_line(running=self._controller.running)
        self.inputs.setText(text)
        set_level(self.inputs, level)


def application() -> QApplication:
    """The running application."""
    return cast(QApplication, QApplication.instance())


def _set_property(part: QWidget, name: str, value: str) -> None:
    """Set a property that the style sheet uses as a selector, and update the style of the widget and its children."""
    if part.property(name) != value:
        part.setProperty(name, value)
        for each in (part, *part.findChildren(QWidget)):
            each.style().unpolish(each)
            each.style().polish(each)


def _label(role: str, text: str = "") -> QLabel:
    label = QLabel(text)
    label.setProperty("role", role)
    return label
