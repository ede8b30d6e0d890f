# pyright: reportUnknownMemberType=false
"""Histories of a seismic campaign: the table's motions as in Fig. 7 of the paper, the drift as in 8(b) and 9(b).

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.report.style import BLUE, GREY, SKY, VERMILLION, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

WIDTH, ROW, LEGEND = 8.5, 1.55, 0.8
"""Inches: width of a figure, height of a row, height of its legend and axis."""

HEADROOM = 1.1


@dataclass(frozen=True, eq=False)
class MotionPicture:
    """Acceleration of the table [m/s2] under a record, every `dt` [s]: as asked, and achieved with the bare frame."""

    name: str
    dt: float
    asked: Array
    achieved: Array


@dataclass(frozen=True, eq=False)
class DriftPicture:
    """The drift [m] under one record, every `dt` [s], measured and predicted; `beta` is None for the bare frame."""

    name: str
    beta: float | None
    dt: float
    measured: Array
    predicted: Array


def motion_figure(motions: Sequence[MotionPicture]) -> "Figure":
    """A row per record. Returns a figure that belongs to no window."""
    figure, panels = _rows(len(motions))
    for panel, motion in zip(panels, motions, strict=False):
        time = motion.dt * np.arange(motion.asked.size)
        panel.plot(time, motion.asked, color=SKY, linewidth=1.6, label="asked")
        panel.plot(time, motion.achieved, color=BLUE, linewidth=0.6, label="achieved, bare frame (as measured)")
        error = motion.achieved - motion.asked
        panel.plot(time, error, color=VERMILLION, linewidth=0.6, label="achieved − asked")
        _dress(panel, motion.name, "$a_g$  [m/s²]", max(_most(motion.asked), _most(motion.achieved)))
        panel.set_xlim(0.0, float(time[-1]))
    _finish(figure, panels, len(motions))
    return figure


def drift_figure(drifts: Sequence[DriftPicture]) -> "Figure":
    """A row per record: the bare frame, and the frame with the softest spring that was measured.

    Returns a figure that belongs to no window.
    """
    names = list(dict.fromkeys(drift.name for drift in drifts))
    figure, panels = _rows(len(names))
    for panel, name in zip(panels, names, strict=False):
        bare = [drift for drift in drifts if drift.name == name and drift.beta is None]
        springs = sorted((d for d in drifts if d.name == name and d.beta is not None), key=lambda d: d.beta or 0.0)
        for drift in bare:
            _draw(panel, drift, GREY, 0.9, "bare frame")
        for drift in springs[:1]:
            _draw(panel, drift, VERMILLION, 1.3, "coupled")
        title = name if not springs else rf"{name}, $\beta$ = {springs[0].beta:g}"
        _dress(panel, title, "drift  [mm]", 1e3 * max(_most(d.measured) for d in (*bare, *springs[:1])))
        panel.set_xlim(0.0, max(d.dt * (d.measured.size - 1) for d in (*bare, *springs[:1])))
    _finish(figure, panels, len(names))
    return figure


def _draw(panel: "Axes", drift: DriftPicture, colour: str, width: float, name: str) -> None:
    time = drift.dt * np.arange(drift.measured.size)
    panel.plot(time, 1e3 * drift.measured, color=colour, linewidth=width, label=f"{name}, measured")
    predicted = drift.dt * np.arange(drift.predicted.size)
    panel.plot(
        predicted,
        1e3 * drift.predicted,
        color="black" if name == "coupled" else BLUE,
        linewidth=0.6,
        linestyle=(0, (3, 2)),
        label=f"{name}, predicted for the achieved motion",
    )


def _rows(count: int) -> "tuple[Figure, list[Axes]]":
    figure = new_figure(WIDTH, ROW * max(count, 1) + LEGEND)
    return figure, list(figure.subplots(max(count, 1), 1, squeeze=False).flat)


def _dress(panel: "Axes", title: str, label: str, most: float) -> None:
    panel.set_title(title, loc="left", fontsize=8, pad=3.0)
    panel.set_ylabel(label, fontsize=8)
    panel.tick_params(labelsize=8)
    panel.set_ylim(-HEADROOM * most, HEADROOM * most)
    set_grid(panel)


def _finish(figure: "Figure", panels: "Sequence[Axes]", count: int) -> None:
    if count == 0:
        panels[0].set_axis_off()
        panels[0].text(0.5, 0.5, "no record was played", ha="center", va="center")
        return
    panels[-1].set_xlabel(r"$t$  [s]", fontsize=8)
    # a record that toppled the block, or was not played, lacks curves that others have
    entries: dict[str, Any] = {}
    for panel in panels[:count]:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.legend(
        list(entries.values()),
        list(entries),
        loc="outside lower center",
        ncols=len(entries) if len(entries) < 4 else 2,
        fontsize=8,
        frameon=False,
    )


def _most(values: Array) -> float:
    return float(np.nanmax(np.abs(values))) or 1.0
