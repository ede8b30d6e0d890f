"""The physical picture: table, frame, spring and block to scale, their motion drawn larger."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from bench.gui import texts
from bench.gui.palette import Theme
from bench.link.reduction import TRACES
from sim.specimen import Specimen

X_G, U_1, U_2 = (TRACES.index(name) for name in ("displacement", "u1", "u2"))
FACTOR = 5.0
"""How many times as large as the frame the motion is drawn."""
COILS = 9


class PhysicalPicture(QWidget):
    """Drawn from the last measured table displacement and storeys; the block is upright: no sensor watches it."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme, self._specimen = theme, Specimen()
        self.motion: NDArray[np.float64] = np.zeros(len(TRACES))
        self.coupled = False
        """Whether spring and block are mounted."""
        self.setMinimumHeight(150)
        self.setAccessibleName("picture of the specimen")
        self.setToolTip(texts.FRAME.format(factor=FACTOR))

    def use(self, specimen: Specimen) -> None:
        """Draw this specimen from now on."""
        self._specimen = specimen
        self.motion = np.zeros(len(TRACES))
        self.update()

    def move_to(self, motion: NDArray[np.float64]) -> None:
        """Show the signals `bench.link.reduction.TRACES` of one moment."""
        if not np.array_equal(motion, self.motion):
            self.motion = np.nan_to_num(motion)
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002 - the signature is Qt's
        """Draw everything, in metres."""
        frame, block = self._specimen.frame, self._specimen.block
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        caption = 22
        scale = (self.height() - caption - 14) / (1.1 * max(frame.h2, 2.0 * block.h_b))
        base, middle = self.height() - caption, 0.5 * self.width()

        def at(x: float, y: float) -> QPointF:
            return QPointF(middle + scale * x, base - scale * y)

        ground = FACTOR * float(self.motion[X_G])
        first, second = (ground + FACTOR * float(self.motion[k]) for k in (U_1, U_2))
        half = 0.35 * frame.h1 + 0.05
        left = -half - 0.5 * self._specimen.d
        right = left + half + self._specimen.d + block.b
        pen = QPen(QColor(self._theme.text), 2)
        painter.setPen(pen)
        painter.drawLine(at(left - 1.6 * half + ground, 0), at(right + 2 * block.b + ground, 0))
        for side in (-half, half):
            painter.drawPolyline(
                QPolygonF([at(left + side + x, y) for x, y in ((ground, 0), (first, frame.h1), (second, frame.h2))])
            )
        painter.setPen(QPen(QColor(self._theme.lines[1]), 6))
        for x, y in ((first, frame.h1), (second, frame.h2)):
            painter.drawLine(at(left - half + x, y), at(left + half + x, y))
        if self.coupled:
            self._draw_block(painter, at, left + half + first, right + ground)
        painter.setPen(pen)
        box = QRectF(0, base + 2, self.width(), caption - 2)
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, texts.FRAME.format(factor=FACTOR))
        painter.end()

    def _draw_block(
        self, painter: QPainter, at: Callable[[float, float], QPointF], begin: float, middle: float
    ) -> None:
        """The spring from `begin` to the block that stands round `middle`, both in metres."""
        block, height = self._specimen.block, self._specimen.frame.h1
        end = middle - block.b
        painter.setPen(QPen(QColor(self._theme.lines[2]), 2))
        coils = [
            at(begin + (end - begin) * (k + 0.5) / COILS, height + (0.012 if k % 2 else -0.012)) for k in range(COILS)
        ]
        painter.drawPolyline(QPolygonF([at(begin, height), *coils, at(end, height)]))
        painter.setPen(QPen(QColor(self._theme.text), 2))
        painter.setBrush(QColor(self._theme.faint))
        painter.drawRect(QRectF(at(end, 2.0 * block.h_b), at(end + 2.0 * block.b, 0.0)))
