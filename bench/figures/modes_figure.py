# pyright: reportUnknownMemberType=false
"""Modes as in Fig. 3 of the paper: shapes and frequencies of the bare frame and the coupled system.

Up to five stiffnesses are drawn as shapes, a larger number as curves against stiffness.
"""

from collections.abc import Mapping
from math import isnan, tau
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.figures.style import BLACK, BLUE, GREEN, GREY, PALE, PURPLE, VERMILLION, new_figure, set_grid
from sim.specimen import Specimen

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

REACH = 0.13
"""Largest drawn displacement relative to the height of the frame."""

BAY = 0.36
"""Drawn width of the frame relative to its height; the model does not define a width."""

LIFT = 0.02
"""Vertical offset of an arrow from the displaced point [m]."""

Shape = tuple[float, float, float]
"""u1, u2 (any unit) and theta [rad per that unit]; NaN without a block."""


def draw_shape(panel: "Axes", specimen: Specimen, shape: Shape) -> None:
    """Draws a mode, scaled to a visible displacement; x and y are in metres, at the same scale."""
    u1, u2, theta = shape
    frame, block = specimen.frame, specimen.block
    top = 0.0 if isnan(theta) else 2.0 * block.h_b * theta
    scale = REACH * frame.h2 / max(abs(u1), abs(u2), abs(top))
    for factor, colour, width in ((0.0, GREY, 0.8), (scale, BLACK, 1.5)):
        _draw_frame(panel, specimen, factor * u1, factor * u2, colour, width)
        if not isnan(theta):
            _draw_block(panel, specimen, factor * u1, factor * theta, colour, width)
    _arrow(panel, 0.0, frame.h1, scale * u1)
    _arrow(panel, 0.0, frame.h2, scale * u2)
    if not isnan(theta):
        # positive rotation moves the top towards the frame
        _arrow(panel, specimen.d + block.b, 2.0 * block.h_b, -scale * top)
    margin, width = 1.2 * REACH * frame.h2, specimen.d + 2.0 * block.b
    # draw the bare frame centred, at the scale of the coupled one
    shift = 0.5 * width if isnan(theta) else 0.0
    left, right = -BAY * frame.h2 - margin - shift, width + margin - shift
    tallest = max(frame.h2, 2.0 * block.h_b)
    panel.plot([left, right], [0.0, 0.0], color=BLACK, linewidth=0.8)
    panel.set_xlim(left, right)
    panel.set_ylim(-0.02 * tallest, 1.1 * tallest)
    panel.set_aspect("equal", anchor="S")
    panel.set_xticks([])
    panel.set_yticks([])
    for side in panel.spines.values():
        side.set_visible(False)


def _draw_frame(panel: "Axes", specimen: Specimen, u1: float, u2: float, colour: str, width: float) -> None:
    """Draws the frame with columns bent as in a shear frame, without rotation at the base and at the storeys."""
    frame = specimen.frame
    x = np.linspace(0.0, 1.0, 25)
    rise = x * x * (3.0 - 2.0 * x)
    bend = np.concatenate([u1 * rise, u1 + (u2 - u1) * rise])
    height = np.concatenate([frame.h1 * x, frame.h1 + (frame.h2 - frame.h1) * x])
    left = -BAY * frame.h2
    for foot in (left, 0.0):
        panel.plot(foot + bend, height, color=colour, linewidth=width, solid_capstyle="round")
    for shift, level in ((u1, frame.h1), (u2, frame.h2)):
        panel.plot([left + shift, shift], [level, level], color=colour, linewidth=2.0 * width, solid_capstyle="butt")


