# pyright: reportUnknownMemberType=false
"""The springs as text for the terminal and as a figure: mounted against label, the decay of each, the budget.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from math import tau
from typing import TYPE_CHECKING

import numpy as np

from bench.analysis.gain import COVERAGE
from bench.analysis.rounding import plus_minus
from bench.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILLION, new_figure, set_grid
from bench.report.text_table import TextColumn, text_table
from protocols.coupling_stiffness.difference import SpringResult
from protocols.coupling_stiffness.protocol import SpringPoint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS = (
    TextColumn("spring", words=True),
    TextColumn("decays"),
    TextColumn("k1 + kC", "N/m"),
    TextColumn("kC", "N/m"),
    TextColumn("nominal kC", "N/m"),
    TextColumn("beta", "1"),
    TextColumn("k2", "N/m"),
    TextColumn("f1", "Hz"),
    TextColumn("f2", "Hz"),
)

SHOWN = 6.0
"""Time of a decay that is drawn after the pulse [s]: enough to see its modes."""


def springs_table(points: Sequence[SpringPoint]) -> str:
    """The bare frame and every spring, all decays together, with expanded uncertainties (k = 2)."""
    together = [point for point in points if point.decay == 0]
    if not together:
        return "Nothing was identified."
    table = text_table(_COLUMNS, map(_cells, together))
    return "\n".join([table, "", "+- is the expanded uncertainty, k = 2."])


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
    for row, spring in enumerate(springs):
        above = figure.add_subplot(grid[1 + 2 * row, :])
        _draw_decay(above, figure.add_subplot(grid[2 + 2 * row, :], sharex=above), spring)
    return figure


def _cells(point: SpringPoint) -> tuple[str, ...]:
    return (
        "none" if point.beta is None else f"{point.beta:g}",
        str(point.decays),
        plus_minus(point.k1_with_spring_n_m, point.k1_with_spring_uncertainty),
        "" if point.k_c_n_m is None else plus_minus(point.k_c_n_m, point.k_c_uncertainty or 0.0),
        "" if point.k_c_nominal_n_m is None else f"{point.k_c_nominal_n_m:.2f}",
        "" if point.beta_mounted is None else plus_minus(point.beta_mounted, point.beta_uncertainty or 0.0),
        plus_minus(point.k2_n_m, point.k2_uncertainty),
        plus_minus(point.omega1_rad_s / tau, point.omega1_uncertainty / tau),
        plus_minus(point.omega2_rad_s / tau, point.omega2_uncertainty / tau),
    )


def _draw_compared(panel: "Axes", springs: Sequence[SpringResult]) -> None:
    labels = np.array([spring.label for spring in springs])
    mounted = np.array([spring.beta for spring in springs])
    expanded = np.array([COVERAGE * spring.beta_uncertainty for spring in springs])
    panel.errorbar(labels, 100.0 * (mounted / labels - 1.0), 100.0 * expanded / labels, fmt="o", ms=4, color=BLUE)
    panel.axhline(0.0, color=BLACK, linewidth=0.8)
    panel.set_xlabel(r"$\beta$ on the label [1]")
    panel.set_ylabel(r"$\beta$ as mounted, off its label [%]")


def _draw_budget(panel: "Axes", springs: Sequence[SpringResult]) -> None:
    """Standard uncertainties of the stiffness relative to it, part by part, and the whole."""
    positions = np.arange(len(springs))
    names = [*springs[0].parts, "together"]
    width = 0.8 / len(names)
    for number, (name, colour) in enumerate(zip(names, (BLUE, GREEN, GREY, ORANGE, BLACK), strict=True)):
        uncertainties = [spring.uncertainty if name == "together" else spring.parts[name] for spring in springs]
        share = [100.0 * part / spring.k_c for part, spring in zip(uncertainties, springs, strict=True)]
        panel.bar(positions + number * width, share, width, color=colour, label=name)
    panel.set_xticks(positions + 0.4 - 0.5 * width, [f"{spring.label:g}" for spring in springs])
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
