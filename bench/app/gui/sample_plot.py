# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""Plots of several lines with a common horizontal axis, one plot for each unit, with two cursors."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent

from bench.app.display.theme import Theme
from bench.app.gui.widgets import colour_axes

DASHES = (Qt.PenStyle.SolidLine, Qt.PenStyle.DashLine, Qt.PenStyle.DotLine)
PLACES = (1.0 / 3.0, 2.0 / 3.0)
"""Initial positions of the cursors, relative to the visible range."""
NAMES = ("A", "B")
"""Names of the cursors, and the keys that select them."""
STYLES = (Qt.PenStyle.SolidLine, Qt.PenStyle.DashLine)
BOLD, PLAIN = 4, 2
"""Line widths of the selected cursor and of the other one [px]."""
FAST = 10
"""Number of samples by which Shift with an arrow key moves a cursor."""
WIDTH = 62
"""Width of the vertical axes [px], which aligns the plots."""
ABREAST = 2
"""Largest number of lines for which the legend has a single column."""
GROUND = 150
"""Opacity of the background of the legend, from 0 to 255."""


@dataclass(frozen=True, eq=False)
class Line:
    """A line in displayed units; both arrays have shape (n,)."""

    name: str
    unit: str
    x: NDArray[np.floating[Any]]
    y: NDArray[np.floating[Any]]


