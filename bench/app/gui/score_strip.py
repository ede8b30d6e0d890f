# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""Strip of the normalised errors of a run."""

from collections.abc import Sequence
from math import ceil, isfinite
from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import Qt

from bench.app.display import texts
from bench.app.display.point_table import Measured
from bench.app.display.theme import Theme
from bench.app.gui.widgets import colour_axes

LEAST = 1.5
"""Smallest displayed range of E_n on either side of zero."""
HEIGHT = 104
"""Height of the strip [px]."""
LABELS = 12
"""Largest number of ticks on the horizontal axis."""


class ScoreStrip(pg.PlotWidget):
    """E_n of every compared result, at the number of its row in the table of points; hidden if there is none."""

    def __init__(self, theme: Theme) -> None:
        super().__init__(enableMenu=False)
        self._theme = theme
        self.scores: list[tuple[int, float, str]] = []
        """Number of the row, from 1, E_n and description of each compared result."""
        self.setAccessibleName(texts.SCORES)
        self.setToolTip(texts.SCORES_TIP)
        self.setFixedHeight(HEIGHT)
        self._item: Any = self.getPlotItem()
        self._item.setMouseEnabled(x=False, y=False)
        self._item.hideButtons()
        self._points = pg.ScatterPlotItem(size=10, hoverable=True, tip="{data}".format)
        self._bounds = [pg.InfiniteLine(place, angle=0) for place in (-1.0, 0.0, 1.0)]
        for item in (*self._bounds, self._points):
            self._item.addItem(item, ignoreBounds=True)
        self.use_theme(theme)
        self.hide()

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self._theme = theme
        self.setBackground(theme.raised)
        colour_axes(self._item, theme)
        self._item.setLabel("left", texts.SCORE, color=theme.text)
        self._item.setLabel("bottom", texts.SCORE_AXIS, color=theme.text)
        for bound in self._bounds:
            style = Qt.PenStyle.DashLine if bound.value() else Qt.PenStyle.SolidLine
            bound.setPen(pg.mkPen(theme.alarm if bound.value() else theme.faint, width=1, style=style))
        self._draw()

    def use(self, rows: Sequence[Measured]) -> None:
        """Show the scores of the rows of the table of points."""
        self.scores = [
            (number, row.score, f"{number}: {row.quantity}, {row.point}: {texts.SCORE} = {row.score:+.3g}")
            for number, row in enumerate(rows, 1)
            if isfinite(row.score)
        ]
        self._draw()
        self.setVisible(bool(self.scores))

    def _draw(self) -> None:
        if not self.scores:
            self._points.setData([])
            return
        theme = self._theme
        agree = [abs(score) <= 1.0 for _, score, _ in self.scores]
        self._points.setData(
            x=[row for row, _, _ in self.scores],
            y=[score for _, score, _ in self.scores],
            data=[text for _, _, text in self.scores],
            symbol=["o" if each else "t" for each in agree],
            brush=[pg.mkBrush(theme.good if each else theme.alarm) for each in agree],
            pen=pg.mkPen(theme.text, width=1),
        )
        first, last = self.scores[0][0], self.scores[-1][0]
        step = max(ceil((last - first + 1) / LABELS), 1)
        self._item.getAxis("bottom").setTicks([[(row, str(row)) for row in range(first, last + 1, step)]])
        self._item.setXRange(first - 0.5, last + 0.5, padding=0.0)
        reach = max(LEAST, *(1.15 * abs(score) for _, score, _ in self.scores))
        self._item.setYRange(-reach, reach, padding=0.0)
