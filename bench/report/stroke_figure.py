# pyright: reportUnknownMemberType=false
"""A record before and after it was made to fit the table: histories on the left, response spectra on the right.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.report.style import BLUE, GREY, PALE, VERMILLION, new_figure, set_grid, ticks_1_2_5

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

WIDTH, HEIGHT = 11.0, 6.0
"""Inches."""

COLOURS = (GREY, BLUE, VERMILLION)
"""Of the motion before the fit, and of the fits."""


@dataclass(frozen=True, eq=False)
class History:
    """A motion of the table: time [s], acceleration [m/s2], velocity [m/s], displacement [m], all of shape (n,)."""

    name: str
    time: Array
    acceleration: Array
    velocity: Array
    displacement: Array


@dataclass(frozen=True, eq=False)
class Spectra:
    """Pseudo-accelerations [m/s2], one array for each history, at `periods` [s]; `own` periods [s] are marked."""

    periods: Array
    values: Sequence[Array]
    own: Array


def stroke_figure(title: str, histories: Sequence[History], spectra: Spectra, reach: tuple[float, float]) -> "Figure":
    """The first of `histories` is the one before the fit; `reach` is displacement [m] and velocity [m/s] allowed.

    Returns a figure that belongs to no window.
    """
    figure = new_figure(WIDTH, HEIGHT)
    grid = figure.add_gridspec(6, 2, width_ratios=[3.0, 2.0])
    panels = [figure.add_subplot(grid[2 * k : 2 * k + 2, 0]) for k in range(3)]
    for history, colour in zip(histories, COLOURS, strict=False):
        series = (history.acceleration, history.velocity, 1e3 * history.displacement)
        for panel, values in zip(panels, series, strict=True):
            panel.plot(history.time, values, color=colour, linewidth=0.8, label=history.name)
    for panel, label, limit in zip(
        panels, ("a  [m/s²]", "v  [m/s]", "d  [mm]"), (None, reach[1], 1e3 * reach[0]), strict=True
    ):
        panel.set_ylabel(label)
        panel.set_xlim(histories[0].time[0], histories[0].time[-1])
        set_grid(panel)
        for sign in (-1.0, 1.0) if limit is not None else ():
            panel.axhline(sign * (limit or 0.0), color=GREY, linewidth=0.8, linestyle=":")
    panels[0].set_title(title, loc="left", fontsize=9)
    panels[-1].set_xlabel("time on the record's clock  [s]")
    _draw_spectra(figure.add_subplot(grid[:3, 1]), figure.add_subplot(grid[3:, 1]), spectra)
    figure.legend(handles=panels[0].lines, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure


def _draw_spectra(upper: "Axes", lower: "Axes", spectra: Spectra) -> None:
    before = spectra.values[0]
    for k, (values, colour) in enumerate(zip(spectra.values, COLOURS, strict=False)):
        upper.plot(spectra.periods, values, color=colour, linewidth=1.1)
        if k:
            lower.plot(spectra.periods, 100.0 * (values / before - 1.0), color=colour, linewidth=1.1)
    for panel in (upper, lower):
        panel.set_xscale("log")
        ticks_1_2_5(panel.xaxis)
        set_grid(panel)
        for period in spectra.own:
            panel.axvline(float(period), color=PALE, linewidth=2.5, zorder=0.5)
    upper.set_ylim(bottom=0.0)
    upper.set_ylabel("pseudo-acceleration  [m/s²]", fontsize=8)
    lower.set_ylabel("change  [%]", fontsize=8)
    lower.set_xlabel("period  [s]")
