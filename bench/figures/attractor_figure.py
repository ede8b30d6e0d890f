# pyright: reportUnknownMemberType=false
"""Peaks of the cycles of long-term motions over the frequency: a panel for each stiffness."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bench.figures.style import BLACK, BLUE, GREY, VERMILLION, add_legend, new_figure, set_grid
from bench.prediction.attractors import LongTerm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 2


def attractor_figure(found: Sequence[LongTerm]) -> "Figure":
    """A dot for the peak of each cycle; the line is the orbit, with a gap where it is unstable on the table."""
    betas = sorted({each.beta for each in found})
    across = min(COLUMNS, len(betas))
    down = -(-len(betas) // across)
    figure = new_figure(max(1.4, across) * 3.6, down * 2.8 + 0.5)
    panels: list[Axes] = [figure.add_subplot(down, across, k + 1) for k in range(len(betas))]
    for k, (panel, beta) in enumerate(zip(panels, betas, strict=True)):
        here = sorted((each for each in found if each.beta == beta), key=lambda each: each.omega)
        omega = np.array([each.omega for each in here])
        orbit = np.array([each.orbit for each in here])
        stable = np.array([each.stable for each in here])
        panel.plot(omega, orbit, color=GREY, linestyle=(0, (3, 2)), linewidth=1.0, label="unstable orbit")
        panel.plot(omega, np.where(stable, orbit, np.nan), color=BLUE, linewidth=1.5, label="stable orbit")
        moving = [each for each in here if not each.stable and each.gains.size]
        places = np.concatenate([np.full(each.gains.size, each.omega) for each in moving] or [np.empty(0)])
        peaks = np.concatenate([each.gains for each in moving] or [np.empty(0)])
        panel.plot(places, peaks, ".", color=BLACK, markersize=1.5, label="peak of a cycle")
        fallen = [each for each in here if each.fallen is not None]
        panel.plot(
            [each.omega for each in fallen],
            [each.orbit for each in fallen],
            "x",
            color=VERMILLION,
            label="the block falls",
        )
        panel.set_title(rf"$\beta$ = {beta:g}")
        panel.set_xlabel(r"$\Omega$  [rad/s]")
        if k % across == 0:
            panel.set_ylabel(r"gain of the peak drift  $\alpha_2$")
        set_grid(panel)
    add_legend(figure, panels, columns=4)
    return figure
