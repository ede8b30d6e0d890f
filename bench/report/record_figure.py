# pyright: reportUnknownMemberType=false
"""Recorded motions: histories of acceleration, velocity and displacement, and the response spectrum.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.report.style import BLACK, BLUE, GREEN, GREY, VERMILLION, new_figure, set_grid, ticks_1_2_5

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

Array = NDArray[np.float64]

WIDTH, ROW = 9.0, 4.2
"""Inches: width of the figure, height of a record."""

HEADROOM = 1.12
"""Of the greatest value, to the edge of a panel."""

LATE = 0.8
"""Share of a history from which on the value stands before its mark: after it there is no room."""

MOST_POINTS = 4000
"""Points of a history that are drawn: longer ones are drawn as the least and the greatest of as many intervals."""


@dataclass(frozen=True, eq=False)
class RecordPicture:
    """A record: `acceleration` [m/s2], `velocity` [m/s] and `displacement` [m], shape (n,), every `dt` [s].

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


def record_figure(records: Sequence[RecordPicture]) -> "Figure":
    """Draw every record: three histories on the left, its spectrum on the right."""
    figure = new_figure(WIDTH, ROW * len(records))
    # the spectrum's label must not meet the histories
    layout: Any = figure.get_layout_engine()
    layout.set(w_pad=0.1)
    grid = figure.add_gridspec(len(records), 1)
    for row, record in enumerate(records):
        _draw(figure.add_subfigure(grid[row, 0]), record)
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
    """A history, with a mark and the value at its largest sample."""
    time, shown = _thinned(values, dt)
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


def _thinned(values: Array, dt: float) -> tuple[Array, Array]:
    """What is drawn of a history: no peak is lost."""
    time: Array = dt * np.arange(values.size, dtype=np.float64)
    if values.size <= MOST_POINTS:
        return time, values
    starts = np.linspace(0, values.size, MOST_POINTS // 2, endpoint=False).astype(np.intp)
    ends = np.stack((np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)), axis=1)
    return np.repeat(time[starts], 2), ends.ravel()
