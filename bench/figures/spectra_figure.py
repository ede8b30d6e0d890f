# pyright: reportUnknownMemberType=false
"""Gain spectra as in Fig. 6 of the paper: predicted and measured alpha_2 against frequency, one panel per stiffness."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.figures.style import BLACK, BLUE, GREEN, GREY, PURPLE, VERMILLION, new_figure, set_grid, ticks_1_2_5
from bench.figures.summary import PointLike, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 3
PANEL = (3.6, 3.3)
MARGIN = 1.1
"""Width and height of a panel, and height of title and legend [inch]."""

MARKERS = {
    "steady": ("o", VERMILLION),
    "held": ("^", VERMILLION),
    "modulated": ("D", PURPLE),
    "resting": ("s", GREEN),
    "overturned": ("X", BLACK),
}

BAND = "from the uncertainty of the specimen (k = 2)"
BAND_SHADE = 0.18

LEGEND = (
    "predicted, block rocking",
    "predicted, block rocking, unstable",
    "predicted, block resting",
    BAND,
    r"$\alpha_2$ = 1: the block has no effect",
    *(f"measured, {status}" for status in MARKERS),
    "no gain measured",
    "disagrees with the prediction",
)
"""Labels in the order of the legend."""

HEADROOM = 1.35
FLOOR, CEILING = 0.01, 20.0
"""Limits beyond which predicted gains do not extend the axis."""

Prediction = Mapping[str, NDArray[Any]]
"""Arrays of equal length: omega [rad/s], beta, alpha_2, stable (Booleans), layer (branch: "rocking" or "resting"), and
optionally the band of alpha_2: alpha_2_low, alpha_2_high.
"""


def gain_spectra(points: Sequence[PointLike], prediction: Prediction, *, title: str = "") -> "Figure":
    """Predicted and measured gains on a logarithmic axis against frequency, one panel per stiffness.
    `points` have the fields of a harmonic point. A point without a gain is drawn as a cross near the upper edge, with
    its status.
    """
    rows = plain(points)
    betas = sorted({round(float(beta), 6) for beta in (*prediction["beta"], *(row["beta"] for row in rows))}) or [0.0]
    n_columns = min(COLUMNS, len(betas))
    n_rows = -(-len(betas) // n_columns)
    figure = new_figure(max(2, n_columns) * PANEL[0], n_rows * PANEL[1] + MARGIN)
    axes: list[Axes] = [figure.add_subplot(n_rows, n_columns, k + 1) for k in range(len(betas))]
    limits = _ranges(rows, prediction)
    for panel, beta in zip(axes, betas, strict=True):
        _draw_prediction(panel, _of_beta(prediction, beta))
        _draw_points(panel, [row for row in rows if round(float(row["beta"]), 6) == beta])
        _dress(panel, beta, limits)
    for k, panel in enumerate(axes):
        if k % n_columns == 0:
            panel.set_ylabel(r"gain of the peak drift  $\alpha_2$")
        else:
            panel.tick_params(labelleft=False)
    if title:
        figure.suptitle(title)
    _add_legend(figure, axes, measured=bool(rows))
    return figure


def _of_beta(prediction: Prediction, beta: float) -> dict[str, NDArray[Any]]:
    """Rows of one stiffness, in ascending order of frequency."""
    chosen = np.flatnonzero(np.round(prediction["beta"].astype(np.float64), 6) == beta)
    chosen = chosen[np.argsort(prediction["omega"][chosen], kind="stable")]
    return {name: values[chosen] for name, values in prediction.items()}


def _draw_prediction(panel: "Axes", prediction: Mapping[str, NDArray[Any]]) -> None:
    for branch, colour, dash, width in (("rocking", BLUE, "-", 1.8), ("resting", GREEN, (0, (6, 1.5)), 1.4)):
        rows = prediction["layer"] == branch
        omega, gain = prediction["omega"][rows], prediction["alpha_2"][rows].astype(np.float64)
        stable = prediction["stable"][rows].astype(np.bool_)
        if not omega.size:
            continue
        if {"alpha_2_low", "alpha_2_high"} <= prediction.keys():
            low, high = (prediction[f"alpha_2_{end}"][rows].astype(np.float64) for end in ("low", "high"))
            panel.fill_between(
                omega,
                np.where(stable, low, np.nan),
                np.where(stable, high, np.nan),
                color=colour,
                alpha=BAND_SHADE,
                linewidth=0.0,
                label=BAND,
            )
        # extend an unstable section to its stable neighbours, so that the branch has no gaps
        near = ~stable | np.append(~stable[1:], False) | np.append(False, ~stable[:-1])
        panel.plot(
            omega,
            np.where(stable, gain, np.nan),
            color=colour,
            linestyle=dash,
            linewidth=width,
            marker="." if omega.size == 1 else None,
            label=f"predicted, block {branch}",
        )
        if not stable.all():
            panel.plot(
                omega,
                np.where(near, gain, np.nan),
                color=colour,
                linestyle=(0, (2, 2)),
                linewidth=0.9,
                label=f"predicted, block {branch}, unstable",
            )


def _draw_points(panel: "Axes", rows: list[dict[str, Any]]) -> None:
    for status, (marker, colour) in MARKERS.items():
        measured = [row for row in rows if row["status"] == status and row["alpha_2"] is not None]
        if measured:
            panel.errorbar(
                [row["omega_rad_s"] for row in measured],
                [row["alpha_2"] for row in measured],
                yerr=[row["alpha_2_uncertainty"] or 0.0 for row in measured],
                fmt=marker,
                color=colour,
                markersize=6.5,
                markeredgecolor="white",
                markeredgewidth=0.7,
                elinewidth=1.3,
                capsize=3.5,
                zorder=4,
                label=f"measured, {status}",
            )
    _ring_disagreeing(panel, [row for row in rows if row["agrees"] is False and row["alpha_2"] is not None])
    _draw_lost(panel, [row for row in rows if row["alpha_2"] is None])


def _ring_disagreeing(panel: "Axes", rows: list[dict[str, Any]]) -> None:
    if rows:
        panel.plot(
            [row["omega_rad_s"] for row in rows],
            [row["alpha_2"] for row in rows],
            linestyle="none",
            marker="o",
            markersize=13,
            markerfacecolor="none",
            markeredgecolor=BLACK,
            markeredgewidth=1.0,
            zorder=5,
            label="disagrees with the prediction",
        )


def _draw_lost(panel: "Axes", rows: list[dict[str, Any]]) -> None:
    """Draws a cross with the status near the upper edge for each point without a gain."""
    if rows:
        upwards = panel.get_xaxis_transform()
        panel.plot(
            [row["omega_rad_s"] for row in rows],
            [0.95] * len(rows),
            linestyle="none",
            marker="X",
            color=BLACK,
            markersize=7.5,
            markeredgecolor="white",
            markeredgewidth=0.7,
            transform=upwards,
            zorder=4,
            label="no gain measured",
        )
        for row in rows:
            panel.text(
                row["omega_rad_s"],
                0.90,
                str(row["status"]),
                transform=upwards,
                fontsize=7,
                rotation=90,
                ha="center",
                va="top",
            )


def _dress(panel: "Axes", beta: float, limits: tuple[tuple[float, float], tuple[float, float]]) -> None:
    panel.axhline(
        1.0, color=GREY, linestyle="-.", linewidth=1.0, zorder=1, label=r"$\alpha_2$ = 1: the block has no effect"
    )
    panel.set_title(rf"$\beta$ = {beta:g}", fontsize=10)
    panel.set_xlabel(r"$\Omega$  [rad/s]")
    panel.set_yscale("log")
    panel.set_xlim(*limits[0])
    panel.set_ylim(*limits[1])
    ticks_1_2_5(panel.yaxis)
    set_grid(panel)


def _ranges(rows: list[dict[str, Any]], prediction: Prediction) -> tuple[tuple[float, float], tuple[float, float]]:
    """Common ranges of frequency and gain, which include all measured points, and predictions between FLOOR and
    CEILING.
    """
    omega = np.array([*prediction["omega"], *(row["omega_rad_s"] for row in rows)], dtype=np.float64)
    predicted = prediction["alpha_2"].astype(np.float64)
    predicted = predicted[(predicted > FLOOR) & (predicted < CEILING)]
    measured = [row["alpha_2"] for row in rows if row["alpha_2"] is not None]
    gain = np.array([1.0, *predicted, *(alpha for alpha in measured if alpha > 0.0)], dtype=np.float64)
    first, last = (float(omega.min()), float(omega.max())) if omega.size else (12.0, 21.0)
    margin = 0.03 * (last - first) or 0.5
    return (first - margin, last + margin), (float(gain.min()) / HEADROOM, float(gain.max()) * HEADROOM)


def _add_legend(figure: "Figure", axes: Sequence["Axes"], *, measured: bool) -> None:
    """One legend below all panels, in the order of LEGEND."""
    entries: dict[str, Any] = {}
    for panel in axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    labels = sorted(entries, key=lambda label: LEGEND.index(label) if label in LEGEND else len(LEGEND))
    figure.legend(
        [entries[label] for label in labels],
        labels,
        loc="outside lower center",
        ncols=3 if len(axes) > 1 else 2,
        fontsize=8,
        frameon=False,
        title="error bars: expanded uncertainty (k = 2)" if measured else None,
        title_fontsize=8,
    )
