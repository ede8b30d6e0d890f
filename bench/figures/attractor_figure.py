# pyright: reportUnknownMemberType=false
"""Cycle peaks of long-term motions against frequency, one panel per stiffness."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.figures.style import BLACK, BLUE, GREY, VERMILLION, add_legend, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 2


def attractor_figure(points: Mapping[str, NDArray[Any]], gains: Sequence[NDArray[np.float64]]) -> "Figure":
    """Gains of long-term motions against frequency. The line is the orbit, dashed where it is unstable; there, dots are
    the peaks of cycles, and a cross marks a motion in which the block falls.

    `points` are the columns of the table from `bench.prediction.attractors`; `gains` are those of the last cycles of
    the motion in each row of the table, empty after a fall.
    """
    betas = np.unique(points["beta"])
    across = min(COLUMNS, betas.size)
    down = -(-betas.size // across)
    figure = new_figure(max(1.4, across) * 3.6, down * 2.8 + 0.5)
    panels: list[Axes] = [figure.add_subplot(down, across, k + 1) for k in range(betas.size)]
    for k, (panel, beta) in enumerate(zip(panels, betas, strict=True)):
        here: list[int] = np.flatnonzero(points["beta"] == beta).tolist()
        rows = sorted(here, key=lambda row: float(points["omega_rad_s"][row]))
        omega, orbit, stable = (points[name][rows] for name in ("omega_rad_s", "alpha_2", "stable"))
        panel.plot(omega, orbit, color=GREY, linestyle=(0, (3, 2)), linewidth=1.0, label="unstable orbit")
        panel.plot(omega, np.where(stable, orbit, np.nan), color=BLUE, linewidth=1.5, label="stable orbit")
        moving = [row for row in rows if not points["stable"][row]]
        places = np.repeat(points["omega_rad_s"][moving], [gains[row].size for row in moving])
        peaks = np.concatenate([gains[row] for row in moving] or [np.empty(0)])
        panel.plot(places, peaks, ".", color=BLACK, markersize=1.5, label="peak of a cycle")
        fallen = [row for row in moving if not gains[row].size]
        panel.plot(
            points["omega_rad_s"][fallen], points["alpha_2"][fallen], "x", color=VERMILLION, label="the block falls"
        )
        panel.set_title(rf"$\beta$ = {beta:g}")
        panel.set_xlabel(r"$\Omega$  [rad/s]")
        if k % across == 0:
            panel.set_ylabel(r"gain of the peak drift  $\alpha_2$")
        set_grid(panel)
    add_legend(figure, panels, columns=4)
    return figure
