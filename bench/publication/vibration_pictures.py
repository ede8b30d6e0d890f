"""Budgets, damping over the amplitude, and springs beside their labels, from the points of the file.

Points of files from before there were budgets have none: what they lack is left out.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from bench.publication.numbers import ABSENT
from bench.report.budget_figure import budget_figure
from bench.report.page.document import Column, Part, Picture, Table
from bench.report.vibration_figure import Course, damping_figure, labels_figure

_COVERAGE = 2.0
_SIGNS = {"k1": ("k₁", "k1_n_m"), "k2": ("k₂", "k2_n_m"), "xi1": ("ξ₁", "xi1"), "xi2": ("ξ₂", "xi2")}

Rows = Sequence[Mapping[str, Any]]


def frame_budget(points: Rows) -> list[Part]:
    """A table and bars of what makes the uncertainty of the frame, all decays together."""
    together = [row for row in points if row["decay"] == 0 and row.get("k1_parts")]
    if not together:
        return []
    row = together[-1]
    shares = [_shares(row[f"{name}_parts"], row[field]) for name, (_, field) in _SIGNS.items()]
    expanded = [100.0 * row[f"{name}_uncertainty"] / abs(row[field]) for name, (_, field) in _SIGNS.items()]
    return _budget("the frame", [sign for sign, _ in _SIGNS.values()], shares, expanded)


def damping_course(points: Rows) -> list[Part]:
    """The damping ratios of both modes over the amplitude, in windows of every decay."""
    told = [row for row in points if row.get("damping1_course")]
    together = [row for row in points if row["decay"] == 0]
    if not told or not together:
        return []
    modes = [[_course(row[f"damping{mode}_course"]) for row in told] for mode in (1, 2)]
    figure = damping_figure(modes, [together[-1]["xi1"], together[-1]["xi2"]])
    caption = "Damping ratios in five windows of every decay over the amplitude of the drift in the mode."
    return [Picture(figure, caption, "Damping ratio over amplitude for both modes, with the stated value.")]


def spring_pictures(points: Rows) -> list[Part]:
    """Springs beside their labels, and what makes their uncertainty."""
    rows = [row for row in points if row["beta"] is not None and row["decay"] == 0]
    if not rows:
        return []
    figure = labels_figure(*([row[name] for row in rows] for name in ("beta", "beta_mounted", "beta_uncertainty")))
    caption = "How far the springs as mounted are off their labels, with expanded uncertainties (k = 2)."
    parts: list[Part] = [Picture(figure, caption, "Deviation of every spring from its label.")]
    known = [row for row in rows if row.get("k_c_parts")]
    if not known:
        return parts
    shares = [_shares(row["k_c_parts"], row["k_c_n_m"]) for row in known]
    expanded = [100.0 * row["k_c_uncertainty"] / abs(row["k_c_n_m"]) for row in known]
    return parts + _budget("k_C", [f"β = {row['beta']:g}" for row in known], shares, expanded)


def _budget(quantity: str, labels: list[str], shares: list[dict[str, float]], expanded: list[float]) -> list[Part]:
    names = sorted({name for each in shares for name in each}, key=lambda name: -sum(s.get(name, 0.0) for s in shares))
    columns = [Column("quantity", words=True), Column("U (k = 2)", "%"), *(Column(name, "%") for name in names)]
    rows = [
        [label, f"{size:.4f}", *(f"{share[name]:.4f}" if name in share else ABSENT for name in names)]
        for label, size, share in zip(labels, expanded, shares, strict=True)
    ]
    caption = f"Uncertainty budget of {quantity}: expanded, and standard by part, the largest first"
    figure = budget_figure(labels, shares, expanded, "expanded uncertainty")
    text = f"What makes the uncertainty of {quantity}: bars as long as it is, cut in the shares of the variance."
    return [Table(caption, columns, rows), Picture(figure, text, "Horizontal bars divided by contribution.")]


def _shares(parts: str, value: float) -> dict[str, float]:
    """Standard uncertainties relative to the value [%], by part."""
    return {name: 100.0 * size / abs(value) for name, size in json.loads(parts).items()}


def _course(told: str) -> Course:
    amplitude, damping, uncertainty = json.loads(told)
    return Course(amplitude, damping, [_COVERAGE * each for each in uncertainty])
