# pyright: reportUnknownMemberType=false
"""Time histories as in Fig. 5 of the paper: drift of the coupled and the bare frame, u1 and rocking angle.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.report.style import BLACK, BLUE, GREY, PURPLE, VERMILLION, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

WIDTH, ROW, MARGIN = 9.0, 2.0, 0.9
"""Inches: width of the figure, height of a motion, and what titles and legend take."""

HEADROOM = 1.12
"""Of the greatest value, to the edge of a panel."""

MILLI = 1e3
"""Metres and radians are shown as thousandths."""


@dataclass(frozen=True, eq=False)
class Motion:
    """One motion: `values` holds arrays of one length: time_s, drift_m, bare_drift_m, u1_m, theta_rad; NaN ends it.

    `name` says how it began or which steady motion it is, `status` how it ended.
    """

    omega: float
    beta: float
    name: str
    status: str
    values: Mapping[str, NDArray[np.float64]]


def history_figure(motions: Sequence[Motion]) -> "Figure":
    """Draw a row of two panels for each motion; returns a figure that belongs to no window."""
    figure = new_figure(WIDTH, len(motions) * ROW + MARGIN)
    lines: dict[str, Line2D] = {}
    for k, motion in enumerate(motions):
        left = figure.add_subplot(len(motions), 2, 2 * k + 1)
        right = figure.add_subplot(len(motions), 2, 2 * k + 2)
        _draw_drift(left, motion)
        angle = _draw_block(right, motion)
        letter = chr(ord("a") + k)
        left.set_title(
            rf"({letter})  $\Omega$ = {motion.omega:g} rad/s,  $\beta$ = {motion.beta:g}", loc="left", fontsize=9
        )
        right.set_title(f"{motion.name}: {motion.status}" if motion.status else motion.name, loc="right", fontsize=9)
        for panel in (left, right):
            panel.set_xlim(float(motion.values["time_s"][0]), float(motion.values["time_s"][-1]))
            set_grid(panel)
            _mark_end(panel, motion)
            if k == len(motions) - 1:
                panel.set_xlabel(r"$t$  [s]")
        for line in (*left.lines, *right.lines, *angle.lines):
            lines.setdefault(str(line.get_label()), line)
    figure.legend(handles=list(lines.values()), loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    return figure


def _draw_drift(panel: "Axes", motion: Motion) -> None:
    time, bare, coupled = (motion.values[name] for name in ("time_s", "bare_drift_m", "drift_m"))
    panel.plot(time, MILLI * bare, color=GREY, linewidth=0.9, linestyle="--", label="drift of the bare frame")
    panel.plot(time, MILLI * coupled, color=BLUE, linewidth=1.4, label="drift of the coupled frame")
    centre(panel, MILLI * bare, MILLI * coupled)
    panel.set_ylabel(r"$u_2 - u_1$  [mm]")


def _draw_block(panel: "Axes", motion: Motion) -> "Axes":
    """u1 on the left axis, theta on the right one, zero at the same height; returns the right axis."""
    time, u1, theta = (motion.values[name] for name in ("time_s", "u1_m", "theta_rad"))
    angle = panel.twinx()
    panel.plot(time, MILLI * u1, color=BLACK, linewidth=1.3, label=r"$u_1$, left axis")
    angle.plot(
        time, MILLI * theta, color=VERMILLION, linewidth=1.2, linestyle=(0, (5, 1.2)), label=r"$\vartheta$, right axis"
    )
    centre(panel, MILLI * u1)
    centre(angle, MILLI * _before_the_fall(motion))
    panel.set_ylabel(r"$u_1$  [mm]")
    angle.set_ylabel(r"$\vartheta$  [mrad]", color=VERMILLION)
    return angle


def _before_the_fall(motion: Motion) -> NDArray[np.float64]:
    """The angles that should fill the panel: a block that falls leaves it in the end."""
    theta = motion.values["theta_rad"]
    if np.isfinite(theta).all():
        return theta
    away = np.flatnonzero(np.sign(theta) != np.sign(theta[np.isfinite(theta)][-1]))
    last_swing = away[away < np.flatnonzero(np.isfinite(theta))[-1]]
    settled = theta[: int(last_swing[-1]) + 1] if last_swing.size else theta
    return 1.6 * settled


def centre(panel: "Axes", *curves: NDArray[np.float64]) -> None:
    """Put zero in the middle and leave some room above the greatest value."""
    finite = np.concatenate([curve[np.isfinite(curve)] for curve in curves])
    reach = HEADROOM * float(np.abs(finite).max(initial=0.0)) or 1.0
    panel.set_ylim(-reach, reach)


def _mark_end(panel: "Axes", motion: Motion) -> None:
    """A line where the motion of the block ended before its time."""
    lost = np.flatnonzero(~np.isfinite(motion.values["theta_rad"]))
    if lost.size:
        end = float(motion.values["time_s"][lost[0]])
        panel.axvline(end, color=PURPLE, linewidth=1.2, linestyle=":", label="block overturned")
