"""Models that were fitted to stretches of the recording: what was found, and how well the model follows."""

from bench.events import FitFinished
from bench.publication.campaign import Campaign
from bench.publication.numbers import with_uncertainty
from bench.publication.typography import typeset, unit_text
from bench.report.fit_figure import fit_figure
from bench.report.page.document import Column, Part, Picture, Section, Table

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
