# pyright: reportUnknownMemberType=false
"""Restitution of every impact of a rocking block, over the speed of the impact.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
_MARKS = "osD^vP"


@dataclass(frozen=True, eq=False)
class Impacts:
    """The impacts after one tilt [rad]: `speed` over that of a fall from the critical angle, r and its expanded
    uncertainty by noise, each of shape (n,).
    """

    tilt: float
    speed: NDArray[np.float64]
    restitution: NDArray[np.float64]
    uncertainty: NDArray[np.float64]


def impacts_figure(tilts: Sequence[Impacts], mean: float, theory: float) -> "Figure":
    """`draw_impacts` as a figure of its own, which belongs to no window."""
    figure = new_figure(7.0, 3.4)
    panel = figure.subplots()
    set_grid(panel)
    draw_impacts(panel, tilts, mean, theory)
    return figure


def draw_impacts(panel: "Axes", tilts: Sequence[Impacts], mean: float, theory: float) -> None:
    """Single impacts, the `mean` restitution that was found, and the theoretical one."""
    for number, tilt in enumerate(tilts):
        panel.errorbar(
            tilt.speed,
            tilt.restitution,
            tilt.uncertainty,
            fmt=_MARKS[number % len(_MARKS)],
            ms=3.5,
            lw=0.7,
            color=_COLOURS[number % len(_COLOURS)],
            label=f"{1e3 * tilt.tilt:+.0f} mrad",
        )
    panel.axhline(mean, color=BLACK, lw=1.2, label="all tilts")
    panel.axhline(theory, color=GREY, ls="--", lw=1.2, label="theory")
    panel.set_ylabel("r of single impacts,\nby amplitudes (k = 2, noise)")
    panel.set_xlabel("angular velocity at the impact, over that of a fall from the critical angle")
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
