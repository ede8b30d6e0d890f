# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""Plot of a panel of the live view, with its title and legend above the axes."""

from html import escape
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from bench.app.display import texts
from bench.app.display.figure import Curve, Figure, figure_of
from bench.app.display.theme import Theme
from bench.app.gui.gain_plot import TICKS
from bench.app.gui.widgets import colour_axes
from bench.live_view import Panel

INSIDE = (60, 8, 8, 44)
"""Distances of the notice from the edges of the plot [px], so that it does not cover the axes."""
KEYS = {"line": "──", "points": "●", "predicted": "╌╌"}
"""Symbols of the legend, by style of the curve."""
LEGEND = 4
"""Largest number of curves in the legend; the tooltip lists all of them."""


class LivePlot(QWidget):
    """Axes with the curves of a panel; until there is a result, a notice announces the expected contents."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._panel: Panel | None = None
        self.figure = Figure("", "", "", (), "")
        """The drawn figure."""
        self.heading = QLabel(wordWrap=True, textFormat=Qt.TextFormat.RichText)
        self.plot = pg.PlotWidget(enableMenu=False)
        self.plot.setAccessibleName(texts.NAMES["live"])
        self._item: Any = self.plot.getPlotItem()
        self._item.showGrid(x=True, y=True, alpha=0.25)
        self._item.hideButtons()
        self.notice = QLabel(wordWrap=True, alignment=Qt.AlignmentFlag.AlignCenter, textFormat=Qt.TextFormat.RichText)
        self.notice.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.notice.setContentsMargins(*INSIDE)
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(0)
        grid.setRowStretch(1, 1)
        grid.addWidget(self.heading, 0, 0)
        # both in the same cell, so that the notice is drawn over the plot
        for part in (self.plot, self.notice):
            grid.addWidget(part, 1, 0)
        self.use_theme(theme)

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self._theme = theme
        self.plot.setBackground(theme.raised)
        colour_axes(self._item, theme)
        if self._panel is not None:
            self.show_panel(self._panel)

    def show_panel(self, panel: Panel) -> None:
        """Draw a panel."""
        self._panel, self.figure = panel, figure_of(panel)
        figure, item, theme = self.figure, self._item, self._theme
        item.clear()
        item.setLogMode(x="x" in panel.logarithmic, y="y" in panel.logarithmic)
        for side, axis in (("bottom", "x"), ("left", "y")):
            item.getAxis(side).setTicks(TICKS if axis in panel.logarithmic else None)
        item.setAspectLocked(panel.equal)
        item.setLabel("bottom", figure.x_label, color=theme.text)
        item.setLabel("left", figure.y_label, color=theme.text)
        drawn = [curve for curve in figure.curves if curve.style != "reference"]
        colours = {id(curve): theme.lines[place % len(theme.lines)] for place, curve in enumerate(drawn)}
        for curve in figure.curves:
            self._draw(curve, colours.get(id(curve), theme.faint))
        keys = (f'<span style="color: {colours[id(curve)]}">{KEYS[curve.style]}</span>' for curve in drawn)
        # no-break spaces, so that the legend wraps between curves only
        names = (escape(curve.name).replace(" ", "&nbsp;") for curve in drawn)
        entries = [f"{key}&nbsp;{name}" for key, name in zip(keys, names, strict=True)]
        shown = " &nbsp;".join(entries[:LEGEND] + ["…"] * (len(entries) > LEGEND))
        title = f"<b>{escape(figure.title)}</b> &nbsp;" if figure.title else ""
        self.heading.setText(f'<span style="font-size: 8pt">{title}{shown}</span>')
        self.heading.setToolTip("\n".join(curve.name for curve in drawn) if len(entries) > LEGEND else "")
        # with a background, because predicted lines may pass behind the notice
        self.notice.setText(f'<span style="background-color: {theme.raised}">{escape(figure.notice)}</span>')
        self.notice.setVisible(bool(figure.notice))
        item.enableAutoRange()

    def _draw(self, curve: Curve, colour: str) -> None:
        if curve.style == "points":
            if curve.low is not None and curve.high is not None and np.isfinite(curve.low).any():
                ends = np.column_stack((curve.low, curve.high)).ravel()
                self._item.plot(np.repeat(curve.x, 2), ends, pen=pg.mkPen(colour, width=1), connect="pairs")
            outline = pg.mkPen(self._theme.text, width=1)
            self._item.plot(curve.x, curve.y, pen=None, symbol="o", symbolSize=8, symbolBrush=colour, symbolPen=outline)
            return
        style = Qt.PenStyle.DashLine if curve.style == "predicted" else Qt.PenStyle.SolidLine
        pen = pg.mkPen(colour, width=2 if curve.style == "predicted" else 1, style=style)
        # a single point forms no line: draw a cross instead
        alone = np.count_nonzero(np.isfinite(curve.x) & np.isfinite(curve.y)) == 1
        mark = {"symbol": "x", "symbolSize": 10, "symbolPen": colour, "symbolBrush": colour} if alone else {}
        self._item.plot(curve.x, curve.y, pen=pen, connect="finite", **mark)
