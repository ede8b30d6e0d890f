"""Picture of the specimen: table, frame, spring and block to scale, with magnified motion."""

from dataclasses import dataclass, replace
from math import cos, isfinite, sin

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPaintEvent, QPen, QPolygonF, QWheelEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSpinBox, QVBoxLayout, QWidget

from bench.app.gui import texts
from bench.app.gui.palette import Theme
from bench.app.gui.status import Arrangement
from bench.app.gui.widgets import ElidingLabel
from bench.app.ipc.messages import TRACES
from sim.block_face import displacement, rotation
from sim.specimen import Specimen

COILS, STEEPEST = 9, 1.4
"""Number of turns of the spring; largest drawn angle [rad]."""
FLASH = 0.15
"""Time for which an impact is displayed [s]."""


@dataclass(frozen=True)
class Pose:
    """Drawn displacements [m] of the table and of the storeys relative to it; the block's angle [rad], None if unknown;
    time since its last impact [s].
    """

    ground: float = 0.0
    first: float = 0.0
    second: float = 0.0
    angle: float | None = None
    struck: float = float("inf")


class Drawing:
    """Maps specimen coordinates [m] to `area` [px]; the ground is its lower edge."""

    def __init__(self, painter: QPainter, theme: Theme, specimen: Specimen, area: QRectF) -> None:
        self._painter, self._theme, self._specimen = painter, theme, specimen
        frame, block = specimen.frame, specimen.block
        self._scale = (area.height() - 14) / (1.1 * max(frame.h2, 2.0 * block.h_b))
        self._middle, self._base = area.center().x(), area.bottom()
        self._half = 0.35 * frame.h1 + 0.05
        self._left = -self._half - 0.5 * specimen.d
        self._right = self._left + self._half + specimen.d + block.b
        """Centres of the frame and of the block at rest."""

    def at(self, x: float, y: float) -> QPointF:
        """Convert a position in metres to screen coordinates."""
        return QPointF(self._middle + self._scale * x, self._base - self._scale * y)

    def draw_frame(self, pose: Pose) -> None:
        """Draw the table, the columns and the two storeys."""
        frame, block, painter, half = self._specimen.frame, self._specimen.block, self._painter, self._half
        places = ((0.0, 0.0), (pose.first, frame.h1), (pose.second, frame.h2))
        left = self._left + pose.ground
        painter.setPen(self._pen(self._theme.text, 2))
        begin, end = left - 1.6 * half, self._right + pose.ground + 2.0 * block.b
        painter.drawLine(self.at(begin, 0.0), self.at(end, 0.0))
        for side in (-half, half):
            painter.drawPolyline(QPolygonF([self.at(left + side + x, y) for x, y in places]))
        painter.setPen(self._pen(self._theme.lines[1], 6))
        for x, y in places[1:]:
            painter.drawLine(self.at(left - half + x, y), self.at(left + half + x, y))

    def draw_block(self, pose: Pose, *, spring: bool = True, face: float | None = None) -> None:
        """Draw the block on its corner, the spring if there is one, and the beam of laser 2 if it measures the block at
        height `face` [m]. An unknown angle is drawn dashed and upright.
        """
        block, height, painter = self._specimen.block, self._specimen.frame.h1, self._painter
        middle, angle = self._right + pose.ground, max(min(pose.angle or 0.0, STEEPEST), -STEEPEST)
        corner = middle - block.b if angle > 0.0 else middle + block.b

        def turned(x: float, y: float) -> tuple[float, float]:
            """Position of a point of the rotated block. A positive angle is a rotation about the left corner, with the
            top towards the frame.
            """
            x -= corner
            return corner + x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle)

        left, right, top = middle - block.b, middle + block.b, 2.0 * block.h_b
        begin, end = self._left + self._half + pose.ground + pose.first, turned(left, height)
        if spring:
            self._draw_spring((begin, height), end)
        if face is not None:
            painter.setPen(QPen(QColor(self._theme.alarm), 1, Qt.PenStyle.DashLine))
            painter.drawLine(self.at(self._left + self._half + pose.ground, face), self.at(turned(left, face)[0], face))
        outline = QPen(QColor(self._theme.text), 2)
        if pose.angle is not None:
            painter.setBrush(QColor(self._theme.faint))
        else:
            outline.setDashPattern([4, 3])
        painter.setPen(outline)
        painter.drawPolygon(
            QPolygonF([self.at(*turned(x, y)) for x, y in ((left, 0.0), (right, 0.0), (right, top), (left, top))])
        )
        painter.setBrush(QColor(0, 0, 0, 0))
        if pose.angle is not None:
            self._draw_contact((left, right) if angle == 0.0 else (corner,), pose.struck)

    def _draw_spring(self, begin: tuple[float, float], end: tuple[float, float]) -> None:
        (x, y), (along, up) = begin, (end[0] - begin[0], end[1] - begin[1])
        shares = [(k + 0.5) / COILS for k in range(COILS)]
        coils = [
            self.at(x + along * share, y + up * share + (0.012 if k % 2 else -0.012)) for k, share in enumerate(shares)
        ]
        self._painter.setPen(self._pen(self._theme.lines[2], 2))
        self._painter.drawPolyline(QPolygonF([self.at(*begin), *coils, self.at(*end)]))

    def _draw_contact(self, corners: tuple[float, ...], struck: float) -> None:
        """Draw a triangle under each supporting corner, and rays at the corner of a recent impact."""
        painter = self._painter
        painter.setPen(self._pen(self._theme.good, 1))
        painter.setBrush(QColor(self._theme.good))
        for x in corners:
            foot = self.at(x, 0.0)
            shape = [foot, foot + QPointF(-6, 10), foot + QPointF(6, 10)]
            painter.drawPolygon(QPolygonF(shape))
        painter.setBrush(QColor(0, 0, 0, 0))
        if isfinite(struck) and struck < FLASH:
            painter.setPen(self._pen(self._theme.alarm, 3))
            for x in corners:
                foot = self.at(x, 0.0)
                for along, up in ((-1.0, 0.15), (-0.7, 0.7), (0.7, 0.7), (1.0, 0.15)):
                    painter.drawLine(foot + QPointF(10 * along, -10 * up), foot + QPointF(22 * along, -22 * up))

    def _pen(self, colour: str, width: int) -> QPen:
        return QPen(QColor(colour), width)


