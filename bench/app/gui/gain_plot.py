# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""Plot of the gain against the frequency of a sine, or against stiffness for earthquake records: predicted lines and
measured points.
"""

from collections.abc import Mapping, Sequence
from math import ceil, floor, isfinite, log10
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor

from bench.app.display import texts
from bench.app.display.gains import LEAST, Kind, Line, Mark, kind_of, lines_of, mark_of
from bench.app.display.theme import Theme
from bench.app.gui.widgets import colour_axes, round_down
from bench.datafile.tables import Table
from bench.live_values import Estimate, RunningGain

DASHES = (Qt.PenStyle.SolidLine, Qt.PenStyle.DashLine, Qt.PenStyle.DotLine, Qt.PenStyle.DashDotLine)
SYMBOLS = ("o", "s", "t", "d", "star")
ASIDE = 0.008
"""Horizontal offset of the points of each further run, relative to the width of the axis."""
TICKS = [[(log10(digit) + decade, f"{digit * 10.0**decade:g}") for decade in range(-3, 3) for digit in (1, 2, 5)]]
"""Ticks of a logarithmic axis; an axis of less than `NARROW` decades has evenly spaced ticks instead."""
NARROW = 0.7
PALE = 48
GROUND = 150
"""Opacity of a band and of the background of the legend, from 0 to 255."""


class GainPlot(pg.PlotWidget):
    """Gain plot with one colour and line style for each stiffness or record, and one symbol for each run.

    The gain axis of a spectrum is logarithmic, so that gains of 1/5 and 5 are at the same distance from 1.
    """

    def __init__(self, theme: Theme) -> None:
        super().__init__(enableMenu=False)
        self._prediction: Table = {}
        self._added: list[tuple[Mapping[str, Any], int]] = []
        self._kind: Kind = "spectrum"
        self._groups: list[float | str] = []
        self._marks: list[Mark] = []
        self._hollow = False
        self._ends: list[float] = []
        self._top = 1.0
        self.bands = 0
        """Number of bands drawn."""
        self.setAccessibleName("gain plot")
        self._item: Any = self.getPlotItem()
        self._item.showGrid(x=True, y=True, alpha=0.25)
        self._item.sigYRangeChanged.connect(self._tick)
        self._legend = self._item.addLegend(offset=(-8, 8), labelTextSize="9pt")
        # one item for all points and one for all uncertainties, because separate items take half a millisecond each per
        # frame
        self._points, self._spreads = pg.ScatterPlotItem(size=11), pg.PlotCurveItem(connect="pairs")
        self._bars: list[tuple[float, float, float]] = []
        self._now = pg.ScatterPlotItem(size=18, brush=None, symbol="o")
        self.use_theme(theme)

    @property
    def measured(self) -> list[tuple[float, float]]:
        """Abscissa, in its SI unit, and gain of each drawn point that has a gain."""
        return [(mark.x, mark.gain) for mark in self._marks if mark.gain is not None]

    def use_theme(self, theme: Theme) -> None:
        self._theme = theme
        self.setBackground(theme.raised)
        colour_axes(self._item, theme)
        self._item.setLabel("left", texts.GAIN_AXIS, color=theme.text)
        ground = QColor(theme.raised)
        ground.setAlpha(GROUND)
        self._legend.setBrush(pg.mkBrush(ground))
        self._legend.setLabelTextColor(theme.text)
        self._now.setPen(pg.mkPen(theme.alarm, width=2))
        self._spreads.setPen(pg.mkPen(theme.text, width=2))
        added = self._added
        self.predict(self._prediction)
        self._draw(added)

    def predict(self, prediction: Table) -> None:
        """Replace the content by predicted lines; a prediction without gains leaves the plot empty."""
        self.clear()
        # `clear` keeps the legend entries that do not belong to a curve
        self._legend.clear()
        self.setToolTip("")
        self._prediction, self._added = prediction, []
        self._marks, self._groups, self.bands = [], [], 0
        self._hollow = False
        self._set_axes(kind_of(prediction) or "spectrum")
        lines = lines_of(prediction)
        self._groups = list(dict.fromkeys(line.group for line in lines))
        for line in lines:
            self._draw_line(line)
        self._ends = []
        self._widen(*(x for line in lines for x in (line.x[0], line.x[-1])))
        self._top = max((float(np.nanmax(line.gain)) for line in lines if np.isfinite(line.gain).any()), default=1.0)
        unity = pg.InfiniteLine(0.0 if self._log else 1.0, angle=0, pen=pg.mkPen(self._theme.faint, width=1))
        self._item.addItem(unity, ignoreBounds=True)
        self._bars.clear()
        self._points.clear()
        self._draw_spreads()
        for item in (self._spreads, self._points, self._now):
            self.addItem(item)
        self.hide_running()

    def add(self, point: Mapping[str, Any], run: int = 0) -> None:
        """Draw a finished point with its uncertainty; a point without a gain is a cross at the upper edge."""
        self._draw([(point, run)])

    def _draw(self, points: Sequence[tuple[Mapping[str, Any], int]]) -> None:
        """Draw several points at once."""
        self.hide_running()
        self._points.addPoints([spot for point, run in points for spot in self._spot(point, run)])
        self._draw_spreads()

    def _spot(self, point: Mapping[str, Any], run: int) -> list[dict[str, Any]]:
        """The symbol of a point; empty for a point without gain fields, one that was not played, or one for other axes.
        `_draw_spreads` draws the uncertainty.
        """
        mark = mark_of(point)
        if mark is None:
            return []
        if not self._groups and mark.kind != self._kind:
            self._set_axes(mark.kind)
        if mark.kind != self._kind:
            # a stiffness ratio and a frequency do not share an axis
            return []
        self._added.append((point, run))
        if mark.group not in self._groups:
            self._groups.append(mark.group)
        self._marks.append(mark)
        self._widen(mark.x)
        x, colour = mark.x + ASIDE * (self._ends[1] - self._ends[0]) * run, self._colour(mark.group)
        if mark.gain is None:
            pen = pg.mkPen(self._theme.text, width=2)
            return [{"pos": (x, self._place(self._top)), "symbol": "x", "size": 12, "pen": pen, "brush": colour}]
        low, high = max(mark.gain - mark.spread, LEAST), mark.gain + mark.spread
        self._bars.append((x, self._place(low), self._place(high)))
        pen = pg.mkPen(self._theme.text, width=1)
        symbol = SYMBOLS[run % len(SYMBOLS)]
        brush: str | QColor = colour
        if mark.varies:
            brush, pen = QColor(self._theme.raised), pg.mkPen(colour, width=2)
            if not self._hollow:
                self._hollow = True
                self._legend.addItem(pg.ScatterPlotItem(size=11, symbol="o", brush=brush, pen=pen), texts.MODULATED)
        return [{"pos": (x, self._place(mark.gain)), "symbol": symbol, "size": 11, "pen": pen, "brush": brush}]

    def add_all(self, points: Sequence[Mapping[str, Any]], run: int = 0, name: str = "") -> None:
        """Draw the points of a run, called `name` in the legend. Points for other axes are not drawn; if no
        point of the run is drawn for this reason, the legend states it.
        """
        before = len(self._marks)
        self._draw([(point, run) for point in points])
        if name and before == len(self._marks) and any(mark_of(point) is not None for point in points):
            name = texts.OTHER_AXIS.format(name=name)
        if name:
            sample = pg.ScatterPlotItem(
                size=11, symbol=SYMBOLS[run % len(SYMBOLS)], brush=None, pen=pg.mkPen(self._theme.text, width=1)
            )
            self._legend.addItem(sample, name)

    def show_running(self, event: Estimate | RunningGain) -> None:
        """Show the running estimate."""
        x = event.omega if isinstance(event, Estimate) else event.beta
        if x is not None and isfinite(event.alpha_2) and event.alpha_2 > 0.0:
            self._now.setData([x], [self._place(event.alpha_2)])

    def hide_running(self) -> None:
        """Remove the running estimate."""
        self._now.setData([], [])

    @property
    def _log(self) -> bool:
        return self._kind == "spectrum"

    def _place(self, gain: float) -> float:
        """Axis coordinate of a gain. Lines do not need it: pyqtgraph transforms them for a logarithmic axis."""
        return log10(gain) if self._log else gain

    def _draw_spreads(self) -> None:
        bars = np.array(self._bars).reshape(-1, 3)
        self._spreads.setData(np.repeat(bars[:, 0], 2), bars[:, 1:].ravel())

    def _set_axes(self, kind: Kind) -> None:
        self._kind = kind
        self._item.setLogMode(x=False, y=self._log)
        self._tick()
        label = texts.OMEGA_AXIS if kind == "spectrum" else texts.BETA_AXIS
        self._item.setLabel("bottom", label, color=self._theme.text)

    def _tick(self) -> None:
        ticks = None
        if self._log:
            low, high = self._item.viewRange()[1]
            ticks = TICKS if high - low > NARROW else [evenly(10.0**low, 10.0**high)]
        self._item.getAxis("left").setTicks(ticks)

    def _widen(self, *places: float) -> None:
        """Extend the horizontal axis to these values."""
        every = [*self._ends, *map(float, places)]
        if every and self._ends != [min(every), max(every)]:
            self._ends = [min(every), max(every)]
            width = self._ends[1] - self._ends[0]
            self._item.setXRange(self._ends[0] - 0.05 * width, self._ends[1] + 0.05 * width, padding=0.0)

    def _draw_line(self, line: Line) -> None:
        colour, dash = self._colour(line.group), DASHES[self._groups.index(line.group) % len(DASHES)]
        pen = pg.mkPen(colour, width=2 if line.strong else 1, style=dash)
        self.plot(line.x, line.gain, pen=pen, name=line.name, connect="finite")
        if line.band is None:
            return
        pale = QColor(colour)
        pale.setAlpha(PALE)
        known = np.flatnonzero(np.isfinite(line.band).all(axis=0))
        for part in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
            edges = [
                pg.PlotCurveItem(line.x[part], np.log10(edge[part]) if self._log else edge[part]) for edge in line.band
            ]
            # the range of the axis ignores bands, since a wide band would compress the points
            self._item.addItem(pg.FillBetweenItem(*edges, brush=pg.mkBrush(pale)), ignoreBounds=True)
        self.bands += 1
        self.setToolTip(texts.BAND)

    def _colour(self, group: float | str) -> str:
        place = self._groups.index(group)
        return self._theme.lines[1 + place % (len(self._theme.lines) - 1)]


def evenly(low: float, high: float) -> list[tuple[float, str]]:
    """Ticks at about four evenly spaced gains from `low` to `high`: position on a logarithmic axis, and label."""
    step = round_down((high - low) / 3.0)
    gains = [step * k for k in range(ceil(low / step), floor(high / step) + 1)]
    return [(log10(gain), f"{gain:g}") for gain in gains if gain > 0.0]
