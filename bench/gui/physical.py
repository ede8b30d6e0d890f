"""The physical picture: table, frame, spring and block to scale, their motion drawn larger."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent, QWheelEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSizePolicy, QSpinBox, QVBoxLayout, QWidget

from bench.gui import texts
from bench.gui.drawing import Drawing, Pose
from bench.gui.palette import Theme
from bench.link.reduction import TRACES
from sim.specimen import Specimen

X_G, U_1, U_2 = (TRACES.index(name) for name in ("displacement", "u1", "u2"))
FACTOR, LARGEST = 5, 50
"""How many times as large as the frame the motion is drawn: at first, and at most."""
BELOW = 12
"""Room under the table for the marks of contact [px]."""
LARGER, SMALLER = (Qt.Key.Key_Plus, Qt.Key.Key_Equal, Qt.Key.Key_Up), (Qt.Key.Key_Minus, Qt.Key.Key_Down)


class PhysicalPicture(QWidget):
    """Drawn from measured table displacement and storeys; the block's angle is the model's, where there is one."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.canvas = _Canvas(theme)
        self.factor = QSpinBox(minimum=1, maximum=LARGEST, value=FACTOR, prefix="× ")
        self.factor.setAccessibleName(texts.FACTOR)
        self.factor.setToolTip(texts.FACTOR_TIP)
        self.source = QLabel(texts.FRAME)
        self.source.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
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

    @property
    def pose(self) -> Pose:
        """What is drawn now."""
        return self.canvas.pose

    def use_theme(self, theme: Theme) -> None:
        """Take these colours."""
        self.canvas.theme = theme
        self.canvas.update()

    def use(self, specimen: Specimen) -> None:
        """Draw this specimen from now on, at rest."""
        self.canvas.specimen = specimen
        self.canvas.coupled = False
        self.move_to(np.zeros(len(TRACES)), None)
        self.canvas.update()

    def couple(self, coupled: bool) -> None:
        """Whether spring and block are mounted."""
        if coupled != self.canvas.coupled:
            self.canvas.coupled = coupled
            self.canvas.update()

    def move_to(self, motion: NDArray[np.float64], block: tuple[float, float] | None) -> None:
        """Show the signals `bench.link.reduction.TRACES` of one moment, and the block: its angle [rad] and the seconds
        since its last impact, None where they are not known.
        """
        self._motion = np.nan_to_num(motion)
        self._angle, self._struck = block or (None, float("inf"))
        self._draw()

    def _draw(self) -> None:
        factor = self.factor.value()
        ground, first, second = (factor * float(self._motion[k]) for k in (X_G, U_1, U_2))
        pose = Pose(ground, first, second, None if self._angle is None else factor * self._angle, self._struck)
        if pose != self.canvas.pose:
            self.canvas.pose = pose
            self.canvas.update()
        known = texts.FRAME_AND_BLOCK if self._angle is not None else texts.FRAME_ONLY
        self.source.setText(known if self.canvas.coupled else texts.FRAME)


class _Canvas(QWidget):
    """What is drawn; the wheel and + and - change how large."""

    factor: QSpinBox

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.theme, self.specimen, self.pose, self.coupled = theme, Specimen(), Pose(), False
        self.setMinimumHeight(120)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(texts.NAMES["picture"])
        self.setToolTip(texts.FACTOR_TIP)

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002 - the signature is Qt's
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        drawing = Drawing(painter, self.theme, self.specimen, QRectF(0, 0, self.width(), self.height() - BELOW))
        drawing.draw_frame(self.pose)
        if self.coupled:
            drawing.draw_block(self.pose)
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
