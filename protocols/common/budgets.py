"""Report on uncertainty budgets: contributions of every result, their origin, and the most effective improvement."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot

from bench.analysis.contributions import SOURCES, largest_improvement
from bench.analysis.uncertainty import COVERAGE
from bench.document.document import Column, Part, Picture, Table
from bench.document.typography import ABSENT, MINUS, typeset
from bench.figures.budget_figure import budget_figure

MOST = 16
"""Largest number of results in a bar chart."""


@dataclass(frozen=True)
class Budgeted:
    """A result with its expanded uncertainty and its standard uncertainties by contribution, all in the unit of the
    result.

    If the result is the ratio of two tests, `correlations` are those between the errors of the two, by contribution.
    """

    label: str
    value: float
    expanded: float
    parts: Mapping[str, float]
    correlations: Mapping[str, float]

    @property
    def percent(self) -> float:
        """The relative expanded uncertainty [%]."""
        return 100.0 * self.expanded / abs(self.value)

    @property
    def shares(self) -> dict[str, float]:
        """Relative standard uncertainties by contribution [%]."""
        return {name: 100.0 * part / abs(self.value) for name, part in self.parts.items()}


def budgeted(
    label: str,
    value: float | None,
    parts: str | None,
    expanded: float | None = None,
    correlations: str | None = None,
) -> list[Budgeted]:
    """List of one result, with its contributions `parts` and `correlations` given as JSON; empty if the file contains
    no value or no budget. By default, the expanded uncertainty is computed from the parts.
    """
    if not value or not parts:
        return []
    sizes: dict[str, float] = json.loads(parts)
    whole = COVERAGE * hypot(*sizes.values()) if expanded is None else expanded
    return [Budgeted(label, value, whole, sizes, json.loads(correlations or "{}"))]


def budget_parts(quantity: str, results: Sequence[Budgeted]) -> list[Part]:
    """Paragraph, tables and bar chart of the budgets of `results`; empty without results."""
    if not results:
        return []
    shares = [result.shares for result in results]
    totals: dict[str, float] = {}
    for share in shares:
        for name, value in share.items():
            totals[name] = totals.get(name, 0.0) + value**2
    names = sorted(totals, key=lambda name: -totals[name])
    columns = [Column("result", words=True), Column("U (k = 2)", "%"), *(Column(name, "%") for name in names)]
    rows = [
        [result.label, f"{result.percent:.3f}", *(f"{share[name]:.4f}" if name in share else ABSENT for name in names)]
        for result, share in zip(results, shares, strict=True)
    ]
    figure = budget_figure(
        [result.label for result in results[:MOST]],
        shares[:MOST],
        [result.percent for result in results[:MOST]],
        f"expanded uncertainty of {quantity}",
    )
    return [
        *_improvement(results),
        Table(
            f"Uncertainty budget of {quantity}: expanded uncertainty, and standard uncertainties by contribution, "
            "largest first",
            columns,
            rows,
        ),
        _sources(names, results),
        Picture(
            figure,
            f"Contributions to the uncertainty of {quantity}: each bar is the expanded uncertainty (k = 2), divided "
            "in proportion to the contributions to the variance.",
            "Horizontal bars of the expanded uncertainty, split into contributions.",
        ),
    ]


def _improvement(results: Sequence[Budgeted]) -> list[Part]:
    found = largest_improvement(result.parts for result in results)
    if found is None:
        return []
    source = SOURCES.get(found.name)
    remedy = "" if source is None else f" To reduce it: {typeset(source.measure)}."
    return [
        f"The largest contribution is “{found.name}”: without it, the expanded uncertainty would be "
        f"{100.0 * found.factor:.0f} % of the stated one"
        + (" (root mean square over the results)." if len(results) > 1 else ".")
        + remedy
    ]


def _sources(names: Sequence[str], results: Sequence[Budgeted]) -> Table:
    shares = [result.shares for result in results]
    correlated = any(result.correlations for result in results)
    columns = [
        Column("contribution", words=True),
        Column("type", words=True),
        Column("origin", words=True),
        Column("largest", "%"),
        *([Column("correlation of the tests")] if correlated else []),
        Column("reduced by", words=True),
    ]
    rows = [
        [
            name,
            source.type if source else ABSENT,
            typeset(source.origin) if source else ABSENT,
            f"{max(share.get(name, 0.0) for share in shares):.4f}",
            *([_range([result.correlations.get(name) for result in results])] if correlated else []),
            typeset(source.measure) if source else ABSENT,
        ]
        for name in names
        for source in (SOURCES.get(name),)
    ]
    caption = (
        "Origin of the contributions: type of evaluation (GUM: A from repeated observations, B from other information) "
        "and largest standard uncertainty"
        + ("; errors cancel as far as they are correlated between the coupled and the bare test" if correlated else "")
    )
    return Table(caption, columns, rows)


def _range(values: Sequence[float | None]) -> str:
    known = [value for value in values if value is not None]
    if not known:
        return ABSENT
    low, high = f"{min(known):.2f}", f"{max(known):.2f}"
    return (low if low == high else f"{low} to {high}").replace("-", MINUS)
