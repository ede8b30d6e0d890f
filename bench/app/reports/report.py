"""Report on a campaign from its data file: the protocol's sections, followed by those common to all campaigns."""

from collections.abc import Callable, Sequence
from math import isfinite
from typing import Any

import numpy as np

from bench.analysis.check_line import OWN_UNIT
from bench.analysis.uncertainty import decimals
from bench.app.reports.limits import limits_section
from bench.app.reports.provenance import provenance_line, provenance_section
from bench.app.reports.specimen import identified_section, modes_section, specimen_section
from bench.datafile.tables import Column as Stored
from bench.document.campaign import Campaign
from bench.document.document import Column, Document, Listing, Notice, Part, Picture, Section, Table
from bench.document.typography import (
    ABSENT,
    MINUS,
    counted,
    first_words,
    label,
    listed,
    moment,
    plain,
    typeset,
    unit_text,
    with_uncertainty,
    without_unit,
)
from bench.figures.fit_figure import fit_figure
from bench.findings import FitFinished
from bench.progress import Progress, silent
from bench.protocol import Protocol
from sim.loading import load_model

MOST_CELLS = 60
"""Maximum number of rows in the table of results."""


def points_section(campaign: Campaign) -> Section | None:
    """Report section with a table of the first `MOST_CELLS` results; None if there are no results."""
    results = campaign.record.results
    if not campaign.points:
        return None
    columns = [
        Column(_heading(name, each.unit), _column_unit(each.unit), each.values.dtype.kind in "SU")
        for name, each in results.items()
    ]
    named = {without_unit(name, each.unit): each for name, each in results.items()}
    uncertain = {name: named.get(f"{without_unit(name, each.unit)}_uncertainty") for name, each in results.items()}
    rows = [
        [_cell(each, row, uncertain[name]) for name, each in results.items()]
        for row in range(min(len(campaign.points), MOST_CELLS))
    ]
    parts: list[Part] = [Table(f"Results of the protocol {campaign.protocol}", columns, rows)]
    if len(campaign.points) > MOST_CELLS:
        parts.append(f"Further results in the file: {len(campaign.points) - MOST_CELLS}.")
    meanings = [f"{_heading(name, each.unit)}: {first_words(each.description)}" for name, each in results.items()]
    return Section("points", "Results", [*parts, Listing(meanings)])


def _column_unit(unit: str) -> str:
    """The unit for a heading; none for values that each have the unit of their own row."""
    return "" if unit == OWN_UNIT else unit_text(unit)


def _heading(name: str, unit: str) -> str:
    return typeset(without_unit(name, unit).replace("_", " "))


def _cell(stored: Stored, row: int, uncertainty: Stored | None) -> str:
    """A value, to the decimal place of its `uncertainty` where there is one in the same unit."""
    value: Any = stored.values[row]
    if isinstance(value, str | bytes):
        text = value.decode() if isinstance(value, bytes) else value
        return typeset(text) or ABSENT
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    places = None
    if uncertainty is not None and uncertainty.unit == stored.unit and isfinite(value):
        places = decimals(float(uncertainty.values[row]))
    return plain(float(value)) if places is None else f"{float(value):.{places}f}".replace("-", MINUS)


COVERAGE = 2.0


def fits_section(campaign: Campaign) -> Section | None:
    """Report section with a table and a figure for each fit; None if there are no fits."""
    fits = campaign.record.fits
    if not fits:
        return None
    parts: list[Part] = []
    for fit in fits:
        parts += [typeset(fit.text)] if fit.text else []
        parts += [_parameters(fit)] if fit.parameters else []
        meanings = ", ".join(f"{_words(name)}: {typeset(each.description)}" for name, each in fit.columns.items())
        parts.append(
            Picture(
                fit_figure(fit),
                f"Fit {typeset(fit.name)}. {meanings}.",
                "Measured and fitted values against the independent variable of the fit.",
            )
        )
    return Section("fits", "Fitted models", parts)


def _parameters(fit: FitFinished) -> Table:
    columns = [Column("parameter", words=True), Column("found"), Column("unit", words=True)]
    rows = [
        [label(name), with_uncertainty(found.value, COVERAGE * found.uncertainty), unit_text(found.unit)]
        for name, found in fit.parameters.items()
    ]
    return Table(f"Results of the fit {typeset(fit.name)} (expanded uncertainties, k = 2)", columns, rows)


def _words(name: str) -> str:
    return name.replace("_", " ")