class SamplePlot(pg.GraphicsLayoutWidget):
    """Lines with a common horizontal axis, in stacked plots, one for each unit; the wheel zooms, and dragging pans.
    Keys select a cursor and move it from sample to sample.
    """

    range_changed = Signal()
    cursors_moved = Signal()

    def __init__(self, theme: Theme, below: str, left: str, *, log: bool = False) -> None:
        super().__init__()
        self._theme, self._below, self._left, self._log = theme, below, left, log
        self.lines: Sequence[Line] = ()
        self.plots = list[Any]()
        """Plot items from top to bottom; at least one."""
        self.curves = list[Any]()
        """Curve items of the drawn lines, in the order of `lines`."""
        self._pairs = list[tuple[Any, Any]]()
        self._cursors: tuple[float, float] | None = None
        self._moving = False
        self.selected = 0
        """Index of the cursor that the keys move."""
        self.samples: tuple[float, int] = (1.0, 0)
        """Spacing of the samples on the horizontal axis, of which the first is at zero, and index of the last one."""
        self._layout: Any = self.ci
        self._lay_out([""])

    @property
    def visible(self) -> tuple[float, float]:
        """Visible range of the horizontal axis."""
        begin, end = self.plots[0].viewRange()[0]
        return float(begin), float(end)

    @property
    def cursors(self) -> tuple[float, float] | None:
        """Positions of the two cursors; None while they are hidden."""
        return self._cursors

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self._theme = theme
        self._lay_out(list(dict.fromkeys(line.unit for line in self.lines)) or [""])
        self.draw(self.lines)

    def show_range(self, begin: float, end: float) -> None:
        """Show this part of the horizontal axis."""
        self.plots[0].setXRange(begin, end, padding=0.0)

    def draw(self, lines: Sequence[Line]) -> None:
        """Replace the lines."""
        units = list(dict.fromkeys(line.unit for line in lines)) or [""]
        if units != list(dict.fromkeys(line.unit for line in self.lines)) or len(self.plots) != len(units):
            self._lay_out(units)
        self.lines, self.curves = lines, []
        for plot, unit in zip(self.plots, units, strict=True):
            plot.clearPlots()
            own = [line for line in lines if line.unit == unit]
            # stacked plots have no space for a name on the axis; the legend states it
            name = lines[0].name if len(lines) == 1 else self._left if len(units) == 1 else ""
            plot.setLabel("left", " ".join(part for part in (name, f"[{unit}]" if unit else "") if part))
            plot.legend.clear()
            plot.legend.setVisible(len(lines) > 1)
            plot.legend.setColumnCount(1 if len(own) <= ABREAST else 2)
        for number, line in enumerate(lines):
            colours = self._theme.lines[1:]
            dash = DASHES[number // len(colours) % len(DASHES)]
            pen = pg.mkPen(colours[number % len(colours)], width=1, style=dash)
            plot = self.plots[units.index(line.unit)]
            self.curves.append(plot.plot(line.x, line.y, pen=pen, connect="finite", name=line.name))
            plot.enableAutoRange(axis="y")

    def show_cursors(self, *, on: bool) -> None:
        """Show the cursors within the visible range, or hide them."""
        begin, end = self.visible
        self._cursors = (begin + PLACES[0] * (end - begin), begin + PLACES[1] * (end - begin)) if on else None
        self._place_cursors()
        self.cursors_moved.emit()

    def keyPressEvent(self, ev: QKeyEvent) -> None:
        """Select a cursor, or move the selected one."""
        # arrow keys of some keyboards belong to the keypad
        held = ev.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        if self._cursors is None or held not in (Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier):
            super().keyPressEvent(ev)
            return
        spacing, last = self.samples
        begin, end = self.visible
        at = round(self._cursors[self.selected] / spacing)
        by = FAST if held == Qt.KeyboardModifier.ShiftModifier else 1
        match ev.key():
            case Qt.Key.Key_A | Qt.Key.Key_B:
                self._select(ev.key() - Qt.Key.Key_A)
                return
            case Qt.Key.Key_Left:
                at -= by
            case Qt.Key.Key_Right:
                at += by
            case Qt.Key.Key_Home:
                at = ceil(begin / spacing)
            case Qt.Key.Key_End:
                at = floor(end / spacing)
            case _:
                super().keyPressEvent(ev)
                return
        self._move(spacing * min(max(at, 0), last))

    def _move(self, place: float) -> None:
        """Move the selected cursor, and the visible range with it."""
        if self._cursors is None:
            return
        first, second = self._cursors
        self._cursors = (first, place) if self.selected else (place, second)
        self._place_cursors()
        begin, end = self.visible
        if not begin <= place <= end:
            self.show_range(place - 0.5 * (end - begin), place + 0.5 * (end - begin))
        self.cursors_moved.emit()

    def _select(self, cursor: int) -> None:
        self.selected = cursor
        for pair in self._pairs:
            for number, each in enumerate(pair):
                each.setPen(self._pen(number))

    def _pen(self, cursor: int) -> Any:
        width, style = BOLD if cursor == self.selected else PLAIN, STYLES[cursor]
        return pg.mkPen(self._theme.wait, width=width, style=style)

    def _lay_out(self, units: Sequence[str]) -> None:
        kept = self.visible if self.plots else None
        self._layout.clear()
        self.plots, self._pairs = [], []
        self.setBackground(self._theme.raised)
        for number in range(len(units)):
            plot: Any = self._layout.addPlot(row=number, col=0, enableMenu=False)
            plot.setMouseEnabled(x=True, y=False)
            plot.hideButtons()
            plot.showGrid(x=True, y=True, alpha=0.25)
            plot.setLogMode(y=self._log)
            colour_axes(plot, self._theme)
            plot.getAxis("left").setWidth(WIDTH)
            legend = plot.addLegend(offset=(-8, 4), labelTextSize="9pt")
            ground = QColor(self._theme.raised)
            ground.setAlpha(GROUND)
            legend.setBrush(pg.mkBrush(ground))
            legend.setLabelTextColor(self._theme.text)
            if self.plots:
                plot.setXLink(self.plots[0])
                self.plots[-1].getAxis("bottom").setStyle(showValues=False)
            self.plots.append(plot)
            self._pairs.append(self._cursor_pair(plot))
        self.plots[-1].setLabel("bottom", self._below, color=self._theme.text)
        self.plots[0].sigXRangeChanged.connect(self._report_range)
        if kept is not None:
            self.show_range(*kept)
        self._place_cursors()

    def _report_range(self) -> None:
        self.range_changed.emit()

    def _cursor_pair(self, plot: Any) -> tuple[Any, Any]:
        pair = []
        for number, name in enumerate(NAMES):
            cursor = pg.InfiniteLine(0.0, angle=90, movable=True, pen=self._pen(number), label=name)
            cursor.label.setColor(self._theme.text)
            cursor.label.setPosition(0.08)
            cursor.sigPositionChanged.connect(self._follow)
            plot.addItem(cursor, ignoreBounds=True)
            pair.append(cursor)
        return pair[0], pair[1]

    def _follow(self, moved: Any) -> None:
        """Move the cursors of all plots with the one that is dragged."""
        if self._moving or self._cursors is None:
            return
        pair = next(pair for pair in self._pairs if moved in pair)
        self._select(pair.index(moved))
        self._cursors = (float(pair[0].value()), float(pair[1].value()))
        self._place_cursors()
        self.cursors_moved.emit()

    def _place_cursors(self) -> None:
        self._moving = True
        for pair in self._pairs:
            for cursor, place in zip(pair, self._cursors or (0.0, 0.0), strict=True):
                cursor.setValue(place)
                cursor.setVisible(self._cursors is not None)
        self._moving = False
