# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""The gain spectrum: measured points filling up on the predicted lines."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt

from bench.events import Estimate
from bench.gui import texts
from bench.gui.palette import Theme
from bench.record.tables import Table

DASHES = (Qt.PenStyle.SolidLine, Qt.PenStyle.DashLine, Qt.PenStyle.DotLine, Qt.PenStyle.DashDotLine)
SYMBOLS = ("o", "s", "t", "d", "+")
NEEDED = frozenset({"omega", "beta", "alpha_2", "layer"})
"""Columns of a prediction that can be drawn here."""


class GainPlot(pg.PlotWidget):
    """One colour, dash and symbol per stiffness; logarithmic gain, so that 1/5 and 5 are seen alike."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._betas: list[float] = []
        self._points: list[tuple[float, float]] = []
        self.setBackground(theme.raised)
        self.setAccessibleName("gain spectrum")
        item: Any = self.getPlotItem()
        item.setLogMode(x=False, y=True)
        item.setLabel("bottom", texts.OMEGA_AXIS, color=theme.text)
        item.setLabel("left", texts.GAIN_AXIS, color=theme.text)
        item.showGrid(x=True, y=True, alpha=0.25)
        item.setMenuEnabled(False)
        for side in ("left", "bottom"):
            item.getAxis(side).setPen(theme.faint)
            item.getAxis(side).setTextPen(theme.text)
            item.getAxis(side).enableAutoSIPrefix(False)
        self._legend = item.addLegend(offset=(-8, 8), labelTextColor=theme.text)
        self._now = pg.ScatterPlotItem(size=16, pen=pg.mkPen(theme.alarm, width=2), brush=None, symbol="o")

    @property
    def measured(self) -> list[tuple[float, float]]:
        """Frequency [rad/s] and gain of the points that are drawn."""
        return list(self._points)

    def predict(self, prediction: Table) -> None:
        """Begin anew with these lines; a prediction of another shape leaves the plot empty."""
        self.clear()
        self._points = []
        self._betas = []
        if prediction.keys() >= NEEDED:
            omega, gain, beta, layer = (prediction[name].values for name in ("omega", "alpha_2", "beta", "layer"))
            self._betas = sorted({round(float(each), 6) for each in beta})
            for k, each in enumerate(self._betas):
                for kind in ("rocking", "resting"):
                    rows = np.flatnonzero((np.abs(beta - each) < 1e-6) & (layer == kind))
                    rows = rows[np.argsort(omega[rows])]
                    if rows.size:
                        width = 2 if kind == "rocking" else 1
                        pen = pg.mkPen(self._colour(k), width=width, style=DASHES[k % len(DASHES)])
                        name = f"{texts.PREDICTED}, β = {each:g}, {kind}"
                        self.plot(omega[rows], np.maximum(gain[rows].astype(float), 1e-3), pen=pen, name=name)
        self.addItem(self._now)
        self._now.setData([], [])

    def add(self, point: Mapping[str, Any]) -> None:
        """Draw a finished point, as large as its uncertainty; one without a gain is not drawn."""
        omega, gain, beta = (point.get(name) for name in ("omega_rad_s", "alpha_2", "beta"))
        self._now.setData([], [])
        if omega is None or gain is None or not gain > 0.0:
            return
        k = self._betas.index(round(beta, 6)) if beta is not None and round(beta, 6) in self._betas else 0
        spread = float(point.get("alpha_2_uncertainty") or 0.0)
        low, high = max(gain - spread, 1e-3), gain + spread
        self.plot([omega, omega], [low, high], pen=pg.mkPen(self._theme.text, width=2))
        self.plot([omega], [gain], pen=None, symbol=SYMBOLS[k % 5], symbolSize=11, symbolBrush=self._colour(k))
        self._points.append((omega, gain))

    def add_all(self, points: Sequence[Mapping[str, Any]]) -> None:
        """Draw several."""
        for point in points:
            self.add(point)

    def show_running(self, estimate: Estimate) -> None:
        """Where the point that is being measured stands now."""
        if isfinite(estimate.alpha_2) and estimate.alpha_2 > 0.0:
            self._now.setData([estimate.omega], [float(np.log10(estimate.alpha_2))])

    def _colour(self, k: int) -> str:
        return self._theme.lines[1 + k % (len(self._theme.lines) - 1)]
