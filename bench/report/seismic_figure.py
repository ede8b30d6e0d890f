# pyright: reportUnknownMemberType=false
"""Gain curves under earthquake records as in Fig. 8(a) and 9(a) of the paper: gain against stiffness.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.report.history_figure import MILLI, centre
from bench.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

Floats = NDArray[np.float64]

DRIFT_WIDTH, DRIFT_ROW, MARGIN = 7.5, 1.25, 0.9
"""Inches: width of the figure, height of a record, and what legend and axis take."""


@dataclass(frozen=True, eq=False)
class ModelDrift:
    """Drift [m] of the bare and the coupled frame under one record at `time` [s], shape (n,); NaN after a fall."""

    name: str
    time: Floats
    bare: Floats
    coupled: Floats


def model_drift_figure(drifts: Sequence[ModelDrift]) -> "Figure":
    """A row per record. Returns a figure that belongs to no window."""
    figure = new_figure(DRIFT_WIDTH, DRIFT_ROW * len(drifts) + MARGIN)
    entries: dict[str, Line2D] = {}
    for k, drift in enumerate(drifts):
        panel = figure.add_subplot(len(drifts), 1, k + 1)
        panel.plot(drift.time, MILLI * drift.bare, color=GREY, linewidth=0.7, label="bare frame")
        panel.plot(drift.time, MILLI * drift.coupled, color=BLUE, linewidth=1.1, label="coupled frame")
        lost = np.flatnonzero(~np.isfinite(drift.coupled))
        if lost.size:
            end = float(drift.time[lost[0]])
            panel.axvline(end, color=PURPLE, linewidth=1.2, linestyle=":", label="block overturned")
        centre(panel, MILLI * drift.bare)
        panel.set_xlim(float(drift.time[0]), float(drift.time[-1]))
        panel.set_title(drift.name, loc="left", fontsize=8, pad=3.0)
        panel.set_ylabel("drift  [mm]", fontsize=8)
        panel.tick_params(labelsize=8)
        set_grid(panel)
        if k == len(drifts) - 1:
            panel.set_xlabel(r"$t$  [s]", fontsize=8)
        for line in panel.lines:
            entries.setdefault(str(line.get_label()), line)
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure


LETTERS = 100
"""That fit in a line of the legend, its samples of lines counted as eight."""

COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
DASHES = ("-", "--", "-.", ":")
MARKERS = "osD^v<>"

BAND_SHADE = 0.15

WIDTH, HEIGHT, ROW = 7.5, 6.4, 0.16
"""Inches: width, height without the strip of the toppled, and what each record adds to that."""


@dataclass(frozen=True, eq=False)
class GainCurve:
    """One record: `beta`, `alpha_1` and `alpha_2`, shape (n,), ascending in beta; NaN where the run did not end by
    itself, which `toppled`, shape (n,), explains. `band`: where 95 % of alpha_2 begin and end, shape (n,) each.
    """

    name: str
    beta: NDArray[np.float64]
    alpha_1: NDArray[np.float64]
    alpha_2: NDArray[np.float64]
    toppled: NDArray[np.bool_]
    band: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None


def seismic_figure(curves: Sequence[GainCurve], band: str) -> "Figure":
    """alpha_2 and alpha_1 over the stiffness, and a strip of the stiffnesses at which the block toppled.

    `band` says in words within which band the records are. Returns a figure that belongs to no window.
    """
    strip = ROW * len(curves) + 0.25
    figure = new_figure(WIDTH, HEIGHT + strip)
    upper, lower, fallen = figure.subplots(3, 1, sharex=True, height_ratios=[4.0, 2.0, strip])
    for k, curve in enumerate(curves):
        colour, dash = COLOURS[k % len(COLOURS)], DASHES[k // len(COLOURS) % len(DASHES)]
        marker = MARKERS[k % len(MARKERS)]
        for panel, gain in ((upper, curve.alpha_2), (lower, curve.alpha_1)):
            panel.plot(
                curve.beta, gain, color=colour, linestyle=dash, linewidth=1.2, marker=marker, ms=2.5, label=curve.name
            )
        if curve.band is not None:
            upper.fill_between(curve.beta, *curve.band, color=colour, alpha=BAND_SHADE, linewidth=0.0)
        where = curve.beta[curve.toppled]
        fallen.plot(where, np.full(where.size, k), color=colour, linestyle="", marker="x", ms=4.0)
    _finish(upper, r"$\alpha_2$")
    _finish(lower, r"$\alpha_1$")
    fallen.set_yticks(range(len(curves)), [curve.name for curve in curves], fontsize=7)
    fallen.set_ylim(len(curves) - 0.5, -0.5)
    fallen.set_ylabel("toppled", fontsize=8)
    fallen.set_xlabel(r"$\beta$")
    set_grid(fallen)
    upper.set_title(f"table's band: {band}", loc="right", fontsize=9)
    # long names take fewer columns
    columns = min(4, max(1, LETTERS // (max(len(curve.name) for curve in curves) + 8)))
    figure.legend(
        handles=upper.lines[: len(curves)], loc="outside lower center", ncols=columns, fontsize=8, frameon=False
    )
    return figure


def _finish(panel: "Axes", label: str) -> None:
    panel.axhline(1.0, color=GREY, linewidth=0.8, linestyle="--")
    panel.set_ylabel(label)
    panel.set_ylim(bottom=0.0)
    set_grid(panel)
