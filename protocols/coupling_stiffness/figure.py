# pyright: reportUnknownMemberType=false
"""The springs: as mounted over as labelled, the decay of each, and what the uncertainty is made of.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bench.analysis.gain import COVERAGE
from bench.analysis.rounding import plus_minus
from bench.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILLION, new_figure, set_grid
from protocols.coupling_stiffness.difference import SpringResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 6.0
"""Time of a decay that is drawn after the pulse [s]: enough to see its modes."""


def springs_figure(springs: Sequence[SpringResult]) -> "Figure":
    """Two rows for each spring below the comparison: decay and residual; without springs it is empty."""
    figure = new_figure(9.0, 3.6 + 3.2 * len(springs))
    grid = figure.add_gridspec(1 + 2 * len(springs), 2, height_ratios=(3.4, *[2.2, 1.0] * len(springs)))
    compared, budget = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
    for panel in (compared, budget):
        set_grid(panel)
    if not springs:
        compared.set_title("no spring was identified", loc="left", fontsize=10)
        return figure
    _draw_compared(compared, springs)
    _draw_budget(budget, springs)
    for place, spring in enumerate(springs):
        above = figure.add_subplot(grid[1 + 2 * place, :])
        _draw_decay(above, figure.add_subplot(grid[2 + 2 * place, :], sharex=above), spring)
    return figure


def _draw_compared(panel: "Axes", springs: Sequence[SpringResult]) -> None:
    labels = np.array([spring.label for spring in springs])
    mounted = np.array([spring.beta for spring in springs])
    doubts = np.array([COVERAGE * spring.beta_uncertainty for spring in springs])
    panel.errorbar(labels, 100.0 * (mounted / labels - 1.0), 100.0 * doubts / labels, fmt="o", ms=4, color=BLUE)
    panel.axhline(0.0, color=BLACK, linewidth=0.8)
    panel.set_xlabel(r"$\beta$ on the label [1]")
    panel.set_ylabel(r"$\beta$ as mounted, off its label [%]")


def _draw_budget(panel: "Axes", springs: Sequence[SpringResult]) -> None:
    """Standard uncertainties of the stiffness relative to it, part by part, and the whole."""
    places = np.arange(len(springs))
    names = [*springs[0].parts, "together"]
    width = 0.8 / len(names)
    for number, (name, colour) in enumerate(zip(names, (BLUE, GREEN, GREY, ORANGE, BLACK), strict=True)):
        sizes = [spring.uncertainty if name == "together" else spring.parts[name] for spring in springs]
        share = [100.0 * size / spring.k_c for size, spring in zip(sizes, springs, strict=True)]
        panel.bar(places + number * width, share, width, color=colour, label=name)
    panel.set_xticks(places + 0.4 - 0.5 * width, [f"{spring.label:g}" for spring in springs])
    panel.set_xlabel(r"$\beta$ on the label [1]")
    panel.set_ylabel("standard uncertainty of $k_C$ [%]")
    panel.margins(y=0.35)
    panel.legend(loc="upper left", fontsize=7, ncols=3)


def _draw_decay(panel: "Axes", below: "Axes", spring: SpringResult) -> None:
    decay = spring.held.decays[0]
    fit = decay.fit
    shown = fit.stretch.time < decay.begin + SHOWN
    time = fit.stretch.time[shown]
    measured, fitted = ((each[1] - each[0])[shown] for each in (fit.stretch.seen, fit.fitted))
    panel.plot(time, 1e3 * measured, color=BLUE, linewidth=0.9, label="measured (first decay)")
    panel.plot(time, 1e3 * fitted, "--", color=VERMILLION, linewidth=0.9, label="fitted")
    below.plot(time, 1e6 * (measured - fitted), color=BLUE, linewidth=0.4)
    panel.tick_params(labelbottom=False)
    panel.set_ylabel("drift [mm]")
    panel.legend(loc="upper right", fontsize=7, ncols=2)
    below.set_xlabel("time [s]")
    below.set_ylabel("residual [um]")
    found = plus_minus(spring.k_c, COVERAGE * spring.uncertainty)
    panel.set_title(rf"$\beta$ = {spring.label:g} on the label: $k_C$ = {found} N/m (k = 2)", loc="left", fontsize=8)
    set_grid(panel)
    set_grid(below)
