# pyright: reportUnknownMemberType=false
"""Measured gains, table motions and drifts under earthquake records, as in Figs. 7 to 9 of the paper."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.figures.style import BLACK, BLUE, GREY, SKY, VERMILLION, add_legend, new_figure, set_grid
from bench.figures.summary import PointLike, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

COLUMNS, WIDTH, ROW, LEGEND = 3, 3.4, 2.7, 0.9
"""Gain figure: panels per row; width and height of a panel and height of the legend [inch]."""

GAIN_HEADROOM = 1.15

SHIFT = 0.006
"""Horizontal offset of the prediction for the achieved motion from the measured point, as a fraction of the panel's
width.
"""

HISTORY_WIDTH, HISTORY_ROW, HISTORY_LEGEND = 8.5, 1.55, 0.8
"""Dimensions of a figure of histories [inch]: width, height of a row, and height of legend and axis."""

HISTORY_HEADROOM = 1.1


@dataclass(frozen=True, eq=False)
class MotionPicture:
    """Accelerations of the table [m/s2] for a record, at intervals of `dt` [s]: `asked` is the requested one,
    `achieved` the measured one with the bare frame.
    """

    name: str
    dt: float
    asked: Array
    achieved: Array


@dataclass(frozen=True, eq=False)
class DriftPicture:
    """Drift [m] under one record: measured at intervals of `dt` [s], predicted at intervals of `predicted_dt` [s].
    `beta` is None for the bare frame.
    """

    name: str
    beta: float | None
    dt: float
    measured: Array
    predicted: Array
    predicted_dt: float


def gain_figure(points: Sequence[PointLike], prediction: Mapping[str, NDArray[Any]]) -> "Figure":
    """Measured and predicted alpha_2 against beta, one panel per record.

    `points` have the fields of an earthquake point; `prediction` has record, beta and alpha_2 under the requested
    motion (NaN where the block topples, marked by a short stroke). A horizontal mark is the prediction for the achieved
    motion, a wide bar the 95 % interval expected for the measured value; a cross near the upper edge marks a point
    without a gain, with its status.
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
        panel.set_ylim(0.0, GAIN_HEADROOM * max(panel.get_ylim()[1] / GAIN_HEADROOM, 1.2))
        set_grid(panel)
    add_legend(figure, panels, min(columns, 3))
    return figure


def motion_figure(motions: Sequence[MotionPicture]) -> "Figure":
    """Requested and achieved table accelerations and their difference: one row per record."""
    figure, panels = _rows(len(motions))
    for panel, motion in zip(panels, motions, strict=False):
        time = motion.dt * np.arange(motion.asked.size)
        panel.plot(time, motion.asked, color=GREY, linewidth=1.8, label="requested")
        panel.plot(time, motion.achieved, color=BLUE, linewidth=0.6, label="achieved, bare frame (as measured)")
        error = motion.achieved - motion.asked
        panel.plot(time, error, color=VERMILLION, linewidth=0.6, label="achieved − requested")
        _dress(panel, motion.name, "$a_g$  [m/s²]", max(_peak(motion.asked), _peak(motion.achieved)))
        panel.set_xlim(0.0, float(time[-1]))
    _finish(figure, panels, len(motions))
    return figure


def drift_figure(drifts: Sequence[DriftPicture]) -> "Figure":
    """Measured and predicted drifts, one row per record: bare frame, and frame with the softest spring for which there
    is a history.
    """
    names = list(dict.fromkeys(drift.name for drift in drifts))
    figure, panels = _rows(len(names))
    for panel, name in zip(panels, names, strict=False):
        bare = [drift for drift in drifts if drift.name == name and drift.beta is None]
        springs = sorted((d for d in drifts if d.name == name and d.beta is not None), key=lambda d: d.beta or 0.0)
        for drift in bare:
            _draw_drift(panel, drift, GREY, 0.9, "bare frame")
        for drift in springs[:1]:
            _draw_drift(panel, drift, VERMILLION, 1.3, "coupled")
        title = name if not springs else rf"{name}, $\beta$ = {springs[0].beta:g}"
        _dress(panel, title, "drift  [mm]", 1e3 * max(_peak(d.measured) for d in (*bare, *springs[:1])))
        panel.set_xlim(0.0, max(d.dt * (d.measured.size - 1) for d in (*bare, *springs[:1])))
    _finish(figure, panels, len(names))
    return figure


def _draw_curve(panel: "Axes", beta: NDArray[Any], alpha_2: NDArray[Any]) -> None:
    panel.plot(beta, alpha_2, color=BLUE, linewidth=1.3, marker=".", ms=3.0, label="predicted, requested motion")
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
            label="predicted to topple, requested motion",
        )


def _draw_points(panel: "Axes", rows: list[dict[str, Any]]) -> None:
    measured = [row for row in rows if row["alpha_2"] is not None]
    left, right = panel.get_xlim()
    shift = SHIFT * (right - left)
    bounded = [row for row in measured if row["alpha_2_low"] is not None]
    if bounded:
        panel.vlines(
            [row["beta"] + shift for row in bounded],
            [row["alpha_2_low"] for row in bounded],
            [row["alpha_2_high"] for row in bounded],
            color=SKY,
            linewidth=4.0,
            zorder=2,
            label="95 % interval expected for the measured value",
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
    upwards = panel.get_xaxis_transform()
    for row in rows:
        if row["alpha_2"] is None:
            panel.plot(row["beta"], 0.93, "X", color=BLACK, ms=6.5, transform=upwards, label="no gain measured")
            word = str(row["status"])
            panel.text(row["beta"], 0.88, word, transform=upwards, fontsize=6.5, rotation=90, ha="center", va="top")


def _draw_drift(panel: "Axes", drift: DriftPicture, colour: str, width: float, name: str) -> None:
    time = drift.dt * np.arange(drift.measured.size)
    panel.plot(time, 1e3 * drift.measured, color=colour, linewidth=width, label=f"{name}, measured")
    if not drift.predicted.size:
        return
    predicted = drift.predicted_dt * np.arange(drift.predicted.size)
    panel.plot(
        predicted,
        1e3 * drift.predicted,
        color="black" if name == "coupled" else BLUE,
        linewidth=0.6,
        linestyle=(0, (3, 2)),
        label=f"{name}, predicted for the achieved motion",
    )


def _rows(count: int) -> "tuple[Figure, list[Axes]]":
    figure = new_figure(HISTORY_WIDTH, HISTORY_ROW * max(count, 1) + HISTORY_LEGEND)
    return figure, list(figure.subplots(max(count, 1), 1, squeeze=False).flat)


def _dress(panel: "Axes", title: str, label: str, peak: float) -> None:
    panel.set_title(title, loc="left", fontsize=8, pad=3.0)
    panel.set_ylabel(label, fontsize=8)
    panel.tick_params(labelsize=8)
    panel.set_ylim(-HISTORY_HEADROOM * peak, HISTORY_HEADROOM * peak)
    set_grid(panel)


def _finish(figure: "Figure", panels: "Sequence[Axes]", count: int) -> None:
    if count == 0:
        panels[0].set_axis_off()
        panels[0].text(0.5, 0.5, "no record was played", ha="center", va="center")
        return
    panels[-1].set_xlabel(r"$t$  [s]", fontsize=8)
    # from all panels, because curves may be missing for a record that toppled the block or was not played
    labels = {label for panel in panels[:count] for label in panel.get_legend_handles_labels()[1]}
    add_legend(figure, panels[:count], len(labels) if len(labels) < 4 else 2)


def _peak(values: Array) -> float:
    return float(np.nanmax(np.abs(values))) or 1.0
