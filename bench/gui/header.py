"""What is always visible: the state of the bench, its safety inputs, the time, the step, and STOP."""

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QProgressBar, QSizePolicy, QVBoxLayout, QWidget

from bench.cli.words import clock
from bench.gui import texts
from bench.gui.controller import Controller
from bench.gui.palette import Theme
from bench.gui.standing import Shape
from bench.gui.stop import StopButton

STALE = 2.0
"""Safety inputs that were heard of longer ago are unknown [s]."""
SIDE, HEIGHT = 56, 136
"""Side of the shape, and height of the header [px]: STOP stays where it is whatever the header says."""


def set_level(label: QLabel, level: str) -> None:
    """Give a label the look of a level; Qt reads a property again only when told to."""
    if label.property("level") != level:
        label.setProperty("level", level)
        label.style().unpolish(label)
        label.style().polish(label)


class Lamp(QWidget):
    """A shape in a colour: each state has its own of both."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self.shape: Shape = "ring"
        self._level = "calm"
        self.setFixedSize(SIDE, SIDE)

    def show_as(self, shape: Shape, level: str) -> None:
        """Change shape and colour."""
        if (shape, level) != (self.shape, self._level):
            self.shape, self._level = shape, level
            self.update()

    def use_theme(self, theme: Theme) -> None:
        """Take the colours of another theme."""
        self._theme = theme
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002 - the signature is Qt's
        """Draw the shape."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colour = QColor(str(getattr(self._theme, self._level)))
        painter.setPen(QPen(colour, 6))
        painter.setBrush(colour if self.shape not in ("ring", "cross") else Qt.BrushStyle.NoBrush)
        box = QRectF(6, 6, SIDE - 12, SIDE - 12)
        if self.shape in ("ring", "disc"):
            painter.drawEllipse(box)
        elif self.shape == "cross":
            painter.drawLine(box.topLeft(), box.bottomRight())
            painter.drawLine(box.topRight(), box.bottomLeft())
        else:
            painter.drawPolygon(_corners(self.shape, box))
        painter.end()


def _corners(shape: Shape, box: QRectF) -> QPolygonF:
    if shape == "octagon":
        places = ((0.3, 0), (0.7, 0), (1, 0.3), (1, 0.7), (0.7, 1), (0.3, 1), (0, 0.7), (0, 0.3))
    elif shape == "triangle":
        places = ((0.5, 0), (1, 1), (0, 1))
    else:
        places = ((0, 0), (1, 0), (1, 1), (0, 1))
    return QPolygonF([QPointF(box.x() + x * box.width(), box.y() + y * box.height()) for x, y in places])


class Header(QWidget):
    """Follows the controller."""

    def __init__(self, controller: Controller, theme: Theme) -> None:
        super().__init__()
        self._controller = controller
        self.lamp = Lamp(theme)
        self.word, self.reason = _label("word"), _label("faint")
        self.word.setAccessibleName(texts.NAMES["state"])
        self.reason.setWordWrap(True)
        self.inputs, self.step = _label(""), _label("")
        self.elapsed, self.remaining = _label("value"), _label("value")
        self.inputs.setToolTip(texts.INPUTS_TIP.format(stale=STALE))
        self.progress = QProgressBar(maximum=1000, textVisible=False)
        self.progress.setMaximumHeight(8)
        self.stop = StopButton(controller)
        words = QVBoxLayout()
        words.addWidget(self.word)
        words.addWidget(self.reason)
        times = QGridLayout()
        for column, (name, value) in enumerate(((texts.ELAPSED, self.elapsed), (texts.REMAINING, self.remaining))):
            times.addWidget(_label("faint", name), 0, column)
            times.addWidget(value, 1, column)
            value.setMinimumWidth(110)
        details = QGridLayout()
        for row, (name, value) in enumerate(((texts.STEP, self.step), (texts.INPUTS, self.inputs))):
            details.addWidget(_label("faint", name), row, 0)
            details.addWidget(value, row, 1)
            value.setWordWrap(True)
            # a long text is shortened by its place, never the place widened by the text
            value.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        details.addWidget(self.progress, 2, 0, 1, 2)
        details.setColumnStretch(1, 1)
        self.setFixedHeight(HEIGHT)
        row = QHBoxLayout(self)
        row.addWidget(self.lamp)
        row.addLayout(words, 3)
        row.addLayout(times)
        row.addLayout(details, 4)
        row.addWidget(self.stop)
        controller.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show what is known now."""
        controller, scene = self._controller, self._controller.scene
        shown = controller.standing
        self.lamp.show_as(shown.shape, shown.level)
        self.word.setText(shown.word)
        set_level(self.word, shown.level)
        self.reason.setText(f"{texts.LATCHED}. {shown.reason}" if controller.latched else shown.reason)
        self.elapsed.setText(clock(controller.elapsed))
        self.remaining.setText(clock(scene.remaining if controller.running else float("nan")))
        self.step.setText(" · ".join(part for part in (scene.step, scene.activity) if part) or "–")
        self.progress.setValue(round(1000 * scene.fraction))
        self.stop.setText(texts.STOP_AGAIN if controller.latched and controller.running else texts.STOP)
        self._show_inputs()

    def use_theme(self, theme: Theme) -> None:
        """Take the colours of another theme."""
        self.lamp.use_theme(theme)

    def _show_inputs(self) -> None:
        """As they were read within the last seconds; what is older is not known, whatever it was."""
        controller = self._controller
        age, wired = controller.inputs_age, controller.inputs
        known = age is not None and age <= STALE
        if not controller.running:
            text = texts.INPUTS_UNREAD
        elif age is not None and not wired:
            text = texts.NO_INPUTS
        elif known:
            words = (texts.INPUT_OPEN, texts.INPUT_GOOD)
            text = ", ".join(f"{name} {words[good]}" for name, good in wired.items())
        else:
            text = ", ".join(f"{name} {texts.INPUT_UNKNOWN}" for name in wired) or texts.INPUT_UNKNOWN
        self.inputs.setText(text)
        unknown = controller.running and not known and (bool(wired) or age is None)
        set_level(self.inputs, "wait" if unknown else "calm" if all(wired.values()) or not known else "alarm")


def _label(role: str, text: str = "") -> QLabel:
    label = QLabel(text)
    label.setProperty("role", role)
    return label