def damage_notice(campaign: Campaign) -> list[Notice]:
    """Notice at the top of a report on datasets that do not match their checksum or have none; empty if all match."""
    found = campaign.integrity
    if found.failing:
        what = counted(
            len(found.failing), "dataset does not match its checksum", "datasets do not match their checksums"
        )
        text = (
            f"This file was DAMAGED OR CHANGED since it was written: {what} (see the section Limits and warnings). "
            "Results in this report that depend on these data are not reliable."
        )
        return [Notice(text)]
    if found.unchecked:
        lacking = counted(len(found.unchecked), "dataset of the file has", "datasets of the file have")
        return [Notice(f"{lacking} no checksum and cannot be verified.")]
    return []


USUAL_BETAS = (0.25, 0.64, 0.97)
MOST_MODES = 4
"""Maximum number of stiffness ratios whose modes are drawn."""


def campaign_report(campaign: Campaign, protocol: Protocol[Any] | None = None, progress: Progress = silent) -> Document:
    """The complete report; without `protocol`, only the sections common to all campaigns. Raises InvalidInput for a
    file without a usable specimen.
    """
    load_model(progress)
    makers: list[Callable[[], Sequence[Section | None]]] = [
        lambda: _results(campaign, protocol),
        lambda: [identified_section(campaign), fits_section(campaign)],
        lambda: _specimen(campaign),
        lambda: [limits_section(campaign), provenance_section(campaign, protocol and protocol.positional)],
    ]
    sections: list[Section] = []
    for number, make in enumerate(makers):
        progress("computing and drawing the report", number, len(makers))
        sections += [section for section in make() if section is not None]
    return Document(
        title=f"Test report: {campaign.path.stem}" if campaign.path.stem != "campaign" else _title(campaign),
        summary=_summary(campaign),
        sections=sections,
        provenance=provenance_line(),
    )


def _results(campaign: Campaign, protocol: Protocol[Any] | None) -> list[Section | None]:
    """The protocol's sections, followed by the table of results if they contain no table."""
    own: Sequence[Section] = [] if protocol is None or protocol.report is None else protocol.report(campaign)
    tabulated = any(isinstance(part, Table) for section in own for part in section.parts)
    return [*own, None if tabulated else points_section(campaign)]


def _specimen(campaign: Campaign) -> list[Section | None]:
    configuration = campaign.configuration
    identified = None if configuration is None else configuration.identified
    return [
        specimen_section(campaign.specimen, campaign.uncertainty, identified),
        modes_section(campaign.specimen, _betas(campaign)[:MOST_MODES]),
    ]


def _title(campaign: Campaign) -> str:
    return f"Test report: {campaign.protocol or 'campaign'} of {campaign.record.start_time[:10]}"


def _summary(campaign: Campaign) -> list[Part]:
    record = campaign.record
    tested = _tested(campaign)
    betas = listed([f"{beta:g}" for beta in _betas(campaign)]) if tested else ""
    springs = f", bare and coupled (β = {betas})" if betas else ""
    what = listed(tested) or f"{campaign.protocol or 'an experiment'} (no gain measured)"
    backend = str(campaign.devices.get("backend", "not stated"))
    ended = f"ended {moment(record.end_time)}" if record.end_time else "not ended"
    parts: list[Part] = [
        *damage_notice(campaign),
        f"Tests: {what} on a two-storey frame with a rocking block{springs}. Bench: {backend}. Started "
        f"{moment(record.start_time)}, {ended}; status: {record.status}.{_operator_text(campaign)}",
    ]
    if backend == "simulated":
        parts.append(
            Notice(
                "The bench was simulated: measured values are those of the simulated bench, with its noise and errors."
            )
        )
    absent = [
        kind
        for kind, there in (("harmonic", campaign.harmonic_points), ("earthquake", campaign.seismic_points))
        if not there
    ]
    if absent:
        parts.append(f"The file contains no {' and no '.join(absent)} test.")
    return parts


def _tested(campaign: Campaign) -> list[str]:
    kinds: list[str] = []
    if campaign.harmonic_points:
        omegas = sorted({row["omega_rad_s"] for row in campaign.harmonic_points})
        frequencies = listed([f"{omega:g}" for omega in omegas])
        kinds.append(f"steady sine tests at {frequencies} rad/s, {campaign.amplitude_factor:g} g/λ")
    if campaign.seismic_points:
        records = dict.fromkeys(str(row["record"]) for row in campaign.seismic_points)
        kinds.append(f"{'earthquake records' if len(records) > 1 else 'the earthquake record'} {listed([*records])}")
    return kinds


def _operator_text(campaign: Campaign) -> str:
    given = campaign.record.metadata
    words = (("Operator", given.get("operator")), ("Notes", given.get("notes")))
    return "".join(f" {name}: {text.rstrip('.')}." for name, text in words if text)


def _betas(campaign: Campaign) -> list[float]:
    points: list[dict[str, Any]] = [*campaign.harmonic_points, *campaign.seismic_points]
    return sorted({float(row["beta"]) for row in points if row["beta"]}) or list(USUAL_BETAS)
