# pyright: reportUnknownMemberType=false
"""Results of the coupling-stiffness test: text table, figure, and report section."""

from collections.abc import Sequence
from math import tau
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.analysis.gain import COVERAGE
from bench.analysis.uncertainty import plus_minus
from bench.document.campaign import Campaign
from bench.document.document import Column, Part, Picture, Section, Table
from bench.document.typography import plain
from bench.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILLION, new_figure, set_grid
from bench.figures.text_table import TextColumn, text_table
from protocols.common.budgets import budget_parts, budgeted
from protocols.common.decays.report import EXPANDED, Rows, decay_label, expanded_text
from protocols.coupling_stiffness.protocol import SpringPoint
from protocols.coupling_stiffness.springs import SpringResult

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
"""Length of the drawn part of a decay, from the end of the pulse [s], long enough to show both modes."""


def springs_table(points: Sequence[SpringPoint]) -> str:
    """Table of the bare frame and every spring, from all decays, with expanded uncertainties (k = 2)."""
    together = [point for point in points if point.decay == 0]
    if not together:
        return "Nothing was identified."
    table = text_table(_COLUMNS, map(_cells, together))
    return "\n".join([table, "", "+- is the expanded uncertainty, k = 2."])


def springs_figure(springs: Sequence[SpringResult]) -> "Figure":
    """Figure that compares the springs, with two rows for each spring: decay and residual. Without springs, the panels
    are empty.
    """
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
    panel.set_ylabel("deviation of $\\beta$\nfrom the label [%]")


def _draw_budget(panel: "Axes", springs: Sequence[SpringResult]) -> None:
    """Draw the relative standard uncertainties of the stiffness, by contribution and in total."""
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
    measured, fitted = ((each[1] - each[0])[shown] for each in (fit.stretch.readings, fit.fitted))
    panel.plot(time, 1e3 * measured, color=BLUE, linewidth=0.9, label="measured (first decay)")
    panel.plot(time, 1e3 * fitted, "--", color=VERMILLION, linewidth=0.9, label="fitted")
    below.plot(time, 1e6 * (measured - fitted), color=BLUE, linewidth=0.4)
    panel.tick_params(labelbottom=False)
    panel.set_ylabel("drift [mm]")
    panel.legend(loc="upper right", fontsize=7, ncols=2)
    below.set_xlabel("time [s]")
    below.set_ylabel("residual [µm]")
    found = plus_minus(spring.k_c, COVERAGE * spring.uncertainty, sign="±")
    panel.set_title(rf"$\beta$ = {spring.label:g} on the label: $k_C$ = {found} N/m (k = 2)", loc="left", fontsize=8)
    set_grid(panel)
    set_grid(below)


def springs_sections(campaign: Campaign) -> list[Section]:
    """Report section on the stiffness of the mounted springs, with each decay."""
    points = campaign.points
    if not points:
        return []
    text = (
        "With the block clamped, the spring adds to the stiffness of the first storey; k_C is the difference "
        f"from the bare frame. {EXPANDED}"
    )
    return [Section("springs", "Springs with the block clamped", [text, _springs(points), *_spring_pictures(points)])]


def _springs(points: list[dict[str, Any]]) -> Table:
    columns = [
        Column("spring β", words=True),
        Column("decay", words=True),
        Column("k₁ + k_C", "N/m"),
        Column("k_C", "N/m"),
        Column("as labelled", "N/m"),
        Column("β mounted", "1"),
        Column("k₂", "N/m"),
    ]
    rows = [
        [
            "bare frame" if row["beta"] is None else f"{row['beta']:g}",
            decay_label(row),
            expanded_text(row, "k1_with_spring_n_m", "k1_with_spring"),
            expanded_text(row, "k_c_n_m", "k_c"),
            plain(row["k_c_nominal_n_m"], 5),
            expanded_text(row, "beta_mounted", "beta"),
            expanded_text(row, "k2_n_m", "k2"),
        ]
        for row in points
    ]
    return Table("Stiffness of the springs as mounted", columns, rows)


def _spring_pictures(points: Rows) -> list[Part]:
    """Figures of the deviation of the springs from their labels, and of their uncertainty budget."""
    rows = [row for row in points if row["beta"] is not None and row["decay"] == 0]
    if not rows:
        return []
    figure = _labels_figure(*([row[name] for row in rows] for name in ("beta", "beta_mounted", "beta_uncertainty")))
    caption = "Deviation of the mounted springs from their labels, with expanded uncertainties (k = 2)."
    parts: list[Part] = [Picture(figure, caption, "Deviation of each spring from its label.")]
    results = [
        result
        for row in rows
        for result in budgeted(f"β = {row['beta']:g}", row["k_c_n_m"], row.get("k_c_parts"), row["k_c_uncertainty"])
    ]
    return parts + budget_parts("k_C", results)


def _labels_figure(labels: Sequence[float], mounted: Sequence[float], expanded: Sequence[float]) -> "Figure":
    """Figure of the deviation of each spring from its label [%], with expanded uncertainties."""
    figure = new_figure(6.8, 2.7)
    panel = figure.subplots()
    off = [100.0 * (value / label - 1.0) for value, label in zip(mounted, labels, strict=True)]
    sizes = [100.0 * size / label for size, label in zip(expanded, labels, strict=True)]
    panel.errorbar(labels, off, sizes, fmt="o", ms=4, capsize=3, color=BLUE)
    panel.axhline(0.0, color=BLACK, linewidth=0.8)
    panel.set_xlabel("β on the label  [1]", fontsize=8)
    panel.set_ylabel("β as mounted, deviation from the label [%]", fontsize=8)
    panel.tick_params(labelsize=8)
    set_grid(panel)
    return figure
