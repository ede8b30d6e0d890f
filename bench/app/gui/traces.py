# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""Live traces of drive, table and storeys."""

from itertools import cycle
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtWidgets import QVBoxLayout, QWidget

from bench.analysis.signals import Further
from bench.app.display import texts
from bench.app.display.buffers import Ring
from bench.app.display.theme import Theme
from bench.app.display.traces import SHOWN, STALE, WINDOW, Label, columns_of, labels_of
from bench.app.gui.widgets import colour_axes, round_down
from bench.app.ipc.messages import TRACES as NAMES
from bench.app.ipc.messages import Traces
from drivers.clock import now

BUCKETS = 700
"""Number of parts of the displayed duration, each drawn as two points."""
AHEAD = 0.5
"""Longest time [s] for which the axis scrolls without a new sample."""
HEADROOM, WIDE, LEAST = 1.15, 2.0, 1e-3
"""Axis range relative to the largest value, ratio above which the range is reduced, and minimum range in displayed
units.
"""


class TracePlot(QWidget):
    """Stacked curves with a common time axis: five standard signals and each further signal of the rig. Samples arrive
    in blocks; between blocks the axis advances with the clock, so that the curves scroll evenly and every sample is
    shown on arrival.
    """

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._further: tuple[Further, ...] = ()
        self._face: float | None = None
        self._stale: int | None = None
        self.ring = Ring(len(NAMES))
        self._columns = columns_of(())
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
        """Show these signals after the standard ones; earlier samples are discarded."""
        if self.plots and further == self._further:
            return
        self._further = further
        self.view.clear()
        self.ring = Ring(len(NAMES) + len(further))
        self._columns = columns_of(further)
        self._reach = np.full(len(self._columns), LEAST)
        self.plots = [self.view.addPlot(enableMenu=False, row=row, col=0) for row in range(len(self._columns))]
        self.curves = [plot.plot(antialias=False) for plot in self.plots]
        for plot in self.plots:
            _arrange(plot, last=plot is self.plots[-1])
        self.use_theme(self._theme)

    @property
    def labels(self) -> tuple[Label, ...]:
        """Label, displayed unit, and displayed units per SI unit for each trace."""
        return labels_of(self._further, self._face)

    def watch_block(self, face: float | None, since: float = 0.0) -> None:
        """Label the traces for laser 2 aimed at the block's face at height `face` [m], or at storey 2 if None. Samples
        from before bench time `since` [s], which show the former target, are discarded.
        """
        if face != self._face:
            self._face, self._fresh = face, True
            self.ring.discard_before(since)
            self.use_theme(self._theme)

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self._theme = theme
        self.view.setBackground(theme.raised)
        for plot, curve, (label, unit, _), colour in zip(
            self.plots, self.curves, self.labels, cycle(theme.lines), strict=False
        ):
            plot.setTitle(f"{label} [{unit}]", color=theme.text, size="10pt", justify="left")
            colour_axes(plot, theme)
            curve.setPen(pg.mkPen(theme.faint if self._stale is not None else colour, width=1))
        axis = texts.SECONDS if self._stale is None else texts.NOT_LIVE_AXIS.format(age=self._stale)
        self.plots[-1].setLabel("bottom", axis, color=theme.text)

    def clear(self) -> None:
        """Clear the traces for a new run."""
        self.ring.clear()
        self._reach[:] = LEAST
        self._read, self._fresh = None, True

    @property
    def age(self) -> float:
        """Time since the newest block was read [s]; 0 without blocks."""
        return 0.0 if self._read is None else max(now() - self._read, 0.0)

    @property
    def stale(self) -> int | None:
        """Whole seconds for which no new samples have arrived; None while the traces are live."""
        return int(self.age) if self.age >= STALE else None

    @property
    def moment(self) -> float:
        """Bench time [s] that the picture shows: one block behind real time, but never later than the newest sample, so
        that the picture advances evenly.
        """
        return self.ring.newest - max(self._length - self.age, 0.0)

    def add(self, traces: list[Traces]) -> None:
        """Add blocks, drawn by the next `draw`."""
        for block in traces:
            self.ring.add(block)
            self._read, self._length = block.read, block.step * len(block.low)
        self._fresh = True

    def draw(self) -> None:
        """Update the curves; without new samples they only scroll, for `AHEAD` seconds at most."""
        if self.stale != self._stale:
            self._stale = self.stale
            self.use_theme(self._theme)
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
        """Widen the axis at once, but narrow it only when it is much too wide, since every change of range causes a
        redraw.
        """
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
    plot.hideButtons()
    plot.showGrid(y=True, alpha=0.25)
    plot.getAxis("left").setWidth(58)
    plot.getAxis("bottom").setStyle(showValues=last)
