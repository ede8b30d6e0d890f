# pyright: reportUnknownMemberType=false
"""Gain under earthquake records against the lower end of the table's band, a panel for each record.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.report.seismic_figure import COLOURS, MARKERS
from bench.report.style import GREY, PALE, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS, WIDTH, ROW = 3, 9.5, 2.5
"""Panels in a row, and inches: width of the figure, height of a row."""

FALLEN, LOWER, HEADROOM = 0.96, 0.06, 0.3
"""In heights of the panel: marks of a toppled block, those of each further stiffness below them, and their room."""


@dataclass(frozen=True, eq=False)
class BandCurve:
    """One record at one stiffness: `corner` [Hz] and `alpha_2`, shape (n,), ascending; NaN where the run did not end
    by itself, which `toppled`, shape (n,), explains.
    """

    name: str
    beta: float
    corner: NDArray[np.float64]
    alpha_2: NDArray[np.float64]
    toppled: NDArray[np.bool_]


def band_figure(curves: Sequence[BandCurve], modes: Sequence[float], upper: float) -> "Figure":
    """alpha_2 over the lower end of the band, whose `upper` end [Hz] stays; `modes` [Hz] of the bare frame are marked.

    Returns a figure that belongs to no window.
    """
    names = list(dict.fromkeys(curve.name for curve in curves))
    betas = sorted({curve.beta for curve in curves})
    rows = ceil(len(names) / COLUMNS)
    figure = new_figure(WIDTH, ROW * rows + 0.6)
    panels = figure.subplots(rows, COLUMNS, sharex=True, squeeze=False)
    for panel, name in zip(panels.flat, names, strict=False):
        _draw(panel, [curve for curve in curves if curve.name == name], betas, modes)
        panel.set_title(name, loc="left", fontsize=9)
    for panel in panels.flat[len(names) :]:
        panel.set_axis_off()
    for panel in panels[:, 0]:
        panel.set_ylabel(r"$\alpha_2$")
    for panel in panels.flat[max(len(names) - COLUMNS, 0) : len(names)]:
        panel.set_xlabel(f"lower end of the band  [Hz]  (upper end {upper:g} Hz)", fontsize=8)
        panel.tick_params(labelbottom=True)
    lines = [line for line in panels.flat[0].lines if not str(line.get_label()).startswith("_")]
    figure.legend(
        handles=lines,
        title="crosses: toppled",
        title_fontsize=8,
        loc="outside lower center",
        ncols=len(betas),
        fontsize=8,
        frameon=False,
    )
    return figure


def _draw(panel: "Axes", curves: Sequence[BandCurve], betas: Sequence[float], modes: Sequence[float]) -> None:
    for curve in curves:
        k = betas.index(curve.beta)
        colour, marker = COLOURS[k % len(COLOURS)], MARKERS[k % len(MARKERS)]
        label = rf"$\beta$ = {curve.beta:g}"
        panel.plot(curve.corner, curve.alpha_2, color=colour, linewidth=1.2, marker=marker, ms=3.0, label=label)
        where = curve.corner[curve.toppled]
        heights = np.full(where.size, FALLEN - LOWER * k)
        panel.plot(where, heights, "x", color=colour, ms=4.0, transform=panel.get_xaxis_transform())
    panel.axhline(1.0, color=GREY, linewidth=0.8, linestyle="--")
    for mode in modes:
        panel.axvline(mode, color=PALE, linewidth=2.5, zorder=0.5)
    known = [float(np.nanmax(curve.alpha_2)) for curve in curves if np.isfinite(curve.alpha_2).any()]
    panel.set_ylim(0.0, (1.0 + HEADROOM) * max(1.0, *known))
    set_grid(panel)
