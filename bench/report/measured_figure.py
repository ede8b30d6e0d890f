# pyright: reportUnknownMemberType=false
"""Measured cycles in the style of Fig. 5 of the paper: drift, bare drift and u1, with the predicted ones and theta.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.report.history_figure import MILLI, centre
from bench.report.style import BLACK, BLUE, GREY, ORANGE, SKY, VERMILLION, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

Floats = NDArray[np.float64]

WIDTH, ROW, MARGIN = 9.0, 1.95, 0.9
"""Inches: width of the figure, height of a point, and what titles and legend take."""


@dataclass(frozen=True, eq=False)
class Predicted:
    """The steady motion of the model at the same times: drift [m], u1 [m], theta [rad], each of shape (n,)."""

    drift: Floats
    u1: Floats
    theta: Floats


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """Some measured cycles of one point, `time` [s] from an upward zero of the table's acceleration, shape (n,).

    `drift`, `bare_drift` and `u1` [m], shape (n,), NaN where samples are missing; `bare_drift` is of the test without
    block in the same phase, None where it was not found. `predicted` is None where the model has no such motion.
    """

    omega: float
    beta: float
    status: str
    time: Floats
    drift: Floats
    u1: Floats
    bare_drift: Floats | None
    predicted: Predicted | None


def measured_figure(motions: Sequence[MeasuredMotion]) -> "Figure":
    """A row of two panels for each point; returns a figure that belongs to no window."""
    figure = new_figure(WIDTH, len(motions) * ROW + MARGIN)
    lines: dict[str, Line2D] = {}
    for k, motion in enumerate(motions):
        left = figure.add_subplot(len(motions), 2, 2 * k + 1)
        right = figure.add_subplot(len(motions), 2, 2 * k + 2)
        _draw_drift(left, motion)
        drawn = [*left.lines, *_draw_storey(right, motion)]
        left.set_title(
            rf"({chr(ord('a') + k)})  $\Omega$ = {motion.omega:g} rad/s,  $\beta$ = {motion.beta:g}",
            loc="left",
            fontsize=9,
        )
        right.set_title(motion.status, loc="right", fontsize=9)
        for panel in (left, right):
            panel.set_xlim(float(motion.time[0]), float(motion.time[-1]))
            set_grid(panel)
            if k == len(motions) - 1:
                panel.set_xlabel(r"$t$  [s]")
        for line in drawn:
            lines.setdefault(str(line.get_label()), line)
    figure.legend(handles=list(lines.values()), loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure


def _draw_drift(panel: "Axes", motion: MeasuredMotion) -> None:
    shown = [MILLI * motion.drift]
    if motion.bare_drift is not None:
        shown.append(MILLI * motion.bare_drift)
        panel.plot(motion.time, shown[-1], color=GREY, linewidth=0.9, linestyle="--", label="bare drift, measured")
    panel.plot(motion.time, shown[0], color=BLUE, linewidth=1.7, label="drift, measured")
    if motion.predicted is not None:
        shown.append(MILLI * motion.predicted.drift)
        panel.plot(
            motion.time, shown[-1], color=ORANGE, linewidth=1.1, linestyle=(0, (2, 1.5)), label="drift, predicted"
        )
    centre(panel, *shown)
    panel.set_ylabel(r"$u_2 - u_1$  [mm]")


def _draw_storey(panel: "Axes", motion: MeasuredMotion) -> list["Line2D"]:
    """u1 on the left axis, the predicted theta on the right one; returns all lines."""
    shown = [MILLI * motion.u1]
    panel.plot(motion.time, shown[0], color=BLACK, linewidth=1.4, label=r"$u_1$, measured, left axis")
    panel.set_ylabel(r"$u_1$  [mm]")
    if motion.predicted is None:
        centre(panel, *shown)
        return list(panel.lines)
    shown.append(MILLI * motion.predicted.u1)
    panel.plot(
        motion.time,
        shown[-1],
        color=SKY,
        linewidth=1.1,
        linestyle=(0, (2, 1.5)),
        label=r"$u_1$, predicted, left axis",
    )
    centre(panel, *shown)
    angle = panel.twinx()
    angle.plot(
        motion.time,
        MILLI * motion.predicted.theta,
        color=VERMILLION,
        linewidth=1.1,
        linestyle=(0, (5, 1.2)),
        label=r"$\vartheta$, predicted only, right axis",
    )
    centre(angle, MILLI * motion.predicted.theta)
    angle.set_ylabel(r"$\vartheta$  [mrad]", color=VERMILLION)
    return [*panel.lines, *angle.lines]
