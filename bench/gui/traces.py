# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""Live traces. pyqtgraph ships no types, hence the first lines."""

from itertools import cycle
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtWidgets import QVBoxLayout, QWidget

from bench.analysis.signals import Further
from bench.gui import texts
from bench.gui.axes import colour_axes, round_down
from bench.gui.palette import Theme
from bench.gui.ring import Ring
from bench.link.messages import Traces
from bench.link.reduction import TRACES as NAMES
from drivers.clock import now

SHOWN = ("drive", "acceleration", "u1", "u2", "drift")
"""The columns that are drawn, as `texts.TRACES` labels them."""
WINDOW, BUCKETS = 10.0, 700
"""Seconds that are shown, and parts of them with two points each."""
AHEAD = 0.5
"""Longest time [s] that the axis runs on without a new sample: then it stands, and the age of the newest is told."""
HEADROOM, WIDE, LEAST = 1.15, 2.0, 1e-3
"""The axis reaches so far beyond the largest value; so much too far it is narrowed; at least so far in screen units."""


class TracePlot(QWidget):
    """Five curves one above the other over the same seconds, and one for each further signal of the rig.

    Samples come in blocks; between two blocks the axis runs on with the clock, so that the curves scroll evenly and
    every sample is shown as soon as it is known.
    """

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._further: tuple[Further, ...] = ()
        self.ring = Ring(len(NAMES))
        self._columns = [NAMES.index(name) for name in SHOWN]
        self._fresh = False
        self._read: float | None = None
        self._length = 0.0
        self._shift = 0.0
        self._reach = np.full(len(SHOWN), LEAST)
        self.view: Any = pg.GraphicsLayoutWidget()
        self.view.setAccessibleName(texts.NAMES["traces"])
        self.plots: list[Any] = []
        self.curves: list[Any] = []
        self.use_further(())
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.view)

    def use_further(self, further: tuple[Further, ...]) -> None:
        """Show these signals after those of every bench: what was there before is forgotten."""
        if self.plots and further == self._further:
            return
        self._further = further
        self.view.clear()
        self.ring = Ring(len(NAMES) + len(further))
        self._columns = [*(NAMES.index(name) for name in SHOWN), *range(len(NAMES), len(NAMES) + len(further))]
        self._reach = np.full(len(self._columns), LEAST)
        self.plots = [self.view.addPlot(row=row, col=0) for row in range(len(self._columns))]
        self.curves = [plot.plot(antialias=False) for plot in self.plots]
        for plot in self.plots:
            _arrange(plot, last=plot is self.plots[-1])
        self.use_theme(self._theme)

    @property
    def labels(self) -> tuple[tuple[str, str, float], ...]:
        """Label, unit on the screen, and screen units per SI unit, of each trace."""
        return (*texts.TRACES, *((each.name.replace("_", " "), each.unit, 1.0) for each in self._further))

    def use_theme(self, theme: Theme) -> None:
        """Take these colours."""
        self._theme = theme
        self.view.setBackground(theme.raised)
        for plot, curve, (label, unit, _), colour in zip(
            self.plots, self.curves, self.labels, cycle(theme.lines), strict=False
        ):
            plot.setTitle(f"{label} [{unit}]", color=theme.text, size="10pt", justify="left")
            colour_axes(plot, theme)
            curve.setPen(pg.mkPen(colour, width=1))
        self.plots[-1].setLabel("bottom", texts.SECONDS, color=theme.text)

    def clear(self) -> None:
        """A new run begins."""
        self.ring.clear()
        self._reach[:] = LEAST
        self._read, self._fresh = None, True

    @property
    def age(self) -> float:
        """Seconds since the newest block had been read; 0 while there is none."""
        return 0.0 if self._read is None else max(now() - self._read, 0.0)

    @property
    def moment(self) -> float:
        """Bench time [s] that a picture of one moment shows: a block behind, so that it moves evenly through it."""
        return self.ring.newest - max(self._length - self.age, 0.0)

    def add(self, traces: list[Traces]) -> None:
        """Take in blocks; they are drawn by the next `draw`."""
        for block in traces:
            self.ring.add(block)
            self._read, self._length = block.read, block.step * len(block.low)
        self._fresh = True

    def draw(self) -> None:
        """Bring the curves up to date; only moved where nothing is new, left alone where nothing has come for long."""
        shift = min(self.age, AHEAD)
        if shift != self._shift:
            self._shift = shift
            for curve in self.curves:
                curve.setPos(-shift, 0.0)
        if not self._fresh:
            return
        self._fresh = False
        seconds, values = self.ring.window(WINDOW, BUCKETS)
        whole = bool(np.isfinite(values).all())
        for k, (plot, curve, (_, _, factor)) in enumerate(zip(self.plots, self.curves, self.labels, strict=True)):
            line = (values[:, self._columns[k]] * factor).astype(np.float64)
            curve.setData(seconds, line, connect="all" if whole else "finite", skipFiniteCheck=whole)
            self._fit(k, plot, line)

    def _fit(self, k: int, plot: Any, line: NDArray[np.float64]) -> None:
        """Widen the axis at once, narrow it only when it is much too wide: every change redraws it."""
        most = max(float(np.nanmax(np.abs(line))) if np.isfinite(line).any() else 0.0, LEAST)
        if not most <= self._reach[k] <= WIDE * most:
            self._reach[k] = HEADROOM * most
            reach = float(self._reach[k])
            plot.setYRange(-reach, reach, padding=0.0)
            mark = round_down(0.75 * reach)
            plot.getAxis("left").setTicks([[(at, f"{at:g}") for at in (-mark, 0.0, mark)]])


def _arrange(plot: Any, *, last: bool) -> None:
    plot.setXRange(-WINDOW, 0.0, padding=0.0)
    plot.setYRange(-1.0, 1.0, padding=0.0)
    plot.setMouseEnabled(x=False, y=False)
    plot.setMenuEnabled(False)
    plot.hideButtons()
    plot.showGrid(y=True, alpha=0.25)
    plot.getAxis("left").setWidth(58)
    plot.getAxis("bottom").setStyle(showValues=last)