def _draw_block(panel: "Axes", specimen: Specimen, u1: float, theta: float, colour: str, width: float) -> None:
    """Draws the block, rotated about the corner given by the sign of theta, and the spring to the first storey."""
    block, h1, d = specimen.block, specimen.frame.h1, specimen.d
    left, right = d, d + 2.0 * block.b
    pivot = np.array([left if theta >= 0.0 else right, 0.0])
    rotation = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])

    def rotated(x: float, y: float) -> NDArray[np.float64]:
        return pivot + rotation @ (np.array([x, y]) - pivot)

    corners = [(left, 0.0), (right, 0.0), (right, 2.0 * block.h_b), (left, 2.0 * block.h_b)]
    outline = np.array([rotated(*corner) for corner in (*corners, corners[0])])
    panel.fill(*outline.T, facecolor=PALE if colour == BLACK else "none", edgecolor=colour, linewidth=width, zorder=1.5)
    start, end = np.array([u1, h1]), rotated(left, h1)
    along = np.array([0.0, 0.15, *np.linspace(0.2, 0.8, 9), 0.85, 1.0])
    across = np.array([0.0, 0.0, *(0.018 * (-1.0) ** k for k in range(9)), 0.0, 0.0])
    direction = (end - start) / np.hypot(*(end - start))
    normal = np.array([-direction[1], direction[0]])
    coil = start + along[:, None] * (end - start) + across[:, None] * normal
    panel.plot(coil[:, 0], coil[:, 1], color=BLUE if colour == BLACK else GREY, linewidth=0.7 * width)


def _arrow(panel: "Axes", x: float, y: float, length: float) -> None:
    """Draws an arrow from the rest position to the displaced one, unless it is too short to be visible."""
    if abs(length) > 2e-3:
        panel.annotate(
            "",
            xy=(x + length, y + LIFT),
            xytext=(x, y + LIFT),
            arrowprops={
                "arrowstyle": "-|>",
                "color": VERMILLION,
                "linewidth": 1.2,
                "mutation_scale": 8.0,
                "shrinkA": 0.0,
                "shrinkB": 0.0,
            },
            zorder=5,
        )


MOST_SHAPES = 5
"""Largest number of stiffnesses drawn as shapes."""

SKETCH = (1.75, 2.25)
"""Width and height of a shape [inch]."""

_KEY = "grey: at rest\nblack: displaced\narrows: displacement\nblue: spring"

Modes = Mapping[str, NDArray[Any]]
"""Arrays of equal length, one row per mode: system ("bare" or "coupled"), beta, mode, divergent, omega_rad_s,
frequency_hz, growth_rate_per_s, shape_u1, shape_u2, shape_theta_rad_per_m; NaN where a value is absent."""


def modes_figure(modes: Modes, specimen: Specimen) -> "Figure":
    """Mode shapes, or frequencies against stiffness; `specimen` gives the proportions of the shapes."""
    betas = np.unique(modes["beta"][modes["system"] == "coupled"])
    return _shapes(modes, betas, specimen) if len(betas) <= MOST_SHAPES else _curves(modes)


def _shapes(modes: Modes, betas: NDArray[np.float64], specimen: Specimen) -> "Figure":
    """One column per system and one row per mode of the coupled system; the last two rows also show the modes of the
    bare frame.
    """
    columns = len(betas) + 1
    figure = new_figure(columns * SKETCH[0], 3 * SKETCH[1] + 0.5)
    # axes of equal scale shrink after the layout: reserve space for titles
    layout: Any = figure.get_layout_engine()
    layout.set(h_pad=0.1)
    bare = np.flatnonzero(modes["system"] == "bare")
    systems = [(bare, r"bare frame")]
    systems += [(np.flatnonzero(modes["beta"] == beta), rf"$\beta$ = {beta:g}") for beta in betas]
    for k, (rows, title) in enumerate(systems):
        for row in rows:
            # the coupled system has an additional mode below those of the frame
            line = int(modes["mode"][row]) - (0 if rows is bare else 1)
            panel = figure.add_subplot(3, columns, line * columns + k + 1)
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
    """Frequencies (upper panel) and growth rates (lower panel) against stiffness."""
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
    hertz = upper.secondary_yaxis("right", functions=(_hertz, _circular))
    hertz.set_ylabel(r"$f$  [Hz]")
    lower.set_ylabel(r"growth rate  [s$^{-1}$]")
    lower.set_ylim(bottom=0.0)
    lower.set_xlabel(r"stiffness ratio  $\beta$ = $k_C/k_1$")
    upper.tick_params(labelbottom=False)
    for panel in (upper, lower):
        set_grid(panel)
        if panel.get_legend_handles_labels()[0]:
            panel.legend(fontsize=8, frameon=False, loc="center right" if panel is upper else "lower right")
    return figure


def _hertz(omega: Any) -> Any:
    return omega / tau


def _circular(frequency: Any) -> Any:
    return tau * frequency
