# pyright: reportUnknownMemberType=false
"""Time histories as in Fig. 5 of the paper: drift of the coupled and the bare frame, u1 and rocking angle."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.figures.style import BLACK, BLUE, GREY, MILLI, PURPLE, VERMILLION, add_legend, centre, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, ROW, MARGIN = 9.0, 2.0, 0.9
"""Width of the figure, height per motion, and height of titles and legend [inch]."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion and its time histories.

    omega, beta : frequency of the sine [rad/s] and stiffness ratio.
    name : start of the motion, or kind of steady motion.
    status : outcome of the motion; may be empty.
    values : time_s, drift_m, bare_drift_m, u1_m and theta_rad, each of shape (n,); NaN after a fall.
    """

    omega: float
    beta: float
    name: str
    status: str
    values: Mapping[str, NDArray[np.float64]]


def history_figure(motions: Sequence[Motion]) -> "Figure":
    """Two panels for each motion: drifts, and u1 with the rocking angle."""
    figure = new_figure(WIDTH, len(motions) * ROW + MARGIN)
    panels: list[Axes] = []
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
        panels += [left, right, angle]
    add_legend(figure, panels, 5)
    return figure


def _draw_drift(panel: "Axes", motion: Motion) -> None:
    time, bare, coupled = (motion.values[name] for name in ("time_s", "bare_drift_m", "drift_m"))
    panel.plot(time, MILLI * bare, color=GREY, linewidth=0.9, linestyle="--", label="drift of the bare frame")
    panel.plot(time, MILLI * coupled, color=BLUE, linewidth=1.4, label="drift of the coupled frame")
    centre(panel, MILLI * bare, MILLI * coupled)
    panel.set_ylabel(r"$u_2 - u_1$  [mm]")


def _draw_block(panel: "Axes", motion: Motion) -> "Axes":
    """Draws u1 on the left axis and theta on the right one, zero at the same height; returns the right axis."""
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
    """Angles that set the scale of the panel: all or, if the block fell, 1.6 times those up to the last sign change."""
    theta = motion.values["theta_rad"]
    if np.isfinite(theta).all():
        return theta
    away = np.flatnonzero(np.sign(theta) != np.sign(theta[np.isfinite(theta)][-1]))
    last_swing = away[away < np.flatnonzero(np.isfinite(theta))[-1]]
    settled = theta[: int(last_swing[-1]) + 1] if last_swing.size else theta
    return 1.6 * settled


def _mark_end(panel: "Axes", motion: Motion) -> None:
    """Draws a line at the instant at which the block fell."""
    lost = np.flatnonzero(~np.isfinite(motion.values["theta_rad"]))
    if lost.size:
        end = float(motion.values["time_s"][lost[0]])
        panel.axvline(end, color=PURPLE, linewidth=1.2, linestyle=":", label="block overturned")
