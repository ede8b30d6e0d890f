# pyright: reportUnknownMemberType=false
"""Modes as in Fig. 3 of the paper: shapes and frequencies of the bare and the coupled system.

Up to five stiffnesses are drawn as shapes, more as curves over the stiffness. matplotlib's keyword arguments have no
types, hence the first line.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.report.mode_shape import draw_shape
from bench.report.style import BLUE, GREEN, GREY, PURPLE, VERMILLION, new_figure, set_grid
from sim.specimen import Specimen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_SHAPES = 5
"""Stiffnesses that are drawn as shapes."""

SKETCH = (1.75, 2.25)
"""Inches: width and height of a shape."""

_KEY = "grey: at rest\nblack: displaced\narrows: displacement\nblue: spring"

Modes = Mapping[str, NDArray[Any]]
"""Arrays of one length, a row per mode: system ("bare" or "coupled"), beta, mode, divergent, omega_rad_s,
frequency_hz, growth_rate_per_s, shape_u1, shape_u2, shape_theta_rad_per_m; NaN where a value is absent."""


def modes_figure(modes: Modes, specimen: Specimen) -> "Figure":
    """Draw the modes; returns a figure that belongs to no window. `specimen` gives the proportions of the shapes."""
    betas = np.unique(modes["beta"][modes["system"] == "coupled"])
    return _shapes(modes, betas, specimen) if len(betas) <= MOST_SHAPES else _curves(modes)


def _shapes(modes: Modes, betas: NDArray[np.float64], specimen: Specimen) -> "Figure":
    """A column per system and a row per mode of the coupled one; the frame's own modes stand beside its last two."""
    columns = len(betas) + 1
    figure = new_figure(columns * SKETCH[0], 3 * SKETCH[1] + 0.5)
    # equal axes shrink after the layout: room for what stands above them
    layout: Any = figure.get_layout_engine()
    layout.set(h_pad=0.1)
    bare = np.flatnonzero(modes["system"] == "bare")
    systems = [(bare, r"bare frame")]
    systems += [(np.flatnonzero(modes["beta"] == beta), rf"$\beta$ = {beta:g}") for beta in betas]
    for k, (rows, title) in enumerate(systems):
        for row in rows:
            # the coupled system has one mode more, below those of the frame
            place = int(modes["mode"][row]) - (0 if rows is bare else 1)
            panel = figure.add_subplot(3, columns, place * columns + k + 1)
            shape = [float(modes[name][row]) for name in ("shape_u1", "shape_u2", "shape_theta_rad_per_m")]
            draw_shape(panel, specimen, (shape[0], shape[1], shape[2]))
            panel.set_xlabel(_caption(modes, int(row)), fontsize=8, labelpad=2.0)
            if row == rows[0]:
                panel.set_title(title, fontsize=10)
    figure.text(0.01, 0.99, _KEY, ha="left", va="top", fontsize=8, linespacing=1.6)
    return figure


def _caption(modes: Modes, row: int) -> str:
    if modes["divergent"][row]:
        return f"divergent\ngrows at {modes['growth_rate_per_s'][row]:.3f} s$^{{-1}}$"
    return f"$\\omega$ = {modes['omega_rad_s'][row]:.3f} rad/s\n$f$ = {modes['frequency_hz'][row]:.3f} Hz"


def _curves(modes: Modes) -> "Figure":
    """Frequencies above, rates of growth below, over the stiffness."""
    figure = new_figure(5.4, 5.6)
    grid = figure.add_gridspec(2, 1, height_ratios=(2.4, 1.0))
    upper = figure.add_subplot(grid[0])
    lower = figure.add_subplot(grid[1], sharex=upper)
    bare = modes["omega_rad_s"][modes["system"] == "bare"]
    for k, omega in enumerate(bare):
        upper.axhline(
            float(omega), color=GREY, linestyle="-.", linewidth=1.0, label="bare frame" if k == 0 else "_nolegend_"
        )
    coupled = modes["system"] == "coupled"
    for mode, colour, dash in ((1, PURPLE, ":"), (2, BLUE, "-"), (3, GREEN, (0, (6, 1.5)))):
        rows = np.flatnonzero(coupled & (modes["mode"] == mode))
        rows = rows[np.argsort(modes["beta"][rows])]
        name = f"coupled, mode {mode}"
        beta, omega, rate = (modes[key][rows] for key in ("beta", "omega_rad_s", "growth_rate_per_s"))
        if np.isfinite(omega).any():
            upper.plot(beta, omega, color=colour, linestyle=dash, linewidth=1.8, label=name)
        if np.isfinite(rate).any():
            lower.plot(beta, rate, color=VERMILLION, linestyle="--", linewidth=1.8, label=f"{name}, divergent")
    upper.set_ylabel(r"frequency  $\omega$  [rad/s]")
    upper.set_ylim(bottom=0.0)
    hertz = upper.secondary_yaxis("right", functions=(_to_hertz, _from_hertz))
    hertz.set_ylabel(r"$f$  [Hz]")
    lower.set_ylabel(r"rate of growth  [s$^{-1}$]")
    lower.set_ylim(bottom=0.0)
    lower.set_xlabel(r"stiffness ratio  $\beta$ = $k_C/k_1$")
    upper.tick_params(labelbottom=False)
    for panel in (upper, lower):
        set_grid(panel)
        if panel.get_legend_handles_labels()[0]:
            panel.legend(fontsize=8, frameon=False, loc="center right" if panel is upper else "lower right")
    return figure


def _to_hertz(omega: Any) -> Any:
    return omega / (2.0 * np.pi)


def _from_hertz(frequency: Any) -> Any:
    return 2.0 * np.pi * frequency
