"""Report parts shared by decays of the frame and of the springs."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from bench.document.document import Column, Part, Picture, Table
from bench.document.typography import ABSENT, with_uncertainty
from bench.figures.budget_figure import budget_figure

Rows = Sequence[Mapping[str, Any]]

EXPANDED = "Uncertainties are expanded (k = 2) and include the uncertainty of the masses."


def budget_parts(quantity: str, labels: list[str], shares: list[dict[str, float]], expanded: list[float]) -> list[Part]:
    """Table and bar chart of an uncertainty budget: `shares` by contribution and `expanded` uncertainties, all in %."""
    names = sorted({name for each in shares for name in each}, key=lambda name: -sum(s.get(name, 0.0) for s in shares))
    columns = [Column("quantity", words=True), Column("U (k = 2)", "%"), *(Column(name, "%") for name in names)]
    rows = [
        [label, f"{size:.4f}", *(f"{share[name]:.4f}" if name in share else ABSENT for name in names)]
        for label, size, share in zip(labels, expanded, shares, strict=True)
    ]
    caption = (
        f"Uncertainty budget of {quantity}: expanded uncertainty, and standard uncertainties by contribution, "
        "largest first"
    )
    figure = budget_figure(labels, shares, expanded, "expanded uncertainty")
    text = (
        f"Contributions to the uncertainty of {quantity}: each bar is the expanded uncertainty, divided in proportion "
        "to the contributions to the variance."
    )
    return [Table(caption, columns, rows), Picture(figure, text, "Horizontal bars split by contribution.")]


def relative_parts(parts: str, value: float) -> dict[str, float]:
    """Standard uncertainties relative to the value [%], by contribution."""
    return {name: 100.0 * size / abs(value) for name, size in json.loads(parts).items()}


def decay_label(row: Mapping[str, Any]) -> str:
    """Number of a decay; "all" for their combination."""
    return str(row["decay"]) if row["decay"] else "all"


def expanded_text(row: Mapping[str, Any], name: str, uncertain: str, factor: float = 1.0) -> str:
    """A field of a point with its expanded uncertainty, both multiplied by `factor`."""
    value, uncertainty = row[name], row[f"{uncertain}_uncertainty"]
    return ABSENT if value is None else with_uncertainty(factor * value, factor * (uncertainty or 0.0))
