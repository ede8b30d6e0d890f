"""Draws table, frame, spring and block with a painter, in metres."""

from dataclasses import dataclass
from math import cos, isfinite, sin

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from bench.gui.palette import Theme
from sim.specimen import Specimen

COILS, STEEPEST = 9, 1.4
"""Turns of the spring; largest angle that is drawn [rad]."""
FLASH = 0.15
"""How long an impact is seen [s]."""


@dataclass(frozen=True)
class Pose:
    """Displacements [m] as they are drawn: table, and storeys relative to it; the block's angle [rad], None where it is
    not known, and the seconds since its last impact.
    """

    ground: float = 0.0
    first: float = 0.0
    second: float = 0.0
    angle: float | None = None
    struck: float = float("inf")


class Drawing:
    """Places metres of the specimen on `area` [px]; the ground is its lower edge."""

    def __init__(self, painter: QPainter, theme: Theme, specimen: Specimen, area: QRectF) -> None:
        self._painter, self._theme, self._specimen = painter, theme, specimen
        frame, block = specimen.frame, specimen.block
        self._scale = (area.height() - 14) / (1.1 * max(frame.h2, 2.0 * block.h_b))
        self._middle, self._base = area.center().x(), area.bottom()
        self._half = 0.35 * frame.h1 + 0.05
        self._left = -self._half - 0.5 * specimen.d
        self._right = self._left + self._half + specimen.d + block.b
        """Middles of the frame and of the block at rest."""

    def at(self, x: float, y: float) -> QPointF:
        """A place in metres as one on the screen."""
        return QPointF(self._middle + self._scale * x, self._base - self._scale * y)

    def draw_frame(self, pose: Pose) -> None:
        """The table, and on it the columns and the two storeys."""
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

    def draw_block(self, pose: Pose) -> None:
        """The block on its corner, and the spring to it. An angle that is not known is drawn dashed and upright."""
        block, height, painter = self._specimen.block, self._specimen.frame.h1, self._painter
        middle, angle = self._right + pose.ground, max(min(pose.angle or 0.0, STEEPEST), -STEEPEST)
        corner = middle - block.b if angle > 0.0 else middle + block.b

        def turned(x: float, y: float) -> tuple[float, float]:
            """theta > 0 turns about the left corner, the top towards the frame."""
            x -= corner
            return corner + x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle)

        left, right, top = middle - block.b, middle + block.b, 2.0 * block.h_b
        begin, end = self._left + self._half + pose.ground + pose.first, turned(left, height)
        self._draw_spring((begin, height), end)
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
        """A triangle under each corner that stands; a burst of rays from the corner that has just come down."""
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
