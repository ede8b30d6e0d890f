# pyright: reportUnknownMemberType=false
"""Report section on the free vibration of the frame: values, budgets, and damping against amplitude."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import tau
from typing import TYPE_CHECKING, Any

from bench.analysis.gain import COVERAGE
from bench.document.campaign import Campaign
from bench.document.document import Column, Part, Picture, Section, Table
from bench.document.typography import counted, plain, yes_or_no
from bench.figures.style import BLUE, VERMILLION, new_figure, set_grid
from protocols.common.budgets import budget_parts, budgeted
from protocols.common.decays.report import EXPANDED, Rows, decay_label, expanded_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_SIGNS = {"k1": ("k₁", "k1_n_m"), "k2": ("k₂", "k2_n_m"), "xi1": ("ξ₁", "xi1"), "xi2": ("ξ₂", "xi2")}
"""Symbols and fields of the frame's quantities."""


@dataclass(frozen=True)
class Course:
    """Damping ratio of a mode in one decay, with expanded uncertainty, against the drift amplitude in the mode [m]."""

    amplitude: Sequence[float]
    damping: Sequence[float]
    expanded: Sequence[float]


def vibration_sections(campaign: Campaign) -> list[Section]:
    """Report section on stiffness and damping of the frame, by decay; parts that older files lack are omitted."""
    points = campaign.points
    if not points:
        return []
    parts = [_frame_text(points), _frame(points), *_frame_budget(points), _damping(points), *_damping_course(points)]
    return [Section("frame", "Frame from free vibration", parts)]


def _frame_text(points: list[dict[str, Any]]) -> Part:
    decays = sum(row["decay"] > 0 for row in points)
    together = [row for row in points if row["decay"] == 0]
    text = (
        f"{counted(decays, 'decay')} of the bare frame, each fitted with the exact response to the measured motion of "
        f"the table. {EXPANDED}"
    )
    birge = together[-1]["birge"] if together else None
    if birge is not None:
        text += f" The scatter of the decays, relative to their uncertainties (Birge ratio), is at most {birge:.2f}."
    return text


def _frame(points: list[dict[str, Any]]) -> Table:
    columns = [
        Column("decay", words=True),
        Column("k₁", "N/m"),
        Column("k₂", "N/m"),
        Column("ξ₁", "%"),
        Column("ξ₂", "%"),
        Column("f₁", "Hz"),
        Column("f₂", "Hz"),
    ]
    rows = [
        [
            decay_label(row),
            expanded_text(row, "k1_n_m", "k1"),
            expanded_text(row, "k2_n_m", "k2"),
            expanded_text(row, "xi1", "xi1", 100.0),
            expanded_text(row, "xi2", "xi2", 100.0),
            expanded_text(row, "omega1_rad_s", "omega1", 1.0 / tau),
            expanded_text(row, "omega2_rad_s", "omega2", 1.0 / tau),
        ]
        for row in points
    ]
    return Table("Stiffness, damping and natural frequencies of the bare frame", columns, rows)


def _frame_budget(points: Rows) -> list[Part]:
    """Uncertainty budget of the frame, for all decays together."""
    together = [row for row in points if row["decay"] == 0 and row.get("k1_parts")]
    if not together:
        return []
    row = together[-1]
    results = [
        result
        for name, (symbol, field) in _SIGNS.items()
        for result in budgeted(symbol, row[field], row[f"{name}_parts"], row[f"{name}_uncertainty"])
    ]
    return budget_parts("the frame", results)


def _damping(points: list[dict[str, Any]]) -> Table:
    columns = [
        Column("decay", words=True),
        Column("drift", "mm"),
        Column("residual", "µm"),
        Column("slope of ξ₁ with drift", "%/mm"),
        Column("slope of ξ₂ with drift", "%/mm"),
        Column("significant", words=True),
    ]
    rows = [
        [
            decay_label(row),
            plain(1e3 * row["drift_peak_m"], 3),
            plain(1e6 * row["residual_m"], 3),
            expanded_text(row, "slope1_per_m", "slope1", 0.1),
            expanded_text(row, "slope2_per_m", "slope2", 0.1),
            yes_or_no(not row["damping_is_linear"]),
        ]
        for row in points
    ]
    return Table(
        "Peak drift, residual of the fit, and change of damping with amplitude (significant: 99 %)", columns, rows
    )


def _damping_course(points: Rows) -> list[Part]:
    """Damping ratios of both modes against amplitude, from several windows of every decay."""
    told = [row for row in points if row.get("damping1_course")]
    together = [row for row in points if row["decay"] == 0]
    if not told or not together:
        return []
    modes = [[_course(row[f"damping{mode}_course"]) for row in told] for mode in (1, 2)]
    figure = _damping_figure(modes, [together[-1]["xi1"], together[-1]["xi2"]])
    caption = (
        "Damping ratios in five windows of every decay against the drift amplitude in the mode, and the combined "
        "values (lines)."
    )
    return [Picture(figure, caption, "Damping ratio against amplitude for both modes, with the combined value.")]


def _course(told: str) -> Course:
    amplitude, damping, uncertainty = json.loads(told)
    return Course(amplitude, damping, [COVERAGE * each for each in uncertainty])


def _damping_figure(modes: Sequence[Sequence[Course]], ratios: Sequence[float]) -> "Figure":
    """Figure with a panel for each mode: damping ratio of every decay against amplitude, and the combined value."""
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
        panel.axhline(100.0 * ratio, color=VERMILLION, linewidth=0.9, label="all decays combined")
        panel.set_xlabel(f"drift in mode {number}  [mm]", fontsize=8)
        panel.set_ylabel(f"ξ{'₁₂'[number - 1]}  [%]", fontsize=8)
        panel.tick_params(labelsize=8)
        set_grid(panel)
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=7.5, frameon=False
    )
    return figure
