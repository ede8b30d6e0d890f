"""An earthquake record on the way out of `rockbench records info`: as JSON, as text, as a figure."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from bench.accelerograms.accelerogram import Accelerogram

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHORTEST, LONGEST = 0.05, 5.0
"""Periods of the response spectrum [s]."""


def content_of(record: Accelerogram) -> dict[str, Any]:
    """A record as JSON says it: SI units, named at the end of each key."""
    from bench.accelerograms.measures import measures

    found = measures(record)
    periods, spectrum, damping = _spectrum(record)
    return {
        "name": record.name,
        "source": record.source,
        "format": record.format,
        "synthetic": record.synthetic,
        "unit": record.unit,
        "dt_s": record.dt,
        "samples": record.acceleration.size,
        "duration_s": record.duration,
        "sha256": record.sha256,
        "header": dict(record.header),
        "pga_m_s2": found.pga,
        "pgv_m_s": found.pgv,
        "pgd_m": found.pgd,
        "final_velocity_m_s": found.final_velocity,
        "final_displacement_m": found.final_displacement,
        "arias_m_s": found.arias,
        "significant_duration_5_75_s": found.significant_5_75,
        "significant_duration_5_95_s": found.significant_5_95,
        "response_spectrum": {
            "damping_ratio": damping,
            "period_s": periods.tolist(),
            "pseudo_acceleration_m_s2": spectrum.tolist(),
        },
    }


def text_of(record: Accelerogram) -> str:
    """A record as a person reads it: one fact to a line, then the header of the file."""
    from bench.accelerograms.measures import measures
    from bench.accelerograms.units import STANDARD_GRAVITY

    found = measures(record)
    drift = "" if not found.drifts else "  (it drifts: PGV and PGD are those of its baseline)"
    facts = {
        "source": record.source,
        "format": f"{record.format}, samples in {record.unit}",
        "samples": f"{record.acceleration.size}, every {record.dt:g} s: {record.duration:g} s",
        "PGA": f"{found.pga:.5g} m/s2 = {found.pga / STANDARD_GRAVITY:.4g} g",
        "PGV": f"{found.pgv:.4g} m/s",
        "PGD": f"{found.pgd:.4g} m",
        "at the end": f"{found.final_velocity:.3g} m/s, {found.final_displacement:.3g} m{drift}",
        "Arias intensity": f"{found.arias:.4g} m/s",
        "significant": f"{found.significant_5_75:.4g} s (5 to 75 %), {found.significant_5_95:.4g} s (5 to 95 %)",
        "SHA-256": record.sha256,
    }
    lines = [record.name, *(f"  {name:<16} {value}" for name, value in facts.items()), "  header"]
    return "\n".join([*lines, *(f"    {name}: {value}" for name, value in record.header.items())])


def figure_of(records: Sequence[Accelerogram]) -> "Figure":
    """Histories and spectra of some records."""
    from bench.analysis.table_motion import table_motion
    from bench.report.record_figure import RecordPicture, record_figure

    pictures: list[RecordPicture] = []
    for record in records:
        motion = table_motion(record.acceleration, record.dt)
        periods, spectrum, damping = _spectrum(record)
        pictures.append(
            RecordPicture(
                record.name,
                record.dt,
                record.acceleration,
                motion.velocity,
                motion.displacement,
                periods,
                spectrum,
                damping,
            )
        )
    return record_figure(pictures)


def _spectrum(record: Accelerogram) -> tuple[Any, Any, float]:
    from bench.analysis.response_spectrum import DAMPING, logarithmic_periods, pseudo_acceleration

    periods = logarithmic_periods(SHORTEST, LONGEST, per_octave=12)
    return periods, pseudo_acceleration(record.acceleration, record.dt, periods), DAMPING