X_G, U_1, U_2 = (TRACES.index(name) for name in ("displacement", "u1", "u2"))
FACTOR, LARGEST = 5, 50
"""Magnification of the motion relative to the frame: initial and largest."""
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
        self._angle: float | None = None
        self._struck = float("inf")
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
        self.show_arrangement(Arrangement())
        self.move_to(np.zeros(len(TRACES)), None)
        self.canvas.update()

    def show_arrangement(self, arrangement: Arrangement) -> None:
        """Show this arrangement of specimen and lasers."""
        self.canvas.arrangement = replace(arrangement)
        self.canvas.update()

    def move_to(self, motion: NDArray[np.float64], block: tuple[float, float] | None) -> None:
        """Show one instant: the signals `bench.app.ipc.messages.TRACES`, and the block's angle [rad] and time since its
        last impact [s], None if unknown.
        """
        self._motion = np.nan_to_num(motion)
        self._angle, self._struck = block or (None, float("inf"))
        arrangement, rest = self.canvas.arrangement, self.canvas.specimen.block
        if arrangement.face is not None:
            # laser 2 measures the block, not storey 2
            zero = float(displacement(arrangement.tilt, arrangement.face, rest))
            angle = float(rotation(zero + self._motion[U_2], arrangement.face, rest))
            self._angle, self._struck = angle if np.isfinite(angle) else None, float("inf")
            self._motion[U_2] = self._motion[U_1]
        self._draw()

    def show_age(self, seconds: float | None) -> None:
        """Label the picture with the number of seconds for which it has not been live; None while it is live."""
        self._age = seconds
        self._draw()

    def _draw(self) -> None:
        factor = self.factor.value()
        ground, first, second = (factor * float(self._motion[k]) for k in (X_G, U_1, U_2))
        pose = Pose(ground, first, second, None if self._angle is None else factor * self._angle, self._struck)
        if pose != self.canvas.pose:
            self.canvas.pose = pose
            self.canvas.update()
        arrangement = self.canvas.arrangement
        if arrangement.face is not None:
            text = texts.BLOCK_BY_LASER.format(height=1e3 * arrangement.face)
        elif not arrangement.block:
            text = texts.FRAME
        else:
            text = texts.FRAME_AND_BLOCK if self._angle is not None else texts.FRAME_ONLY
        age = "" if self._age is None else f" ({texts.NOT_LIVE.format(age=self._age)})"
        self.source.setText(text + age)


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
        drawing = Drawing(painter, self.theme, self.specimen, QRectF(0, 0, self.width(), self.height() - BELOW))
        drawing.draw_frame(self.pose)
        if self.arrangement.block:
            drawing.draw_block(self.pose, spring=self.arrangement.spring, face=self.arrangement.face)
        if self.hasFocus():
            painter.setPen(Qt.PenStyle.DotLine)
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
