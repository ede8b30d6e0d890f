# pyright: reportUnknownMemberType=false
"""Gain surfaces of the rocking motion, and maps of the rocking and any resting motion, as in Fig. 4 of the paper."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.figures.style import BLACK, BLUE, GREEN, PURPLE, VERMILLION, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

HEIGHTS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Tick labels along the height of a surface."""

FLOOR, CEILING = 0.01, 100.0
"""Limits at which the surfaces clip the gain."""


LEVELS = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0)
"""Gains at which contours are drawn."""

GAINING, LOSING = "#DCEBF5", "#B9B9B9"
"""Colours of the gain: light where the block reduces the response, dark where it does not."""

FEWEST_LEVELS = 4
"""Minimum number of the usual contour levels within the range of a gain; if there are fewer, other levels are drawn."""

JUMP = 0.1
"""Difference between the frequencies of least gain of adjacent stiffnesses, as a fraction of the frequency range, above
which the line through them is broken.
"""

FOUND, LOST = "o", "X"
MARK: Mapping[str, Any] = {
    "linestyle": "none",
    "markersize": 6,
    "markerfacecolor": "white",
    "markeredgecolor": BLUE,
    "markeredgewidth": 1.6,
}
"""Styles of measured points: markers of a point with a gain and of one without, and common properties."""

SYMBOLS = {"alpha_1": r"$\alpha_1$", "alpha_2": r"$\alpha_2$"}


@dataclass(frozen=True, eq=False)
class BranchGrid:
    """Branch of steady motions on the grid of n stiffnesses by m frequencies; NaN where the motion does not exist.

    gains : alpha_1 and alpha_2 by name, each of shape (n, m).
    multiplier : greatest |Floquet multiplier|, shape (n, m).
    """

    gains: Mapping[str, Floats]
    multiplier: Floats

    @property
    def exists(self) -> bool:
        """Whether the motion exists at enough points for contours."""
        return int(np.isfinite(self.multiplier).sum()) >= 4


@dataclass(frozen=True)
class MapPoint:
    """Measured point on the map at `omega` [rad/s]; `alpha_2` is None where no gain was measured."""

    omega: float
    beta: float
    branch: str
    alpha_2: float | None


def map_figure(
    omegas: Floats,
    betas: Floats,
    rocking: BranchGrid,
    resting: BranchGrid,
    resting_margin: Floats,
    measured: Sequence[MapPoint] = (),
) -> "Figure":
    """Surface (a) and map (b) of the rocking motion, and map of the resting motion (c), for alpha_1 and alpha_2.

    `omegas` [rad/s], shape (m,), and `betas`, shape (n,), are ascending. `resting_margin`, shape (n, m), is positive
    where the block may rest. `measured` points are drawn on the surface and the maps of alpha_2, each on its branch.
    """
    branches = [("b", "block rocking", rocking)]
    if resting.exists:
        branches.append(("c", "block resting", resting))
    figure = new_figure(7.6, 3.4 + 3.3 * len(branches) + 0.6)
    # prevent overlapping tick labels at the ends of neighbouring axes
    layout: Any = figure.get_layout_engine()
    layout.set(w_pad=0.08)
    grid = figure.add_gridspec(1 + len(branches), 2, height_ratios=(1.15, *(1.0 for _ in branches)))
    for column, (name, symbol) in enumerate(SYMBOLS.items()):
        surface: Any = figure.add_subplot(grid[0, column], projection="3d", computed_zorder=False)
        _draw_surface(surface, omegas, betas, rocking.gains[name])
        if name == "alpha_2":
            _draw_on_surface(surface, [point for point in measured if point.branch != "resting"])
        surface.set_title(f"(a)  {symbol}, block rocking", fontsize=10, loc="left")
        for row, (letter, words, branch) in enumerate(branches, start=1):
            panel = figure.add_subplot(grid[row, column])
            _draw_map(panel, omegas, betas, branch, name, resting_margin)
            if name == "alpha_2":
                _draw_measured(panel, [point for point in measured if (point.branch == "resting") == (letter == "c")])
            panel.set_title(f"({letter})  {symbol}, {words}", fontsize=10, loc="left")
            panel.set_xlabel(r"$\Omega$  [rad/s]")
            if column == 0:
                panel.set_ylabel(r"stiffness ratio  $\beta$")
            else:
                panel.tick_params(labelleft=False)
    _add_legend(figure, bool((rocking.multiplier > 1.0).any()), _crosses_zero(resting_margin), measured)
    return figure


def _draw_surface(panel: Any, omegas: Floats, betas: Floats, gain: Floats) -> None:
    """Draws the gain as a logarithmic height, with a line at unity."""
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


def _draw_measured(panel: "Axes", points: Sequence[MapPoint]) -> None:
    """Draws each point and its gain, above the point or, near the upper edge of the map, below it."""
    from matplotlib.patheffects import withStroke

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
        # keep the text legible on contour lines
        text.set_path_effects([withStroke(linewidth=2.0, foreground="white")])


