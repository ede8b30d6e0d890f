"""The physical picture: table, frame, spring and block to scale, their motion drawn larger."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent, QWheelEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSizePolicy, QSpinBox, QVBoxLayout, QWidget

from bench.events import TWIN_TRACE, TwinEstimate
from bench.gui import texts
from bench.gui.drawing import Drawing, Pose
from bench.gui.palette import Theme
from bench.link.messages import Traces
from bench.link.reduction import TRACES
from sim.specimen import Specimen

X_G, U_1, U_2 = (TRACES.index(name) for name in ("displacement", "u1", "u2"))
_SECONDS, _THETA = (TWIN_TRACE.index(name) for name in ("seconds", "theta"))
STEP = 0.01
"""Between two angles of the twin [s]."""
KEPT = 500
"""Angles that are kept: five seconds."""
BEHIND = 2.0
"""How far the twin may be behind what was measured [s of the bench's time]: a run may be faster than the clock."""
FACTOR, LARGEST = 5, 50
"""How many times as large as the frame the motion is drawn: at first, and at most."""
BELOW = 12
"""Room under the table for the marks of contact [px]."""
LARGER, SMALLER = (Qt.Key.Key_Plus, Qt.Key.Key_Equal, Qt.Key.Key_Up), (Qt.Key.Key_Minus, Qt.Key.Key_Down)


class BlockAngle:
    """The angle of the block over bench time, as the live twin publishes it: no sensor watches the block."""

    def __init__(self) -> None:
        self._run, self._origin = 0, 0.0
        self._time, self._angle = np.zeros(0), np.zeros(0)

    def place(self, traces: Traces) -> None:
        """Take note of when the run of these traces began."""
        if traces.run != self._run:
            self._run, self._origin = traces.run, traces.origin
            self._time, self._angle = np.zeros(0), np.zeros(0)

    def add(self, estimate: TwinEstimate) -> None:
        """Take the next stretch of the twin's trace; one of another run than that of the traces is left out."""
        if estimate.run != self._run:
            return
        stood = estimate.trace[np.isfinite(estimate.trace[:, _THETA])]
        self._time = np.append(self._time, self._origin + stood[:, _SECONDS])[-KEPT:]
        self._angle = np.append(self._angle, stood[:, _THETA])[-KEPT:]

    def nearest(self, time: float) -> float:
        """The latest bench time [s] up to `time` at which the angle is known, so that frame and block are shown as they
        were at one moment; `time` itself where nothing is known of the last `BEHIND` seconds.
        """
        newest = float(self._time[-1]) if self._time.size else float("-inf")
        return newest if time - BEHIND <= newest < time else time

    def at(self, time: float) -> tuple[float, float] | None:
        """Angle [rad] at bench time [s], and how long ago the block last struck its base [s], infinite if it has not.

        None while nothing is known of that moment.
        """
        times, angles = self._time, self._angle
        if not times.size or not times[0] <= time <= times[-1] + STEP:
            return None
        until = int(np.searchsorted(times, time, side="right"))
        sign = np.sign(angles[:until])
        struck = np.flatnonzero((sign[:-1] != 0.0) & (sign[1:] != sign[:-1]))
        ago = time - float(times[struck[-1] + 1]) if struck.size else float("inf")
        return float(angles[until - 1]), ago


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
