"""The uncertainty budgets of measured gains, from the parts that the file keeps with each."""

import json
from collections.abc import Mapping, Sequence
from typing import Any, cast

from bench.publication.numbers import ABSENT
from bench.report.budget_figure import budget_figure
from bench.report.page.document import Column, Part, Picture, Table

MOST = 30
"""Bars of a figure."""


def budget_parts(points: Sequence[Mapping[str, Any]]) -> list[Part]:
    """A table and a figure of the harmonic points with a budget; nothing for files from before there were any."""
    known = [(row, found) for row in points if row["alpha_2"] and (found := _budget(row))]
    if not known:
        return []
    totals = {
        name: sum((found.get(name, 0.0) / row["alpha_2"]) ** 2 for row, found in known)
        for _, found in known
        for name in found
    }
    names = sorted(totals, key=lambda name: -totals[name])
    labels = [f"β = {row['beta']:g}, Ω = {row['omega_rad_s']:g} rad/s" for row, _ in known]
    expanded = [100.0 * row["alpha_2_uncertainty"] / row["alpha_2"] for row, _ in known]
    columns = [Column("point", words=True), Column("U (k = 2)", "%"), *(Column(name, "%") for name in names)]
    rows = [
        [label, f"{size:.2f}", *(_share(found, name, row["alpha_2"]) for name in names)]
        for label, size, (row, found) in zip(labels, expanded, known, strict=True)
    ]
    caption = "Uncertainty budget of α₂: expanded, and standard by part, the largest first; what is common cancels"
    picture = Picture(
        budget_figure(labels[:MOST], [found for _, found in known[:MOST]], expanded[:MOST]),
        "What makes the uncertainty of α₂: bars as long as it is (k = 2), cut in the shares of the variance.",
        "Horizontal bars of the expanded uncertainty at every point, divided by contribution.",
    )
    return [Table(caption, columns, rows), picture]


def _budget(row: Mapping[str, Any]) -> dict[str, float]:
    text = row.get("uncertainty_parts")
    return cast(dict[str, float], json.loads(text)) if text else {}


def _share(found: Mapping[str, float], name: str, alpha: float) -> str:
    return f"{100.0 * found[name] / alpha:.3f}" if name in found else ABSENT
