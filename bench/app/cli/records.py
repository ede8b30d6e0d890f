"""`rockbench records info`: reads earthquake records and prints their intensity measures."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bench.app.cli.options import Handed, Json, RecordText, ResultOptions
from bench.app.cli.output import Result, check_files, deliver
from bench.progress import silent
from sim.errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bench.accelerograms.accelerogram import Accelerogram

MOST_DRAWN = 8
"""Maximum number of records in a figure."""

SHORTEST, LONGEST = 0.05, 5.0
"""Shortest and longest period of the response spectrum [s]."""


def info(
    *files: RecordText,
    dt: Annotated[
        str | None,
        Parameter(metavar="SECONDS", help="Time step [s], for files that do not state it.", show_default=False),
    ] = None,
    unit: Annotated[
        str | None,
        Parameter(metavar="UNIT", help="Unit of the samples, for files that do not state it.", show_default=False),
    ] = None,
    channel: Annotated[
        str | None, Parameter(metavar="CHANNEL", help="Channel, by number or name, for files that have several.")
    ] = None,
    column: Annotated[
        str | None,
        Parameter(metavar="COLUMN", help="Column, by number from 1 or by heading, for files of plain columns."),
    ] = None,
    plot: Annotated[
        Path | None,
        Parameter(metavar="FILE", help="Draw histories and response spectra: .png (200 dpi), .pdf or .svg."),
    ] = None,
    as_json: Json = False,
    progress: Handed = silent,
) -> int:
    """Describe earthquake records: peaks, Arias intensity, significant duration and hash.

    The format is recognised from the content of the file. Unit and time step must be specified if the file does not
    state them; values that contradict the file are refused, as is a file that is not a complete acceleration record.
    The exit code is 0 if every record was read, 1 if a figure could not be written, 2 if an input was refused. Existing
    files are never overwritten.
    """
    progress("reading the records")
    from bench.accelerograms.reference import GRAMMAR, RecordReference, read_records, seconds_of
    from bench.provenance import software

    if not files:
        raise InvalidInput("FILE", None, f"specify at least one record: {GRAMMAR}")
    references = [RecordReference.parse(text) for text in files]
    options = ResultOptions(json=as_json, plot=plot)
    check_files(options)
    if plot is not None and len(references) > MOST_DRAWN:
        raise InvalidInput(
            "--plot", f"{len(references)} records", f"at most {MOST_DRAWN} fit in a figure; specify fewer"
        )
    defaults: dict[str, Any] = {
        "dt": None if dt is None else seconds_of("--dt", dt),
        "unit": unit,
        "channel": channel,
        "column": column,
    }
    records = read_records([reference.or_else(**defaults) for reference in references])
    result = Result(
        title="earthquake records",
        content=lambda: {"records": [_content(record) for record in records]},
        text=lambda: "\n\n".join(_text(record) for record in records),
        figure=lambda: _figure(records),
        metadata={"software": software()},
        tables={},
    )
    return deliver(lambda: result, options, progress)


def _content(record: "Accelerogram") -> dict[str, Any]:
    """Content of a record for JSON, in the SI units stated at the end of the keys."""
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


def _text(record: "Accelerogram") -> str:
    """A record as text: one value per line, then the header of the file."""
    from bench.accelerograms.measures import measures
    from bench.accelerograms.units import STANDARD_GRAVITY

    found = measures(record)
    drift = "" if not found.drifts else "  (baseline drift, which affects PGV and PGD)"
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


def _figure(records: "Sequence[Accelerogram]") -> "Figure":
    """Histories and response spectra of the records."""
    from bench.analysis.table_motion import table_motion
    from bench.figures.record_figure import RecordPicture, record_figure

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


def _spectrum(record: "Accelerogram") -> tuple[Any, Any, float]:
    from bench.analysis.response_spectrum import DAMPING, logarithmic_periods, pseudo_acceleration

    periods = logarithmic_periods(SHORTEST, LONGEST, per_octave=12)
    return periods, pseudo_acceleration(record.acceleration, record.dt, periods), DAMPING
