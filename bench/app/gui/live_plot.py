# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""The live plot of protocols without a gain: the last fit with its data, or the last response of the table."""

from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import Qt

from bench.app.display import texts
from bench.app.display.figure import figure_of
from bench.app.display.theme import Theme
from bench.app.gui.widgets import colour_axes
from bench.findings import FitFinished, TableIdentified

FEW = 40
"""Largest number of values drawn with symbols."""


class LivePlot(pg.PlotWidget):
    """Plot of the series of a fit along its axis; draws those with the unit of the first series."""

    def __init__(self, theme: Theme) -> None:
        super().__init__(enableMenu=False)
        self._theme = theme
        self._shown: FitFinished | TableIdentified | None = None
        self.setAccessibleName(texts.NAMES["live"])
        self._item: Any = self.getPlotItem()
        self._item.showGrid(x=True, y=True, alpha=0.25)
        self._legend = self._item.addLegend(offset=(-8, 8), labelTextSize="9pt")
        self.drawn: list[str] = []
        """Names of the drawn curves."""
        self.use_theme(theme)

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self._theme = theme
        self.setBackground(theme.raised)
        colour_axes(self._item, theme)
        self._legend.setLabelTextColor(theme.text)
        self._legend.setBrush(pg.mkBrush(theme.raised))
        if self._shown is not None:
            self.show_result(self._shown)

    def forget(self) -> None:
        """Clear the plot for a new run."""
        self._shown, self.drawn = None, []
        self.clear()
        self._legend.clear()
        self._item.setTitle(None)
        for side in ("left", "bottom"):
            self._item.setLabel(side, "")

    def show_result(self, event: FitFinished | TableIdentified) -> None:
        """Draw a finished fit, or the response of the table."""
        self.forget()
        self._shown, figure = event, figure_of(event)
        if figure.title:
            self._item.setTitle(figure.title, color=self._theme.text, size="10pt", justify="left")
        self._item.setLabel("bottom", figure.x_label, color=self._theme.text)
        self._item.setLabel("left", figure.y_label, color=self._theme.text)
        for number, curve in enumerate(figure.curves):
            colour = self._theme.lines[number % len(self._theme.lines)]
            style = Qt.PenStyle.DashLine if curve.fitted else Qt.PenStyle.SolidLine
            few = len(curve.y) <= FEW
            symbol = {"symbol": "o", "symbolSize": 7, "symbolBrush": colour, "symbolPen": colour} if few else {}
            pen = pg.mkPen(colour, width=2 if curve.fitted else 1, style=style)
            self.plot(curve.x, curve.y, pen=pen, name=curve.name, connect="finite", **symbol)
            self.drawn.append(curve.name)
        self._item.enableAutoRange()
