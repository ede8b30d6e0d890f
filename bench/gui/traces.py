# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""Live traces. pyqtgraph ships no types, hence the first lines."""

from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtWidgets import QVBoxLayout, QWidget

from bench.gui import texts
from bench.gui.palette import Theme
from bench.gui.ring import Ring
from bench.link.messages import Traces
from bench.link.reduction import TRACES as NAMES

SHOWN = ("drive", "acceleration", "u1", "u2", "drift")
"""The columns that are drawn, as `texts.TRACES` labels them."""
WINDOW, BUCKETS = 10.0, 700
"""Seconds that are shown, and parts of them with two points each."""
HEADROOM, LEAST = 1.15, 1e-3
"""The axis reaches so far beyond the largest value, and at least this far in screen units."""


class TracePlot(QWidget):
    """Five curves one above the other over the same seconds."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.ring = Ring(len(NAMES))
        self._columns = [NAMES.index(name) for name in SHOWN]
        self._fresh = False
        self._reach = np.full(len(SHOWN), LEAST)
        self._view: Any = pg.GraphicsLayoutWidget()
        self._view.setBackground(theme.raised)
        self._view.setAccessibleName("live traces")
        self.plots, self.curves = list[Any](), list[Any]()
        for row, ((label, unit, _), colour) in enumerate(zip(texts.TRACES, theme.lines, strict=True)):
            plot = self._view.addPlot(row=row, col=0)
            _dress(plot, f"{label} [{unit}]", theme, last=row == len(SHOWN) - 1)
            self.plots.append(plot)
            self.curves.append(plot.plot(pen=pg.mkPen(colour, width=1), antialias=False))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._view)

    def clear(self) -> None:
        """A new run begins."""
        self.ring.clear()
        self._reach[:] = LEAST
        self._fresh = True

    def add(self, traces: list[Traces]) -> None:
        """Take in blocks; they are drawn by the next `draw`."""
        for block in traces:
            self.ring.add(block)
        self._fresh = True

    def draw(self) -> None:
        """Bring the curves up to date; nothing is done while nothing is new."""
        if not self._fresh:
            return
        self._fresh = False
        seconds, values = self.ring.window(WINDOW, BUCKETS)
        whole = bool(np.isfinite(values).all())
        for k, (plot, curve, (_, _, factor)) in enumerate(zip(self.plots, self.curves, texts.TRACES, strict=True)):
            line = (values[:, self._columns[k]] * factor).astype(np.float64)
            curve.setData(seconds, line, connect="all" if whole else "finite", skipFiniteCheck=whole)
            self._fit(k, plot, line)

    def _fit(self, k: int, plot: Any, line: NDArray[np.float64]) -> None:
        """Widen the axis at once, narrow it only when it is much too wide: every change redraws it."""
        most = max(float(np.nanmax(np.abs(line))) if np.isfinite(line).any() else 0.0, LEAST)
        if not most <= self._reach[k] <= 4.0 * most:
            self._reach[k] = HEADROOM * most
            plot.setYRange(-self._reach[k], self._reach[k], padding=0.0)


def _dress(plot: Any, title: str, theme: Theme, *, last: bool) -> None:
    plot.setTitle(title, color=theme.text, size="10pt", justify="left")
    plot.setXRange(-WINDOW, 0.0, padding=0.0)
    plot.setYRange(-1.0, 1.0, padding=0.0)
    plot.setMouseEnabled(x=False, y=False)
    plot.setMenuEnabled(False)
    plot.hideButtons()
    plot.showGrid(y=True, alpha=0.25)
    for side in ("left", "bottom"):
        axis = plot.getAxis(side)
        axis.setPen(theme.faint)
        axis.setTextPen(theme.text)
        axis.enableAutoSIPrefix(False)
    plot.getAxis("left").setWidth(58)
    plot.getAxis("left").setStyle(maxTickLevel=0)
    plot.getAxis("bottom").setStyle(showValues=last)
    if last:
        plot.setLabel("bottom", texts.SECONDS, color=theme.text)
