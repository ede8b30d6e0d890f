# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""Spectrum, phase plane and Poincaré section of the last seconds of the drift, computed from the displayed traces."""

from math import pi
from typing import Any, Literal

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray

from bench.app.display import texts
from bench.app.display.buffers import Ring
from bench.app.display.samples import amplitude_spectrum
from bench.app.display.theme import Theme
from bench.app.gui.widgets import colour_axes
from bench.app.ipc.messages import TRACES
from bench.live_values import TWIN_TRACE, TwinEstimate

Kind = Literal["spectrum", "phase", "Poincaré"]
KINDS: tuple[Kind, ...] = ("spectrum", "phase", "Poincaré")
SECONDS: dict[Kind, float] = {"spectrum": 20.0, "phase": 3.0, "Poincaré": 60.0}
"""Duration of the displayed motion, by kind of plot [s]."""
HIGHEST = 10.0
"""Highest displayed frequency [Hz]."""
MODELLED = 3.0
"""Duration of the displayed motion of the live model [s]."""
SMOOTH = np.full(5, 0.2)
"""Weights of the moving average of the drift over bins, from which the velocity is computed: within one bin, the noise
of the lasers exceeds the motion.
"""
_DRIFT = TRACES.index("drift")
_T, _U1, _U2 = (TWIN_TRACE.index(name) for name in ("seconds", "u1", "u2"))


def stroboscopic(time: NDArray[np.float64], values: NDArray[np.float64], omega: float) -> NDArray[np.float64]:
    """`values`, shape (n, m), at the times `time` [s], shape (n,), interpolated at the multiples of the period of
    `omega` [rad/s] in this interval; shape (k, m).
    """
    period = 2.0 * pi / omega
    at = period * np.arange(np.ceil(time[0] / period), np.floor(time[-1] / period) + 1.0)
    return np.column_stack([np.interp(at, time, column) for column in values.T])


class MotionPlot(pg.PlotWidget):
    """Plot of one kind; the live model's motion is drawn behind that of the specimen in the phase plane."""

    def __init__(self, theme: Theme, kind: Kind) -> None:
        super().__init__(enableMenu=False)
        self.kind: Kind = kind
        self.omega: float | None = None
        """Circular frequency of the base motion [rad/s]; None unless a steady sine is being measured."""
        self._since = 0.0
        self._model, self._run = np.zeros((0, 3)), 0
        self._item: Any = self.getPlotItem()
        self._item.hideButtons()
        self._item.showGrid(x=True, y=True, alpha=0.25)
        self.setAccessibleName(texts.MOTION_NAMES[kind])
        self._behind, self._line = pg.PlotCurveItem(), pg.PlotCurveItem()
        self._points = pg.ScatterPlotItem(size=6, pen=None)
        for item in (self._behind, self._line, self._points):
            self.addItem(item)
        if kind == "spectrum":
            self._item.setXRange(0.0, HIGHEST, padding=0.0)
        self.use_theme(theme)

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self.setBackground(theme.raised)
        colour_axes(self._item, theme)
        below, left = texts.MOTION_AXES[self.kind]
        self._item.setLabel("bottom", below, color=theme.text)
        self._item.setLabel("left", left, color=theme.text)
        self._line.setPen(pg.mkPen(theme.lines[1], width=1))
        self._behind.setPen(pg.mkPen(theme.faint, width=3))
        self._points.setBrush(pg.mkBrush(theme.lines[2]))

    def begin_sine(self, omega: float, time: float) -> None:
        """Strobe the motion at the circular frequency `omega` [rad/s] of the base motion, from the bench time `time`
        [s] on; without effect if this sine is being strobed.
        """
        if omega != self.omega:
            self.omega, self._since = omega, time

    def end_sine(self) -> None:
        """End the strobing; the points belong to a motion that has ended."""
        self.omega = None
        self._points.setData([], [])

    def forget(self) -> None:
        """Clear for a new run."""
        self.omega, self._model, self._run = None, np.zeros((0, 3)), 0
        for item in (self._behind, self._line, self._points):
            item.setData([], [])

    def add(self, estimate: TwinEstimate) -> None:
        """Append a part of the live model's motion."""
        if estimate.run != self._run:
            # each arming begins its time anew
            self._run, self._model = estimate.run, np.zeros((0, 3))
            self._behind.setData([], [])
        if self.kind == "phase" and len(estimate.trace):
            joined = np.concatenate((self._model, estimate.trace[:, (_T, _U1, _U2)]))
            self._model = joined[joined[:, 0] > joined[-1, 0] - MODELLED]

    def draw(self, ring: Ring) -> None:
        """Draw the motion in the buffer."""
        time, low, high = ring.newest_bins(SECONDS[self.kind])
        drift = 1e3 * 0.5 * (low[:, _DRIFT].astype(np.float64) + high[:, _DRIFT])
        known = np.isfinite(drift)
        time, drift = time[known], drift[known]
        if time.size < 64:
            return
        if self.kind == "spectrum":
            self._line.setData(*amplitude_spectrum(time, drift))
            return
        speed = np.gradient(np.convolve(drift, SMOOTH, "same"), time)
        if self.kind == "phase":
            self._line.setData(drift[3:-3], speed[3:-3])
            if len(self._model) > 2:
                model = 1e3 * (self._model[:, 2] - self._model[:, 1])
                self._behind.setData(model, np.gradient(model, self._model[:, 0]))
        elif self.omega is not None:
            inner = slice(3 + int(np.searchsorted(time[3:-3], self._since)), -3)
            if time[inner].size > 1:
                section = stroboscopic(time[inner], np.column_stack((drift, speed))[inner], self.omega)
                self._points.setData(section[:, 0], section[:, 1])
