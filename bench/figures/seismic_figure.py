# pyright: reportUnknownMemberType=false
"""Predicted gains and drifts under earthquake records, as in Figs. 8 and 9 of the paper."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.figures.style import (
    BLUE,
    GREY,
    MARKERS,
    MILLI,
    PALE,
    PURPLE,
    SERIES,
    add_legend,
    centre,
    new_figure,
    set_grid,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

DRIFT_WIDTH, DRIFT_ROW, MARGIN = 7.5, 1.25, 0.9
"""Width of the figure, height per record, and height of legend and axis [inch]."""

WIDTH, HEIGHT, ROW = 7.5, 6.4, 0.16
"""Width of the figure, its height without the strip of toppled blocks, and height of the strip per record [inch]."""

DASHES = ("-", "--", "-.", ":")
BAND_SHADE = 0.15

LETTERS = 100
"""Maximum length of a legend line [characters]; the drawn sample of the curve counts as eight."""

PANELS, PANELS_WIDTH, PANEL_HEIGHT = 3, 9.5, 2.5
"""Panels per row; width of the figure and height of a row [inch]."""

TOPPLED, LOWER, HEADROOM = 0.96, 0.06, 0.3
"""Height of the marks for a toppled block and their offset for each further stiffness, relative to the height of the
panel, and the space reserved for them, relative to the largest gain.
"""


@dataclass(frozen=True, eq=False)
class ModelDrift:
    """Drift [m] of the bare and the coupled frame under one record at `time` [s], shape (n,); NaN after a fall."""

    name: str
    time: Floats
    bare: Floats
    coupled: Floats


@dataclass(frozen=True, eq=False)
class GainCurve:
    """Gains against stiffness under one record; each array has shape (n,), in ascending order of `beta`.

    Gains are NaN where the run ended early; `toppled` is True where the block fell. `band` contains the lower and the
    upper end of the 95 % interval of alpha_2.
    """

    name: str
    beta: Floats
    alpha_1: Floats
    alpha_2: Floats
    toppled: NDArray[np.bool_]
    band: tuple[Floats, Floats] | None = None


@dataclass(frozen=True, eq=False)
class BandCurve:
    """alpha_2 under one record at one stiffness against `corner`, the lower end of the frequency band [Hz], in
    ascending order; each of shape (n,).

    NaN where the run ended early; `toppled` is True where the block fell.
    """

    name: str
    beta: float
    corner: Floats
    alpha_2: Floats
    toppled: NDArray[np.bool_]


def model_drift_figure(drifts: Sequence[ModelDrift]) -> "Figure":
    """Predicted drifts of the bare and the coupled frame, one row per record."""
    figure = new_figure(DRIFT_WIDTH, DRIFT_ROW * len(drifts) + MARGIN)
    panels = [figure.add_subplot(len(drifts), 1, k + 1) for k in range(len(drifts))]
    for panel, drift in zip(panels, drifts, strict=True):
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
    for panel in panels[-1:]:
        panel.set_xlabel(r"$t$  [s]", fontsize=8)
    add_legend(figure, panels, 3)
    return figure


def seismic_figure(curves: Sequence[GainCurve], band: str) -> "Figure":
    """alpha_2 and alpha_1 against stiffness, and a strip that marks the stiffnesses at which the block toppled.

    `band` describes the frequency band of the records.
    """
    strip = ROW * len(curves) + 0.25
    figure = new_figure(WIDTH, HEIGHT + strip)
    upper, lower, toppled = figure.subplots(3, 1, sharex=True, height_ratios=[4.0, 2.0, strip])
    for k, curve in enumerate(curves):
        colour, dash = SERIES[k % len(SERIES)], DASHES[k // len(SERIES) % len(DASHES)]
        marker = MARKERS[k % len(MARKERS)]
        for panel, gain in ((upper, curve.alpha_2), (lower, curve.alpha_1)):
            panel.plot(
                curve.beta, gain, color=colour, linestyle=dash, linewidth=1.2, marker=marker, ms=2.5, label=curve.name
            )
        if curve.band is not None:
            upper.fill_between(curve.beta, *curve.band, color=colour, alpha=BAND_SHADE, linewidth=0.0)
        where = curve.beta[curve.toppled]
        toppled.plot(where, np.full(where.size, k), color=colour, linestyle="", marker="x", ms=4.0)
    for panel, label in ((upper, r"$\alpha_2$"), (lower, r"$\alpha_1$")):
        panel.axhline(1.0, color=GREY, linewidth=0.8, linestyle="--")
        panel.set_ylabel(label)
        panel.set_ylim(bottom=0.0)
        set_grid(panel)
    toppled.set_yticks(range(len(curves)), [curve.name for curve in curves], fontsize=7)
    toppled.set_ylim(len(curves) - 0.5, -0.5)
    toppled.set_ylabel("toppled", fontsize=8)
    toppled.set_xlabel(r"$\beta$")
    set_grid(toppled)
    upper.set_title(f"table's band: {band}", loc="right", fontsize=9)
    # long names allow fewer columns
    columns = min(4, max(1, LETTERS // (max(len(curve.name) for curve in curves) + 8)))
    figure.legend(
        handles=upper.lines[: len(curves)], loc="outside lower center", ncols=columns, fontsize=8, frameon=False
    )
    return figure


def band_figure(curves: Sequence[BandCurve], modes: Sequence[float], upper: float) -> "Figure":
    """alpha_2 against the lower end of the table's band, one panel per record.

    The `upper` end [Hz] of the band is constant. Lines mark the `modes` [Hz] of the bare frame, crosses
    the bands in which the block topples.
    """
    names = list(dict.fromkeys(curve.name for curve in curves))
    betas = sorted({curve.beta for curve in curves})
    rows = ceil(len(names) / PANELS)
    figure = new_figure(PANELS_WIDTH, PANEL_HEIGHT * rows + 0.6)
    panels = figure.subplots(rows, PANELS, sharex=True, squeeze=False)
    for panel, name in zip(panels.flat, names, strict=False):
        _draw_band(panel, [curve for curve in curves if curve.name == name], betas, modes)
        panel.set_title(name, loc="left", fontsize=9)
    for panel in panels.flat[len(names) :]:
        panel.set_axis_off()
    for panel in panels[:, 0]:
        panel.set_ylabel(r"$\alpha_2$")
    for panel in panels.flat[max(len(names) - PANELS, 0) : len(names)]:
        panel.set_xlabel(f"lower end of the band  [Hz]  (upper end {upper:g} Hz)", fontsize=8)
        panel.tick_params(labelbottom=True)
    add_legend(figure, panels.flat[:1], len(betas), title="crosses: toppled", title_fontsize=8)
    return figure


def _draw_band(panel: "Axes", curves: Sequence[BandCurve], betas: Sequence[float], modes: Sequence[float]) -> None:
    for curve in curves:
        k = betas.index(curve.beta)
        colour, marker = SERIES[k % len(SERIES)], MARKERS[k % len(MARKERS)]
        label = rf"$\beta$ = {curve.beta:g}"
        panel.plot(curve.corner, curve.alpha_2, color=colour, linewidth=1.2, marker=marker, ms=3.0, label=label)
        where = curve.corner[curve.toppled]
        heights = np.full(where.size, TOPPLED - LOWER * k)
        panel.plot(where, heights, "x", color=colour, ms=4.0, transform=panel.get_xaxis_transform())
    panel.axhline(1.0, color=GREY, linewidth=0.8, linestyle="--")
    for mode in modes:
        panel.axvline(mode, color=PALE, linewidth=2.5, zorder=0.5)
    known = [float(np.nanmax(curve.alpha_2)) for curve in curves if np.isfinite(curve.alpha_2).any()]
    panel.set_ylim(0.0, (1.0 + HEADROOM) * max(1.0, *known))
    set_grid(panel)
