# pyright: reportUnknownMemberType=false
"""Gain surfaces and gain maps as in Fig. 4 of the paper, for the rocking and, where it exists, the resting motion.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.report.gain_levels import least_over_omega, levels_for
from bench.report.style import BLACK, BLUE, GREEN, PURPLE, VERMILLION, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

HEIGHTS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Gains that are written along the height of a surface."""

FLOOR, CEILING = 0.01, 100.0
"""Gains beyond are cut off in the surfaces."""


def draw_surface(panel: Any, omegas: Floats, betas: Floats, gain: Floats) -> None:
    """The gain on a logarithmic height, with a line at unity."""
    from matplotlib.ticker import MaxNLocator

    height = np.log10(np.clip(gain, FLOOR, CEILING))
    x, y = np.meshgrid(omegas, betas)
    panel.plot_surface(
        x,
        y,
        height,
        rstride=max(1, len(betas) // 40),
        cstride=max(1, len(omegas) // 60),
        cmap="cividis",
        linewidth=0.15,
        edgecolor="#00000040",
        antialiased=True,
    )
    panel.contour(x, y, height, levels=[0.0], colors=BLACK, linewidths=1.8, zorder=5)
    panel.view_init(elev=28, azim=-122)
    panel.set_xlabel(r"$\Omega$  [rad/s]", fontsize=8)
    panel.set_ylabel(r"$\beta$", fontsize=8)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(MaxNLocator(5))
    panel.tick_params(labelsize=7, pad=1)
    shown = levels_for(10.0**height, HEIGHTS)
    panel.set_zticks(np.log10(shown), [f"{level:g}" for level in shown])
    panel.set_box_aspect((1.3, 1.0, 0.8), zoom=1.05)


LEVELS = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0)
"""Gains at which contours are drawn."""

GAINING, LOSING = "#DCEBF5", "#B9B9B9"
"""Light where the block reduces the response, dark where it does not."""

JUMP = 0.1
"""Of the range of frequencies: a step of the least gain that is no slope but a jump."""

FOUND, LOST = "o", "X"
MARK: Mapping[str, Any] = {
    "linestyle": "none",
    "markersize": 6,
    "markerfacecolor": "white",
    "markeredgecolor": BLUE,
    "markeredgewidth": 1.6,
}
"""How measured points look: with a gain, without one, and in common."""

SYMBOLS = {"alpha_1": r"$\alpha_1$", "alpha_2": r"$\alpha_2$"}


@dataclass(frozen=True, eq=False)
class Layer:
    """One steady motion over the grid, n stiffnesses by m frequencies; NaN where it does not exist.

    `gains`: alpha_1 and alpha_2 by name, each shape (n, m). `multiplier`: greatest |Floquet multiplier|, shape (n, m).
    """

    gains: Mapping[str, Floats]
    multiplier: Floats

    @property
    def exists(self) -> bool:
        """Whether there is such a motion on two neighbouring points or more, so that it can be drawn."""
        return int(np.isfinite(self.multiplier).sum()) >= 4


@dataclass(frozen=True)
class MapPoint:
    """A measured point on the map: `omega` [rad/s]; `alpha_2` is None where no gain was measured."""

    omega: float
    beta: float
    layer: str
    alpha_2: float | None


def map_figure(
    omegas: Floats,
    betas: Floats,
    rocking: Layer,
    resting: Layer,
    resting_margin: Floats,
    measured: Sequence[MapPoint] = (),
) -> "Figure":
    """Draw surfaces (a), the map of the rocking motion (b) and that of the resting one (c), alpha_1 beside alpha_2.

    `omegas` [rad/s], shape (m,), and `betas`, shape (n,), ascend. `resting_margin`, shape (n, m), is positive where
    the block may rest. `measured` points stand in the maps of alpha_2, each on the layer where it was found. Returns a
    figure that belongs to no window.
    """
    layers = [("b", "block rocking", rocking)]
    if resting.exists:
        layers.append(("c", "block resting", resting))
    figure = new_figure(7.6, 3.4 + 3.3 * len(layers) + 0.6)
    # tick labels at the ends of neighbouring axes must not meet
    layout: Any = figure.get_layout_engine()
    layout.set(w_pad=0.08)
    grid = figure.add_gridspec(1 + len(layers), 2, height_ratios=(1.15, *(1.0 for _ in layers)))
    for column, (name, symbol) in enumerate(SYMBOLS.items()):
        surface: Any = figure.add_subplot(grid[0, column], projection="3d", computed_zorder=False)
        draw_surface(surface, omegas, betas, rocking.gains[name])
        if name == "alpha_2":
            _draw_on_surface(surface, [point for point in measured if point.layer != "resting"])
        surface.set_title(f"(a)  {symbol}, block rocking", fontsize=10, loc="left")
        for row, (letter, words, layer) in enumerate(layers, start=1):
            panel = figure.add_subplot(grid[row, column])
            _draw_map(panel, omegas, betas, layer, name, resting_margin)
            if name == "alpha_2":
                _draw_measured(panel, [point for point in measured if (point.layer == "resting") == (letter == "c")])
            panel.set_title(f"({letter})  {symbol}, {words}", fontsize=10, loc="left")
            panel.set_xlabel(r"$\Omega$  [rad/s]")
            if column == 0:
                panel.set_ylabel(r"stiffness ratio  $\beta$")
            else:
                panel.tick_params(labelleft=False)
    _add_legend(figure, bool((rocking.multiplier > 1.0).any()), _crosses_zero(resting_margin), measured)
    return figure


def _draw_measured(panel: "Axes", points: Sequence[MapPoint]) -> None:
    """Each point with its gain beside it; below it, where the upper edge of the map is near."""
    top = panel.get_ylim()[1]
    for point in points:
        lost = point.alpha_2 is None
        panel.plot(point.omega, point.beta, marker=LOST if lost else FOUND, zorder=6, clip_on=False, **MARK)
        text = panel.annotate(
            "no gain" if lost else f"{point.alpha_2:.3g}",
            (point.omega, point.beta),
            xytext=(0, -7 if point.beta > 0.9 * top else 6),
            textcoords="offset points",
            ha="center",
            va="top" if point.beta > 0.9 * top else "bottom",
            fontsize=7,
            fontweight="bold",
            color=BLUE,
            zorder=7,
        )
        text.set_path_effects([_halo()])


def _halo() -> Any:
    """What keeps numbers readable on lines."""
    from matplotlib.patheffects import withStroke

    return withStroke(linewidth=2.0, foreground="white")


def _draw_on_surface(panel: Any, points: Sequence[MapPoint]) -> None:
    for point in points:
        if point.alpha_2 is not None:
            height = np.log10(np.clip(point.alpha_2, FLOOR, CEILING))
            panel.plot([point.omega], [point.beta], [height], marker=FOUND, zorder=6, **{**MARK, "markersize": 4})


def _draw_map(panel: "Axes", omegas: Floats, betas: Floats, layer: Layer, name: str, resting_margin: Floats) -> None:
    gain = np.ma.masked_invalid(layer.gains[name])
    panel.contourf(omegas, betas, gain, levels=[0.0, 1.0, np.inf], colors=[GAINING, LOSING])
    levels = levels_for(layer.gains[name], LEVELS)
    widths = [1.8 if level == 1.0 else 0.7 for level in levels]
    lines = panel.contour(omegas, betas, gain, levels=levels, colors=BLACK, linewidths=widths)
    panel.clabel(lines, fmt="%g", fontsize=7, inline_spacing=3)
    unstable = np.ma.masked_invalid(layer.multiplier)
    if (unstable > 1.0).any():
        # hatched, not coloured: the gain below must stay readable
        hatched = panel.contourf(omegas, betas, unstable, levels=[1.0, np.inf], colors="none", hatches=["////"])
        hatched.set_edgecolor(VERMILLION)
        hatched.set_linewidth(0.0)
        panel.contour(omegas, betas, unstable, levels=[1.0], colors=VERMILLION, linewidths=0.9)
    if _crosses_zero(resting_margin):
        panel.contour(
            omegas, betas, resting_margin, levels=[0.0], colors=GREEN, linewidths=1.6, linestyles=[(0, (6, 1.5))]
        )
    # the least value may jump from one valley to another: the line then ends and begins anew
    places = least_over_omega(omegas, layer.gains[name])
    jumps = np.flatnonzero(np.abs(np.diff(places)) > JUMP * (omegas[-1] - omegas[0])) + 1
    panel.plot(
        np.insert(places, jumps, np.nan), np.insert(betas, jumps, np.nan), color=PURPLE, linewidth=1.8, linestyle="-."
    )
    if np.isnan(layer.multiplier).mean() > 0.5:
        panel.text(0.04, 0.94, "elsewhere it cannot rest", transform=panel.transAxes, fontsize=8, va="top")
    panel.set_xlim(float(omegas[0]), float(omegas[-1]))
    panel.set_ylim(float(betas[0]), float(betas[-1]))


def _crosses_zero(margin: Floats) -> bool:
    return bool((margin > 0.0).any() and (margin < 0.0).any())


def _add_legend(figure: "Figure", unstable: bool, boundary: bool, measured: Sequence[MapPoint]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Any] = [
        Patch(facecolor=GAINING, edgecolor=BLACK, linewidth=0.5, label="gain region: below 1"),
        Patch(facecolor=LOSING, edgecolor=BLACK, linewidth=0.5, label="no gain: above 1"),
        Line2D([], [], color=BLACK, linewidth=1.8, label="gain of 1"),
        Line2D([], [], color=PURPLE, linewidth=1.8, linestyle="-.", label=r"least over $\Omega$"),
    ]
    if unstable:
        entries.append(
            Patch(facecolor="none", edgecolor=VERMILLION, hatch="////", linewidth=0.9, label="rocking motion unstable")
        )
    if boundary:
        entries.append(
            Line2D([], [], color=GREEN, linewidth=1.6, linestyle=(0, (6, 1.5)), label="right of it the block may rest")
        )
    for marker, words, gainless in (
        (FOUND, r"measured, with its $\alpha_2$", False),
        (LOST, "tested, no gain measured", True),
    ):
        if any((point.alpha_2 is None) == gainless for point in measured):
            entries.append(Line2D([], [], marker=marker, label=words, **MARK))
    figure.legend(handles=entries, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
