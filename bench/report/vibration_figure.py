# pyright: reportUnknownMemberType=false
"""Damping over the amplitude of a frame, and springs as mounted beside their labels.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bench.report.style import BLACK, BLUE, VERMILLION, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Course:
    """Damping ratio of a mode over the amplitude [m] of its drift, with expanded uncertainties, in one decay."""

    amplitude: Sequence[float]
    damping: Sequence[float]
    expanded: Sequence[float]


def damping_figure(modes: Sequence[Sequence[Course]], ratios: Sequence[float]) -> "Figure":
    """A panel for each mode with the courses of all decays, and the ratio that is stated.

    Returns a figure that belongs to no window.
    """
    figure = new_figure(6.8, 2.7)
    panels = figure.subplots(1, len(modes), squeeze=False)[0]
    for number, (panel, courses, ratio) in enumerate(zip(panels, modes, ratios, strict=True), 1):
        for place, course in enumerate(courses):
            panel.errorbar(
                [1e3 * each for each in course.amplitude],
                [100.0 * each for each in course.damping],
                [100.0 * each for each in course.expanded],
                fmt="o",
                ms=3,
                lw=0.8,
                color=BLUE,
                label="windows of the decays (k = 2)" if place == 0 else None,
            )
        panel.axhline(100.0 * ratio, color=VERMILLION, linewidth=0.9, label="stated")
        panel.set_xlabel(f"drift in mode {number}  [mm]", fontsize=8)
        panel.set_ylabel(f"ξ{'₁₂'[number - 1]}  [%]", fontsize=8)
        panel.tick_params(labelsize=8)
        set_grid(panel)
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=7.5, frameon=False
    )
    return figure


def labels_figure(labels: Sequence[float], mounted: Sequence[float], expanded: Sequence[float]) -> "Figure":
    """By how much each spring is off its label [%], with expanded uncertainties.

    Returns a figure that belongs to no window.
    """
    figure = new_figure(6.8, 2.7)
    panel = figure.subplots()
    off = [100.0 * (value / label - 1.0) for value, label in zip(mounted, labels, strict=True)]
    sizes = [100.0 * size / label for size, label in zip(expanded, labels, strict=True)]
    panel.errorbar(labels, off, sizes, fmt="o", ms=4, capsize=3, color=BLUE)
    panel.axhline(0.0, color=BLACK, linewidth=0.8)
    panel.set_xlabel("β on the label  [1]", fontsize=8)
    panel.set_ylabel("β as mounted, off its label  [%]", fontsize=8)
    panel.tick_params(labelsize=8)
    set_grid(panel)
    return figure
