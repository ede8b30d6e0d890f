# pyright: reportUnknownMemberType=false
"""Uncertainty budgets: one bar per measured value, with the expanded uncertainty as its length."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from bench.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = (BLUE, ORANGE, GREEN, VERMILLION, PURPLE, GREY, BLACK)


def budget_figure(
    labels: Sequence[str],
    budgets: Sequence[Mapping[str, float]],
    expanded: Sequence[float],
    quantity: str = "expanded uncertainty of α₂",
) -> "Figure":
    """Horizontal bars, each divided in proportion to the contributions to the variance.

    `budgets` are the standard uncertainties of each bar by contribution; `expanded` are the lengths of the bars [%].
    """
    total = {name: sum(budget.get(name, 0.0) ** 2 for budget in budgets) for budget in budgets for name in budget}
    # with few bars, the legend to their right is taller than they are
    figure = new_figure(6.8, max(1.2 + 0.22 * len(labels), 0.6 + 0.18 * len(total)))
    panel = figure.subplots()
    rows = range(len(labels))
    left = [0.0] * len(labels)
    for name, colour in zip(sorted(total, key=lambda each: -total[each]), COLOURS * len(total), strict=False):
        widths = [
            length * budget.get(name, 0.0) ** 2 / (sum(value**2 for value in budget.values()) or 1.0)
            for budget, length in zip(budgets, expanded, strict=True)
        ]
        panel.barh(rows, widths, left=left, color=colour, label=name, height=0.7)
        left = [start + width for start, width in zip(left, widths, strict=True)]
    panel.set_yticks(rows, labels, fontsize=7.5)
    panel.invert_yaxis()
    panel.set_xlabel(f"{quantity}, k = 2  [%]", fontsize=8)
    panel.tick_params(labelsize=8)
    set_grid(panel)
    panel.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=7.5, frameon=False)
    return figure
