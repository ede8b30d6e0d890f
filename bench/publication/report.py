"""The report of a campaign from its file: what was tested on what, how, and what came out beside the prediction."""

from collections.abc import Callable, Sequence
from typing import Any

from bench.progress import Progress, silent
from bench.publication.campaign import Campaign
from bench.publication.conditions import damage_notice, limits_section
from bench.publication.free_rocking import rocking_section
from bench.publication.free_vibration import vibration_section
from bench.publication.harmonic import histories_section, map_points, results_section, spectra_section
from bench.publication.predicted import map_section
from bench.publication.provenance import provenance_line, provenance_section
from bench.publication.results import fits_section, identified_section, points_section
from bench.publication.specimen import modes_section, specimen_section
from bench.publication.typography import listed, moment
from bench.report.page.document import Document, Notice, Part, Section
from sim.loading import load_model

USUAL_BETAS = (0.25, 0.64, 0.97)
MOST_MODES = 4
"""Stiffnesses whose modes are drawn."""


def campaign_report(campaign: Campaign, progress: Progress = silent) -> Document:
    """Everything that the file has. Raises InvalidInput for a file without a specimen that can be used."""
    load_model(progress)
    sections: list[Section] = []
    makers = _sections(campaign)
    for number, make in enumerate(makers):
        progress("computing and drawing the report", number, len(makers))
        found = make()
        sections += [] if found is None else [found] if isinstance(found, Section) else found
    return Document(
        title=f"Test report: {campaign.path.stem}" if campaign.path.stem != "campaign" else _title(campaign),
        summary=_summary(campaign),
        sections=sections,
        provenance=provenance_line(),
    )


def _sections(campaign: Campaign) -> list[Callable[[], Section | Sequence[Section] | None]]:
    """What makes each section, or several; or finds that there is none."""
    made: list[Callable[[], Section | Sequence[Section] | None]] = []
    if campaign.harmonic_points:
        # the map is that of the test's amplitude: without a test there is none to draw
        made += [
            lambda: results_section(campaign),
            lambda: spectra_section(campaign),
            lambda: map_section(campaign.specimen, _amplitude_factor(campaign), map_points(campaign)),
            lambda: histories_section(campaign),
        ]
    if campaign.installed is not None and campaign.installed.report is not None:
        of_protocol = campaign.installed.report
        made.append(lambda: of_protocol(campaign))
    configuration = campaign.configuration
    identified = None if configuration is None else configuration.identified
    made += [
        lambda: rocking_section(campaign) or vibration_section(campaign) or points_section(campaign),
        lambda: identified_section(campaign),
        lambda: fits_section(campaign),
        lambda: specimen_section(campaign.specimen, campaign.uncertainty, identified),
        lambda: modes_section(campaign.specimen, _betas(campaign)[:MOST_MODES]),
        lambda: limits_section(campaign),
        lambda: provenance_section(campaign),
    ]
    return made


def _title(campaign: Campaign) -> str:
    return f"Test report: {campaign.protocol or 'campaign'} of {campaign.record.start_time[:10]}"


def _summary(campaign: Campaign) -> list[Part]:
    record = campaign.record
    tested = _tested(campaign)
    betas = listed([f"{beta:g}" for beta in _betas(campaign)]) if tested else ""
    springs = f", bare and coupled by springs of β = {betas}" if betas else ""
    what = listed(tested) or f"{campaign.protocol or 'an experiment'}, which measures no gain,"
    backend = str(campaign.devices.get("backend", "not stated"))
    ended = f"ended {moment(record.end_time)}" if record.end_time else "not ended"
    parts: list[Part] = [
        *damage_notice(campaign),
        f"Tested: {what} on a two-storey frame with a rocking block{springs}. Bench: {backend}. Begun "
        f"{moment(record.start_time)}, {ended}; status: {record.status}.{_people(campaign)}",
    ]
    if backend == "simulated":
        parts.append(
            Notice("The bench was simulated: measured stands for what a virtual bench with its noise and errors gave.")
        )
    absent = [
        kind
        for kind, there in (("harmonic", campaign.harmonic_points), ("earthquake", campaign.seismic_points))
        if not there
    ]
    if absent:
        parts.append(f"The file holds no {' and no '.join(absent)} test.")
    return parts


def _tested(campaign: Campaign) -> list[str]:
    kinds: list[str] = []
    if campaign.harmonic_points:
        omegas = sorted({row["omega_rad_s"] for row in campaign.harmonic_points})
        frequencies = listed([f"{omega:g}" for omega in omegas])
        kinds.append(f"steady sine tests at {frequencies} rad/s, {_amplitude_factor(campaign):g} g/λ")
    if campaign.seismic_points:
        records = dict.fromkeys(str(row["record"]) for row in campaign.seismic_points)
        kinds.append(f"{'earthquake records' if len(records) > 1 else 'the earthquake record'} {listed([*records])}")
    return kinds


def _people(campaign: Campaign) -> str:
    given = campaign.record.metadata
    words = (("Operator", given.get("operator")), ("Notes", given.get("notes")))
    return "".join(f" {name}: {text.rstrip('.')}." for name, text in words if text)


def _betas(campaign: Campaign) -> list[float]:
    points: list[dict[str, Any]] = [*campaign.harmonic_points, *campaign.seismic_points]
    return sorted({float(row["beta"]) for row in points if row["beta"]}) or list(USUAL_BETAS)


def _amplitude_factor(campaign: Campaign) -> float:
    """That of the test; the paper's where the file has no sine."""
    factor = campaign.parameters.get("amplitude_factor")
    return float(factor) if isinstance(factor, int | float) else 1.01
