# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""The live plot of protocols without a gain: the last fit with its data, or the last response of the table."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt

from bench.app.gui import texts
from bench.app.gui.palette import Theme
from bench.app.gui.widgets import colour_axes, in_screen_unit, label, typeset
from bench.findings import FitFinished, Series, TableIdentified

MOST = 6
"""Largest number of drawn series."""
FEW = 40
"""Largest number of values drawn with symbols."""
DERIVED = ("residual", "uncertainty")
"""Suffixes of the names of series that are not drawn."""
FITTED = "fitted"


class LivePlot(pg.PlotWidget):
    """Plot of the series of a fit along its axis; draws those with the unit of the first series."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._shown: FitFinished | TableIdentified | None = None
        self.setAccessibleName(texts.NAMES["live"])
        self._item: Any = self.getPlotItem()
        self._item.showGrid(x=True, y=True, alpha=0.25)
        self._item.setMenuEnabled(False)
        self._legend = self._item.addLegend(offset=(-8, 8), labelTextSize="9pt")
        self.drawn: list[str] = []
        """Names of the drawn series."""
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
        self._shown = event
        if isinstance(event, FitFinished):
            self._draw(event.columns)
            self._item.setTitle(typeset(event.name), color=self._theme.text, size="10pt", justify="left")
        else:
            size = Series(np.hypot(event.real, event.imaginary), "m/s2/V", texts.RESPONSE)
            self._draw({"frequency": Series(event.frequency, "Hz", ""), texts.RESPONSE: size})

    def _draw(self, columns: Mapping[str, Series]) -> None:
        (axis, along), *others = columns.items()
        if not others:
            return
        first = others[0][1].unit
        chosen = [
            (name, series)
            for name, series in others
            if series.unit == first and not name.endswith(DERIVED) and np.isfinite(series.values).any()
        ]
        x, unit = in_screen_unit(along.unit)
        self._item.setLabel("bottom", _with_unit(axis, unit), color=self._theme.text)
        y, unit = in_screen_unit(first)
        for number, (name, series) in enumerate(chosen[:MOST]):
            colour = self._theme.lines[number % len(self._theme.lines)]
            dash = Qt.PenStyle.DashLine if name.endswith(FITTED) else Qt.PenStyle.SolidLine
            few = len(series.values) <= FEW
            symbol = {"symbol": "o", "symbolSize": 7, "symbolBrush": colour, "symbolPen": colour} if few else {}
            self.plot(
                x * along.values,
                y * series.values,
                pen=pg.mkPen(colour, width=2 if dash is Qt.PenStyle.DashLine else 1, style=dash),
                name=label(name),
                connect="finite",
                **symbol,
            )
            self.drawn.append(name)
        names = [label(name) for name in self.drawn]
        self._item.setLabel("left", _with_unit(names[0] if len(names) == 1 else "", unit), color=self._theme.text)
        self._item.enableAutoRange()


def _with_unit(name: str, unit: str) -> str:
    return " ".join(part for part in (label(name), f"[{unit}]" if unit not in ("", "1") else "") if part)
