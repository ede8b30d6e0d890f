"""Results without a section of their own: points of any protocol field by field, fitted models, values identified."""

from typing import Any

import numpy as np

from bench.events import FitFinished
from bench.publication.campaign import Campaign
from bench.publication.facts import words_of
from bench.publication.numbers import ABSENT, plain, with_uncertainty
from bench.publication.specimen import finding_label, findings_table
from bench.publication.typography import typeset, unit_text
from bench.record.tables import Column as Stored
from bench.report.fit_figure import fit_figure
from bench.report.page.document import Column, Listing, Part, Picture, Section, Table

_SHOWN = 5e-3
"""Least correlation coefficient that is not printed as 0."""


def identified_section(campaign: Campaign) -> Section | None:
    """Findings and correlations; None for a file of a campaign that identified nothing."""
    identified = campaign.record.identified
    if identified is None:
        return None
    text = (
        "What is known of the specimen after this campaign: its own findings, and those it was given that it did not "
        "replace. It is what the campaign left in its specimen file."
    )
    parts: list[Part] = [text, findings_table(identified, "What is known of the specimen")]
    correlated = [name for name in identified.names if any(name in one.pair for one in identified.correlations)]
    if correlated:
        labels = [finding_label(name) for name in correlated]
        columns = [Column("", words=True), *(Column(label, "1") for label in labels)]
        rows = [
            [label, *(f"{value:.2f}" if abs(value) >= _SHOWN else "0" for value in row)]
            for label, row in zip(labels, identified.correlation(correlated), strict=True)
        ]
        parts.append(Table("Correlation coefficients of the errors of what was identified", columns, rows))
    return Section("identified", "Identified specimen", parts)


MOST = 60
"""Rows that are listed; the file has the others."""


def points_section(campaign: Campaign) -> Section | None:
    """One row for each result; None where the results are gains, or there is none."""
    results = campaign.record.results
    if "alpha_2" in results or not campaign.points:
        return None
    columns = [
        Column(_title(name), unit_text(each.unit), each.values.dtype.kind in "SU") for name, each in results.items()
    ]
    rows = [[_cell(each, row) for each in results.values()] for row in range(min(len(campaign.points), MOST))]
    parts: list[Part] = [Table(f"Results of the protocol {campaign.protocol}", columns, rows)]
    if len(campaign.points) > MOST:
        parts.append(f"The file has {len(campaign.points) - MOST} more.")
    meanings = [f"{_title(name)}: {words_of(each.description)}" for name, each in results.items()]
    return Section("points", "Results", [*parts, Listing(meanings)])


def _title(name: str) -> str:
    return typeset(name.replace("_", " "))


def _cell(stored: Stored, row: int) -> str:
    value: Any = stored.values[row]
    if isinstance(value, str | bytes):
        text = value.decode() if isinstance(value, bytes) else value
        return typeset(text) or ABSENT
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    return plain(float(value))


COVERAGE = 2.0


def fits_section(campaign: Campaign) -> Section | None:
    """A table and a figure for each fit; None where nothing was fitted."""
    fits = campaign.record.fits
    if not fits:
        return None
    parts: list[Part] = []
    for fit in fits:
        parts += [typeset(fit.text)] if fit.text else []
        parts += [_parameters(fit)] if fit.parameters else []
        meanings = ", ".join(f"{_words(name)}: {typeset(each.description)}" for name, each in fit.columns.items())
        parts.append(
            Picture(fit_figure(fit), f"Fit {fit.name}. {meanings}.", "Measured and fitted values over the axis.")
        )
    return Section("fits", "Fitted models", parts)


def _parameters(fit: FitFinished) -> Table:
    columns = [Column("parameter", words=True), Column("found"), Column("unit", words=True)]
    rows = [
        [_words(name), with_uncertainty(found.value, COVERAGE * found.uncertainty), unit_text(found.unit)]
        for name, found in fit.parameters.items()
    ]
    return Table(f"What the fit {fit.name} found (expanded uncertainties, k = 2)", columns, rows)


def _words(name: str) -> str:
    return name.replace("_", " ")
