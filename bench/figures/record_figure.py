# pyright: reportUnknownMemberType=false
"""Earthquake records: time histories and response spectra, as recorded and as fitted to the table's stroke."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    HEADROOM,
    PALE,
    VERMILLION,
    add_legend,
    new_figure,
    set_grid,
    ticks_1_2_5,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

Array = NDArray[np.float64]

WIDTH, ROW = 9.0, 4.2
"""Width of the figure and height per record [inch]."""

LATE = 0.8
"""Position in a history, as a fraction of its length, beyond which the peak value is printed to the left of its
mark.
"""

MOST_POINTS = 4000
"""Largest number of drawn points; longer histories are drawn as the minima and maxima of equal intervals."""

FIT_WIDTH, FIT_HEIGHT = 11.0, 6.0
"""Width and height of the figure of a fit to the stroke [inch]."""

FIT_COLOURS = (GREY, BLUE, VERMILLION)
"""Colours of the motion before the fit, and of the fitted motions."""


@dataclass(frozen=True, eq=False)
class RecordPicture:
    """A record: `acceleration` [m/s2], `velocity` [m/s] and `displacement` [m], each of shape (n,), at intervals of
    `dt` [s].

    `spectrum` is the pseudo-acceleration [m/s2] at `periods` [s] of oscillators with the damping ratio `damping`.
    """

    name: str
    dt: float
    acceleration: Array
    velocity: Array
    displacement: Array
    periods: Array
    spectrum: Array
    damping: float


@dataclass(frozen=True, eq=False)
class History:
    """Table motion: time [s], acceleration [m/s2], velocity [m/s], displacement [m], all of shape (n,)."""

    name: str
    time: Array
    acceleration: Array
    velocity: Array
    displacement: Array


@dataclass(frozen=True, eq=False)
class Spectra:
    """Response spectra: pseudo-accelerations [m/s2] at `periods` [s], one array for each history.

    `own` contains the natural periods [s] of the frame, drawn as marks.
    """

    periods: Array
    values: Sequence[Array]
    own: Array


def record_figure(records: Sequence[RecordPicture]) -> "Figure":
    """For each record, three time histories on the left and the response spectrum on the right."""
    figure = new_figure(WIDTH, ROW * len(records))
    # keep the spectrum's label clear of the histories
    layout: Any = figure.get_layout_engine()
    layout.set(w_pad=0.1)
    grid = figure.add_gridspec(len(records), 1)
    for row, record in enumerate(records):
        _draw(figure.add_subfigure(grid[row, 0]), record)
    return figure


def stroke_figure(title: str, histories: Sequence[History], spectra: Spectra, reach: tuple[float, float]) -> "Figure":
    """Histories on the left, response spectra and their changes on the right. The first of `histories` is the motion
    before the fit; `reach` is the allowed displacement [m] and velocity [m/s].
    """
    figure = new_figure(FIT_WIDTH, FIT_HEIGHT)
    grid = figure.add_gridspec(6, 2, width_ratios=[3.0, 2.0])
    panels = [figure.add_subplot(grid[2 * k : 2 * k + 2, 0]) for k in range(3)]
    for history, colour in zip(histories, FIT_COLOURS, strict=False):
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
    panels[-1].set_xlabel("time in the record  [s]")
    _draw_spectra(figure.add_subplot(grid[:3, 1]), figure.add_subplot(grid[3:, 1]), spectra)
    add_legend(figure, panels[:1], 3)
    return figure


def _draw(part: "SubFigure", record: RecordPicture) -> None:
    grid = part.add_gridspec(3, 2, width_ratios=(1.9, 1.0))
    histories = (
        (record.acceleration, BLACK, "$a_g$  [m/s²]"),
        (100.0 * record.velocity, BLUE, r"$v_g$  [cm/s]"),
        (100.0 * record.displacement, GREEN, r"$d_g$  [cm]"),
    )
    for row, (values, colour, label) in enumerate(histories):
        panel = part.add_subplot(grid[row, 0])
        _draw_history(panel, values, record.dt, colour)
        panel.set_ylabel(label, fontsize=9)
        if row == 0:
            panel.set_title(record.name, loc="left", fontsize=9)
        if row < 2:
            panel.tick_params(labelbottom=False)
        else:
            panel.set_xlabel(r"$t$  [s]", fontsize=9)
    spectrum = part.add_subplot(grid[:, 1])
    spectrum.plot(record.periods, record.spectrum, color=VERMILLION, linewidth=1.3)
    spectrum.set_xscale("log")
    ticks_1_2_5(spectrum.xaxis)
    spectrum.tick_params(axis="x", labelsize=7)
    spectrum.set_xlim(float(record.periods[0]), float(record.periods[-1]))
    spectrum.set_ylim(0.0, HEADROOM * float(record.spectrum.max()))
    spectrum.set_title(f"pseudo-acceleration, {100.0 * record.damping:g} % damping", loc="right", fontsize=8)
    spectrum.set_xlabel(r"$T$  [s]", fontsize=9)
    spectrum.set_ylabel("$S_a$  [m/s²]", fontsize=9)
    set_grid(spectrum)


def _draw_history(panel: "Axes", values: Array, dt: float, colour: str) -> None:
    """Draws a history with a mark and the value at its peak."""
    time, shown = _drawn_points(values, dt)
    panel.plot(time, shown, color=colour, linewidth=0.7)
    at = int(np.abs(values).argmax())
    late = at > LATE * values.size
    panel.plot(dt * at, values[at], marker="o", markersize=4, color=GREY, fillstyle="none")
    panel.annotate(
        f"{values[at]:.4g}".replace("-", "−"),
        (dt * at, float(values[at])),
        xytext=(-6 if late else 6, 0),
        textcoords="offset points",
        horizontalalignment="right" if late else "left",
        verticalalignment="top" if values[at] > 0.0 else "bottom",
        fontsize=8,
        color=GREY,
    )
    reach = HEADROOM * abs(float(values[at])) or 1.0
    panel.set_ylim(-reach, reach)
    panel.set_xlim(0.0, dt * (values.size - 1))
    set_grid(panel)


def _drawn_points(values: Array, dt: float) -> tuple[Array, Array]:
    """Time and values of the drawn points, shape (k,); keeps the extremes of every interval."""
    time: Array = dt * np.arange(values.size, dtype=np.float64)
    if values.size <= MOST_POINTS:
        return time, values
    starts = np.linspace(0, values.size, MOST_POINTS // 2, endpoint=False).astype(np.intp)
    ends = np.stack((np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)), axis=1)
    return np.repeat(time[starts], 2), ends.ravel()


def _draw_spectra(upper: "Axes", lower: "Axes", spectra: Spectra) -> None:
    before = spectra.values[0]
    for k, (values, colour) in enumerate(zip(spectra.values, FIT_COLOURS, strict=False)):
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
