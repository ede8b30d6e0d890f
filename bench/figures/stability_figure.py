# pyright: reportUnknownMemberType=false
"""Stability on fixed ground and on the table: largest modulus of the Floquet multipliers against frequency, one panel
per stiffness, and boundary frequencies against stiffness or amplitude, one panel per ground.
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
Array = NDArray[np.float64]


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


def boundary_figure(points: Values, boundaries: Values) -> "Figure":
    """Boundary frequencies on each ground: against stiffness, with one colour per amplitude, or against amplitude for a
    single stiffness. Circles are the located boundaries; the curves through them are where the modulus interpolated
    between the points is 1.
    """
    over, other = ("beta", "amplitude_factor") if np.unique(points["beta"]).size > 1 else ("amplitude_factor", "beta")
    from matplotlib import colormaps

    families = np.unique(points[other])
    colours = colormaps["cividis"](np.linspace(0.0, 0.9, families.size))
    figure = new_figure(7.2, 3.4)
    panels: list[Axes] = list(figure.subplots(1, 2, sharex=True, sharey=True))
    for panel, (name, ground) in zip(panels, (("modulus", "fixed ground"), ("table_modulus", "table")), strict=True):
        for family, colour in zip(families, colours, strict=True):
            of_curve, of_circles = points[other] == family, boundaries[other] == family
            of_circles &= (boundaries["ground"] == ground) & np.isfinite(boundaries["omega_rad_s"])
            circles = boundaries[over][of_circles], boundaries["omega_rad_s"][of_circles]
            curve = points[over][of_curve], points["omega_rad_s"][of_curve], points[name][of_curve]
            if circles[0].size and np.unique(curve[0]).size > 1:
                panel.contour(*_grid(curve, circles), levels=[1.0], colors=[tuple(colour)], linewidths=1.3)
            label = f"{family:g} g/λ" if other == "amplitude_factor" else rf"$\beta$ = {family:g}"
            panel.plot(*circles, "o", color=tuple(colour), markerfacecolor="white", markersize=4, label=label)
        panel.set_title(ground)
        panel.set_xlabel(r"$\beta$" if over == "beta" else "amplitude / uplift acceleration")
        set_grid(panel)
    panels[0].set_ylabel(r"boundary at $\Omega$  [rad/s]")
    add_legend(figure, panels, columns=min(6, families.size))
    return figure


def _grid(curve: tuple[Array, Array, Array], boundaries: tuple[Array, Array]) -> tuple[Array, Array, Array]:
    """Ascending abscissae, shape (m,), frequencies, shape (n,), and moduli, shape (n, m), for contours through the
    located boundaries: `curve` contains abscissa, frequency and modulus of each point, and the modulus is 1 at the
    `boundaries`. Between the points it is interpolated linearly; NaN outside their range.
    """
    x, omega, moduli = (
        np.concatenate(pair) for pair in zip(curve, (*boundaries, np.ones(boundaries[0].size)), strict=True)
    )
    known = np.isfinite(moduli)
    columns, rows = np.unique(x), np.unique(omega)
    grid = np.full((rows.size, columns.size), np.nan)
    for k, column in enumerate(columns):
        here = np.flatnonzero(known & (x == column))
        here = here[np.argsort(omega[here])]
        if here.size:
            grid[:, k] = np.interp(rows, omega[here], moduli[here], left=np.nan, right=np.nan)
    return columns, rows, grid