def _draw_on_surface(panel: Any, points: Sequence[MapPoint]) -> None:
    for point in points:
        if point.alpha_2 is not None:
            height = np.log10(np.clip(point.alpha_2, FLOOR, CEILING))
            panel.plot([point.omega], [point.beta], [height], marker=FOUND, zorder=6, **{**MARK, "markersize": 4})


def _draw_map(
    panel: "Axes", omegas: Floats, betas: Floats, branch: BranchGrid, name: str, resting_margin: Floats
) -> None:
    gain = np.ma.masked_invalid(branch.gains[name])
    panel.contourf(omegas, betas, gain, levels=[0.0, 1.0, np.inf], colors=[GAINING, LOSING])
    levels = levels_for(branch.gains[name], LEVELS)
    widths = [1.8 if level == 1.0 else 0.7 for level in levels]
    lines = panel.contour(omegas, betas, gain, levels=levels, colors=BLACK, linewidths=widths)
    panel.clabel(lines, fmt="%g", fontsize=7, inline_spacing=3)
    unstable = np.ma.masked_invalid(branch.multiplier)
    if (unstable > 1.0).any():
        # hatched rather than coloured, so that the gain stays legible
        hatched = panel.contourf(omegas, betas, unstable, levels=[1.0, np.inf], colors="none", hatches=["////"])
        hatched.set_edgecolor(VERMILLION)
        hatched.set_linewidth(0.0)
        panel.contour(omegas, betas, unstable, levels=[1.0], colors=VERMILLION, linewidths=0.9)
    if _crosses_zero(resting_margin):
        panel.contour(
            omegas, betas, resting_margin, levels=[0.0], colors=GREEN, linewidths=1.6, linestyles=[(0, (6, 1.5))]
        )
    # break the line where the frequency of least gain jumps from one valley to another
    least = least_over_omega(omegas, branch.gains[name])
    jumps = np.flatnonzero(np.abs(np.diff(least)) > JUMP * (omegas[-1] - omegas[0])) + 1
    panel.plot(
        np.insert(least, jumps, np.nan), np.insert(betas, jumps, np.nan), color=PURPLE, linewidth=1.8, linestyle="-."
    )
    if np.isnan(branch.multiplier).mean() > 0.5:
        panel.text(0.04, 0.94, "block cannot rest elsewhere", transform=panel.transAxes, fontsize=8, va="top")
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
        Line2D([], [], color=PURPLE, linewidth=1.8, linestyle="-.", label=r"minimum over $\Omega$"),
    ]
    if unstable:
        entries.append(
            Patch(facecolor="none", edgecolor=VERMILLION, hatch="////", linewidth=0.9, label="rocking motion unstable")
        )
    if boundary:
        entries.append(
            Line2D(
                [],
                [],
                color=GREEN,
                linewidth=1.6,
                linestyle=(0, (6, 1.5)),
                label="block may rest to the right of this line",
            )
        )
    for marker, words, gainless in (
        (FOUND, r"measured, with its $\alpha_2$", False),
        (LOST, "tested, no gain measured", True),
    ):
        if any((point.alpha_2 is None) == gainless for point in measured):
            entries.append(Line2D([], [], marker=marker, label=words, **MARK))
    figure.legend(handles=entries, loc="outside lower center", ncols=3, fontsize=8, frameon=False)


def least_over_omega(omegas: Floats, gain: Floats) -> Floats:
    """Frequency [rad/s], shape (n,), of the least `gain`, shape (n, m), within the range of `omegas`, shape (m,).

    Fits a parabola to three points of log(gain); NaN where the least value is at the edge or its neighbours
    are absent.
    """
    least = np.full(len(gain), np.nan)
    for i, row in enumerate(np.log(gain)):
        if np.isnan(row).all():
            continue
        k = int(np.nanargmin(row))
        if 0 < k < len(omegas) - 1 and np.isfinite(row[k - 1 : k + 2]).all():
            fit = np.asarray(np.polyfit(omegas[k - 1 : k + 2] - omegas[k], row[k - 1 : k + 2], 2), dtype=np.float64)
            least[i] = omegas[k] - 0.5 * float(fit[1] / fit[0]) if fit[0] > 0.0 else omegas[k]
    return least


def levels_for(gain: Floats, usual: Sequence[float]) -> list[float]:
    """The `usual` contour levels that a gain crosses, ascending; if these are too few, round numbers between the
    extremes of the gain.
    """
    from matplotlib.ticker import MaxNLocator

    finite = gain[np.isfinite(gain)]
    if not finite.size:
        return [1.0]
    low, high = float(finite.min()), float(finite.max())
    levels = [level for level in usual if low <= level <= high]
    if len(levels) < FEWEST_LEVELS:
        rounds = (float(level) for level in MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(low, high))
        levels = [level for level in rounds if low <= level <= high and level > 0.0]
    return levels or [low]
