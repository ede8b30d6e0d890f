# pyright: reportUnknownMemberType=false
"""Largest modulus of the Floquet multipliers against frequency, on fixed ground and on the table; one panel per
stiffness.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.figures.style import BLACK, BLUE, GREY, VERMILLION, add_legend, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 3

Values = Mapping[str, NDArray[Any]]


def stability_figure(points: Values, boundaries: Values) -> "Figure":
    """Largest modulus of the Floquet multipliers against frequency; a circle marks a stability boundary.

    `points` and `boundaries` are the columns of the tables from `bench.prediction.stability`.
    """
    betas = sorted({float(beta) for beta in points["beta"]})
    across = min(COLUMNS, len(betas))
    down = -(-len(betas) // across)
    figure = new_figure(max(2, across) * 2.6, down * 2.4 + 0.5)
    panels: list[Axes] = [figure.add_subplot(down, across, k + 1) for k in range(len(betas))]
    for k, (panel, beta) in enumerate(zip(panels, betas, strict=True)):
        rows = points["beta"] == beta
        omega = points["omega_rad_s"][rows]
        for name, ground, colour, dash in (
            ("modulus", "fixed ground", BLUE, (0, (6, 1.5))),
            ("table_modulus", "table", VERMILLION, "-"),
        ):
            panel.plot(omega, points[name][rows], color=colour, linestyle=dash, linewidth=1.5, label=ground)
            here = (boundaries["beta"] == beta) & (boundaries["ground"] == ground)
            where = boundaries["omega_rad_s"][here]
            panel.plot(
                where, np.ones(where.size), "o", color=colour, markerfacecolor="white", markersize=5, label="boundary"
            )
        panel.axhline(1.0, color=BLACK, linewidth=0.8)
        panel.set_title(rf"$\beta$ = {beta:g}", color=GREY if not rows.any() else BLACK)
        panel.set_xlabel(r"$\Omega$  [rad/s]")
        if k % across == 0:
            panel.set_ylabel(r"largest modulus  $|\mu|$")
        set_grid(panel)
    add_legend(figure, panels, columns=3)
    return figure
