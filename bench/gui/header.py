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
        self._colour = theme.calm
        self.setFixedSize(SIDE, SIDE)

    def show_as(self, shape: Shape, level: str) -> None:
        """Change shape and colour."""
        colour = str(getattr(self._theme, level))
        if (shape, colour) != (self.shape, self._colour):
            self.shape, self._colour = shape, colour
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002 - the signature is Qt's
        """Draw the shape."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colour = QColor(self._colour)
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
        self.word.setAccessibleName("state of the bench")
        self.reason.setWordWrap(True)
        self.inputs, self.step = _label(""), _label("")
        self.elapsed, self.remaining = _label("value"), _label("value")
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
        good = [f"{name} {texts.INPUT_GOOD if ok else texts.INPUT_OPEN}" for name, ok in controller.inputs.items()]
        self.inputs.setText(", ".join(good) or texts.NO_INPUTS)
        set_level(self.inputs, "calm" if all(controller.inputs.values()) else "alarm")


def _label(role: str, text: str = "") -> QLabel:
    label = QLabel(text)
    label.setProperty("role", role)
    return label
