"""The report of a campaign from its file: what was tested on what, how, and what came out beside the prediction."""

from collections.abc import Callable
from typing import Any

from bench.publication.campaign import Campaign
from bench.publication.conditions import limits_section, provenance_section
from bench.publication.harmonic import NONE, histories_section, map_points, results_section, spectra_section
from bench.publication.made import made_line
from bench.publication.predicted import MAP_HEADING, map_section
from bench.publication.seismic import seismic_section
from bench.publication.specimen import modes_section, specimen_section
from bench.report.page.document import Document, Notice, Part, Section

USUAL_BETAS = (0.25, 0.64, 0.97)
MOST_MODES = 4
"""Stiffnesses whose modes are drawn."""


def campaign_report(campaign: Campaign) -> Document:
    """Everything that the file has. Raises InvalidInput for a file without a specimen that can be used."""
    sections: list[Callable[[], Section]] = [
        lambda: results_section(campaign),
        lambda: spectra_section(campaign),
        lambda: _map(campaign),
        lambda: histories_section(campaign),
        lambda: seismic_section(campaign),
        lambda: specimen_section(campaign.specimen, campaign.uncertainty),
        lambda: modes_section(campaign.specimen, _betas(campaign)[:MOST_MODES]),
        lambda: limits_section(campaign),
        lambda: provenance_section(campaign),
    ]
    return Document(
        title=f"Test report: {campaign.path.stem}" if campaign.path.stem != "campaign" else _title(campaign),
        summary=_summary(campaign),
        sections=[section() for section in sections],
        made=made_line(),
    )


def _map(campaign: Campaign) -> Section:
    """The map is that of the test's amplitude: without a test there is none to draw."""
    points = map_points(campaign)
    if not points:
        return Section("map", MAP_HEADING, [NONE])
    return map_section(campaign.specimen, _amplitude_factor(campaign), points)


def _title(campaign: Campaign) -> str:
    return f"Test report: {campaign.protocol or 'campaign'} of {campaign.record.start_time[:10]}"


def _summary(campaign: Campaign) -> list[Part]:
    record = campaign.record
    kinds: list[str] = []
    if campaign.harmonic_points:
        omegas = sorted({row["omega_rad_s"] for row in campaign.harmonic_points})
        listed = ", ".join(f"{omega:g}" for omega in omegas)
        kinds.append(f"steady sine tests at {listed} rad/s, {_amplitude_factor(campaign):g} g/λ")
    if campaign.seismic_points:
        records = dict.fromkeys(row["record"] for row in campaign.seismic_points)
        kinds.append(f"earthquake records {', '.join(records)}")
    tested = " and ".join(kinds) or f"{campaign.protocol or 'an experiment'} without points of gain"
    betas = ", ".join(f"{beta:g}" for beta in _betas(campaign)) if kinds else ""
    springs = f", coupled by springs of β = {betas} and bare" if betas else ""
    backend = str(campaign.devices.get("backend", "not stated"))
    parts: list[Part] = [
        f"Tested: {tested}, on a two-storey frame with a rocking block{springs}. Bench: {backend}. Begun "
        f"{record.start_time}, ended {record.end_time or 'not'}; status: {record.status}."
    ]
    if backend == "simulated":
        parts.append(
            Notice("The bench was simulated: measured stands for what a virtual bench with its noise and errors gave.")
        )
    return parts


def _betas(campaign: Campaign) -> list[float]:
    points: list[dict[str, Any]] = [*campaign.harmonic_points, *campaign.seismic_points]
    return sorted({float(row["beta"]) for row in points if row["beta"]}) or list(USUAL_BETAS)


def _amplitude_factor(campaign: Campaign) -> float:
    """That of the test; the paper's where the file has no sine."""
    factor = campaign.parameters.get("amplitude_factor")
    return float(factor) if isinstance(factor, int | float) else 1.01
