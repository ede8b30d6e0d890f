"""The picture of the specimen, drawn with Qt."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPaintEvent, QPen, QPolygonF, QWheelEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSpinBox, QVBoxLayout, QWidget

from bench.app.display import texts
from bench.app.display.picture import FACTOR, Outline, Pose, Shape, pose_of, source
from bench.app.display.status import Arrangement
from bench.app.display.theme import Theme
from bench.app.gui.widgets import ElidingLabel
from bench.app.ipc.messages import TRACES
from sim.specimen import Specimen

RAYS = ((-1.0, 0.15), (-0.7, 0.7), (0.7, 0.7), (1.0, 0.15))
"""Directions of the rays at an impact."""


class Drawing:
    """Paints shapes in `area` [px], whose lower edge is the level of the table."""

    def __init__(self, painter: QPainter, theme: Theme, outline: Outline, area: QRectF) -> None:
        self._painter, self._theme = painter, theme
        self._scale = (area.height() - 14) / outline.height
        self._middle, self._base = area.center().x(), area.bottom()

    def paint(self, shape: Shape) -> None:
        """Paint one shape."""
        painter, theme = self._painter, self._theme
        places = [QPointF(self._middle + self._scale * x, self._base - self._scale * y) for x, y in shape.points]
        painter.setBrush(QColor(0, 0, 0, 0))
        match shape.role:
            case "contact":
                painter.setPen(QPen(QColor(theme.good), 1))
                painter.setBrush(QColor(theme.good))
                painter.drawPolygon(QPolygonF([places[0], places[0] + QPointF(-6, 10), places[0] + QPointF(6, 10)]))
            case "impact":
                painter.setPen(QPen(QColor(theme.alarm), 3))
                for x, y in RAYS:
                    painter.drawLine(places[0] + QPointF(10 * x, -10 * y), places[0] + QPointF(22 * x, -22 * y))
            case "block" | "unknown":
                pen = QPen(QColor(theme.text), 2)
                if shape.role == "block":
                    painter.setBrush(QColor(theme.faint))
                else:
                    pen.setDashPattern([4, 3])
                painter.setPen(pen)
                painter.drawPolygon(QPolygonF(places))
            case "beam":
                painter.setPen(QPen(QColor(theme.alarm), 1, Qt.PenStyle.DashLine))
                painter.drawPolyline(QPolygonF(places))
            case "storey":
                painter.setPen(QPen(QColor(theme.lines[1]), 6))
                painter.drawPolyline(QPolygonF(places))
            case "spring":
                painter.setPen(QPen(QColor(theme.lines[2]), 2))
                painter.drawPolyline(QPolygonF(places))
            case "table" | "column":
                painter.setPen(QPen(QColor(theme.text), 2))
                painter.drawPolyline(QPolygonF(places))


LARGEST = 50
"""Largest magnification of the motion."""
BELOW = 12
"""Space under the table for the contact marks [px]."""
LARGER, SMALLER = (Qt.Key.Key_Plus, Qt.Key.Key_Equal, Qt.Key.Key_Up), (Qt.Key.Key_Minus, Qt.Key.Key_Down)


class PhysicalPicture(QWidget):
    """Picture drawn from the measured displacements of table and storeys, and from the model's angle of the block, if
    available.
    """

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.canvas = _Canvas(theme)
        self.factor = QSpinBox(minimum=1, maximum=LARGEST, value=FACTOR, prefix="× ")
        self.factor.setAccessibleName(texts.FACTOR)
        self.factor.setToolTip(texts.FACTOR_TIP)
        self.source = ElidingLabel(texts.FRAME)
        self.canvas.factor = self.factor
        self.factor.valueChanged.connect(self._draw)
        row = QHBoxLayout()
        row.addWidget(self.source, 1)
        row.addWidget(QLabel(texts.FACTOR))
        row.addWidget(self.factor)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.canvas, 1)
        column.addLayout(row)
        self._motion = np.zeros(len(TRACES))
        self._block: tuple[float, float] | None = None
        self._age: float | None = None

    @property
    def pose(self) -> Pose:
        return self.canvas.pose

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self.canvas.theme = theme
        self.canvas.update()

    def use(self, specimen: Specimen) -> None:
        """Draw another specimen, at rest."""
        self.canvas.specimen = specimen
        self.show_arrangement(Arrangement.of(specimen))
        self.move_to(np.zeros(len(TRACES)), None)
        self.canvas.update()

    def show_arrangement(self, arrangement: Arrangement) -> None:
        """Show this arrangement of specimen and lasers."""
        self.canvas.arrangement = replace(arrangement)
        self.canvas.update()

    def move_to(self, motion: NDArray[np.float64], block: tuple[float, float] | None) -> None:
        """Show one instant.

        motion : signals `bench.app.ipc.messages.TRACES` in SI units, shape (n_signals,).
        block : angle of the block [rad] and time since its last impact [s]; None if unknown.
        """
        self._motion, self._block = motion, block
        self._draw()

    def show_age(self, seconds: float | None) -> None:
        """Label the picture with the number of seconds for which it has not been live; None while it is live."""
        self._age = seconds
        self._draw()

    def _draw(self) -> None:
        canvas = self.canvas
        pose = pose_of(self._motion, self._block, canvas.arrangement, canvas.specimen, self.factor.value())
        if pose != canvas.pose:
            canvas.pose = pose
            canvas.update()
        age = "" if self._age is None else f" ({texts.NOT_LIVE.format(age=self._age)})"
        self.source.setText(source(canvas.arrangement, pose) + age)


class _Canvas(QWidget):
    """Drawing area; wheel, + and - change the magnification."""

    factor: QSpinBox

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.theme, self.specimen, self.pose = theme, Specimen(), Pose()
        self.arrangement = Arrangement()
        self.setMinimumHeight(120)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(texts.NAMES["picture"])
        self.setToolTip(texts.FACTOR_TIP)

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002 - the signature is Qt's
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        outline = Outline(self.specimen)
        drawing = Drawing(painter, self.theme, outline, QRectF(0, 0, self.width(), self.height() - BELOW))
        for shape in outline.shapes(self.pose, self.arrangement):
            drawing.paint(shape)
        if self.hasFocus():
            painter.setPen(Qt.PenStyle.DotLine)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(self.rect().adjusted(0, 0, -1, -1))
        painter.end()

    def wheelEvent(self, event: QWheelEvent) -> None:
        self.factor.stepBy(1 if event.angleDelta().y() > 0 else -1)
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (*LARGER, *SMALLER):
            self.factor.stepBy(1 if event.key() in LARGER else -1)
        else:
            super().keyPressEvent(event)
