# pyright: reportUnknownMemberType=false
"""Gain curves under earthquake records as in Fig. 8(a) and 9(a) of the paper: predicted and measured, a panel each.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Mapping, Sequence
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.report.rows import PointLike, plain
from bench.report.style import BLACK, BLUE, GREY, SKY, VERMILLION, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS, WIDTH, ROW, LEGEND = 3, 3.4, 2.7, 0.9
"""Panels in a row, and inches: width and height of a panel, height of the legend."""

HEADROOM = 1.15
ASIDE = 0.006
"""How far the prediction for the achieved motion stands beside the measured point, in the width of a panel."""


def gain_figure(points: Sequence[PointLike], prediction: Mapping[str, NDArray[Any]]) -> "Figure":
    """A panel per record: alpha_2 over beta. Returns a figure that belongs to no window.

    `points` have the fields of an earthquake point; `prediction` has record, beta, alpha_2 (NaN where it topples) under
    the asked motion. An interval holds 95 % of what may be measured; a toppled block is a cross at the upper edge.
    """
    rows = plain(points)
    names = list(dict.fromkeys([str(name) for name in prediction["record"]] + [str(row["record"]) for row in rows]))
    columns = max(min(COLUMNS, len(names)), 2)
    lines = max(ceil(len(names) / columns), 1)
    figure = new_figure(columns * WIDTH, lines * ROW + LEGEND)
    panels: list[Axes] = list(figure.subplots(lines, columns, squeeze=False).flat)
    for panel in panels[len(names) :]:
        panel.set_axis_off()
    for panel, name in zip(panels, names, strict=False):
        here = prediction["record"] == name
        _draw_curve(panel, prediction["beta"][here], prediction["alpha_2"][here])
        _draw_points(panel, [row for row in rows if row["record"] == name])
        panel.axhline(1.0, color=GREY, linestyle="-.", linewidth=0.9, zorder=1, label=r"$\alpha_2$ = 1: no effect")
        panel.set_title(name, loc="left", fontsize=9)
        panel.set_xlabel(r"$\beta$", fontsize=9)
        panel.set_ylabel(r"$\alpha_2$", fontsize=9)
        panel.set_ylim(0.0, HEADROOM * max(panel.get_ylim()[1] / HEADROOM, 1.2))
        set_grid(panel)
    _add_legend(figure, panels)
    return figure


def _draw_curve(panel: "Axes", beta: NDArray[Any], alpha_2: NDArray[Any]) -> None:
    panel.plot(beta, alpha_2, color=BLUE, linewidth=1.3, marker=".", ms=3.0, label="predicted, asked motion")
    toppled = beta[np.isnan(alpha_2)]
    if toppled.size:
        panel.plot(
            toppled,
            np.full(toppled.size, 0.96),
            "|",
            color=BLUE,
            ms=6.0,
            markeredgewidth=1.2,
            transform=panel.get_xaxis_transform(),
            label="predicted to topple, asked motion",
        )


def _draw_points(panel: "Axes", rows: list[dict[str, Any]]) -> None:
    measured = [row for row in rows if row["alpha_2"] is not None]
    left, right = panel.get_xlim()
    shift = ASIDE * (right - left)
    beside = [row for row in measured if row["alpha_2_low"] is not None]
    if beside:
        panel.vlines(
            [row["beta"] + shift for row in beside],
            [row["alpha_2_low"] for row in beside],
            [row["alpha_2_high"] for row in beside],
            color=SKY,
            linewidth=4.0,
            zorder=2,
            label="95 % of what may be measured",
        )
    known = [row for row in measured if row["alpha_2_predicted"] is not None]
    if known:
        panel.plot(
            [row["beta"] + shift for row in known],
            [row["alpha_2_predicted"] for row in known],
            "_",
            color=BLUE,
            ms=9.0,
            markeredgewidth=1.8,
            zorder=3,
            label="predicted, achieved motion",
        )
    if measured:
        panel.errorbar(
            [row["beta"] for row in measured],
            [row["alpha_2"] for row in measured],
            yerr=[row["alpha_2_uncertainty"] or 0.0 for row in measured],
            fmt="o--",
            color=VERMILLION,
            markersize=5.0,
            markeredgecolor="white",
            markeredgewidth=0.6,
            linewidth=0.9,
            elinewidth=1.1,
            capsize=2.5,
            zorder=4,
            label="measured (k = 2)",
        )
    lost = [row for row in rows if row["alpha_2"] is None]
    if lost:
        upwards = panel.get_xaxis_transform()
        for row in lost:
            panel.plot(row["beta"], 0.93, "X", color=BLACK, ms=6.5, transform=upwards, label="no gain measured")
            word = str(row["status"])
            panel.text(row["beta"], 0.88, word, transform=upwards, fontsize=6.5, rotation=90, ha="center", va="top")


def _add_legend(figure: "Figure", panels: Sequence["Axes"]) -> None:
    entries: dict[str, Any] = {}
    for panel in panels:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=3, fontsize=8, frameon=False)
