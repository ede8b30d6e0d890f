"""Predictions under earthquake records, with their tables, texts and figures."""

from collections.abc import Callable, Sequence
from math import nan, tau
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.app.cli.output import Result, columns_text
from bench.app.cli.predict import Subject
from bench.datafile.tables import Column, Table
from bench.figures.seismic_figure import BandCurve, GainCurve, band_figure, seismic_figure
from bench.prediction.files import provenance, rows_of
from bench.prediction.requests import BandStudyRequest, RecordsRequest, SeismicRequest
from bench.prediction.seismic import SeismicCurve, band_of, gains_table, motions_table, seismic_curves
from bench.prediction.seismic import band_study as study
from bench.progress import Progress
from sim.knowledge import SpecimenKnowledge
from sim.loading import RECORDS, load_model

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN = {
    "record": "record",
    "factor": "scale",
    "displacement_max_m": "table moves",
    "points": "points",
    "toppled": "toppled",
    "least": "least alpha_2",
    "least_at": "at beta",
    "greatest": "greatest",
    "greatest_at": "at beta",
}

_STUDY_SHOWN = {
    "record": "record",
    "beta": "beta",
    "points": "points",
    "toppled": "toppled",
    "least": "least alpha_2",
    "least_at": "band from",
    "greatest": "greatest",
    "greatest_at": "band from",
}


def seismic(
    request: SeismicRequest,
    subject: Subject,
    progress: Progress,
) -> Result:
    """Gain curves, one for each record."""
    load_model(progress, RECORDS)
    curves = seismic_curves(subject.specimen, subject.records, request, subject.configuration, subject.known, progress)
    band = band_of(request.table_band, subject.configuration)
    words = "none, the records unchanged" if band is None else f"{band[0]:g} to {band[1]:g} Hz"
    drawn = [
        GainCurve(
            name=curve.accelerogram.name,
            beta=np.array([gain.beta for gain in curve.gains]),
            alpha_1=_known([gain.alpha_1 for gain in curve.gains]),
            alpha_2=_known([gain.alpha_2 for gain in curve.gains]),
            toppled=np.array([gain.motion.overturned is not None for gain in curve.gains]),
            band=None if curve.bands is None else (curve.bands.low, curve.bands.high),
        )
        for curve in curves
    ]
    summary = {
        **{name: column for name, column in motions_table(curves).items() if name in _SHOWN},
        **_extremes([(line.beta, line.alpha_2, line.toppled) for line in drawn], "1"),
    }
    return _result(
        "gain curves under earthquake records",
        request,
        subject,
        curves,
        words,
        columns_text(summary, _SHOWN),
        lambda: seismic_figure(drawn, words),
        subject.known if request.members else None,
    )


def band_study(
    request: BandStudyRequest,
    subject: Subject,
    progress: Progress,
) -> Result:
    """Gains against the lower end of the band."""
    load_model(progress)
    curves = study(subject.specimen, subject.records, request, subject.configuration, progress)
    band = curves[0].prepared.band
    upper = nan if band is None else band[1]
    drawn = [
        _band_curve([curve for curve in curves if curve.accelerogram is record], k)
        for record in subject.records
        for k in range(len(request.beta))
    ]
    summary = {
        "record": Column(np.array([line.name for line in drawn]), "", ""),
        "beta": Column(np.array([line.beta for line in drawn]), "1", ""),
        **_extremes([(line.corner, line.alpha_2, line.toppled) for line in drawn], "Hz"),
    }
    modes = [omega / tau for omega in subject.specimen.frame.natural_frequencies]
    return _result(
        "gain under earthquake records against the lower end of the table's band",
        request,
        subject,
        curves,
        f"lower end {min(request.corner):g} to {max(request.corner):g} Hz, upper end {upper:g} Hz",
        columns_text(summary, _STUDY_SHOWN),
        lambda: band_figure(drawn, modes, upper),
    )


def _result(
    title: str,
    request: RecordsRequest,
    subject: Subject,
    curves: Sequence[SeismicCurve],
    band: str,
    text: str,
    figure: "Callable[[], Figure]",
    known: SpecimenKnowledge | None = None,
) -> Result:
    gains, motions = gains_table(curves), motions_table(curves)
    peak = request.peak_factor * subject.specimen.uplift_acceleration
    conditions = f"table's band: {band}; records scaled to {peak:.4g} m/s2 ({request.peak_factor:g} g/lambda)"
    return Result(
        title=title,
        tables={"gains": gains, "motions": motions},
        content=lambda: {"table_band": band, "motions": rows_of(motions), "gains": rows_of(gains)},
        text=lambda: f"{conditions}\n\n{text}",
        metadata={**provenance(request, subject.specimen, known), "table_band": band},
        figure=figure,
    )


def _band_curve(curves: Sequence[SeismicCurve], k: int) -> BandCurve:
    """Gains of one record at its k-th stiffness, against the lower end of the band."""
    gains = [curve.gains[k] for curve in curves]
    bands = [curve.prepared.band or (nan, nan) for curve in curves]
    return BandCurve(
        name=curves[0].accelerogram.name,
        beta=gains[0].beta,
        corner=np.array([low for low, _ in bands]),
        alpha_2=_known([gain.alpha_2 for gain in gains]),
        toppled=np.array([gain.motion.overturned is not None for gain in gains]),
    )


def _extremes(lines: "Sequence[tuple[NDArray[Any], NDArray[Any], NDArray[Any]]]", unit: str) -> Table:
    """For each line (x, alpha_2, toppled): number of points, number of those at which the block toppled, and the least
    and the greatest gain with the x at which each occurs, in `unit`.
    """
    rows: list[list[float]] = []
    for x, alpha, toppled in lines:
        found = [nan] * 4
        if np.isfinite(alpha).any():
            least, most = int(np.nanargmin(alpha)), int(np.nanargmax(alpha))
            found = [float(alpha[least]), float(x[least]), float(alpha[most]), float(x[most])]
        rows.append([x.size, int(toppled.sum()), *found])
    values = np.array(rows, dtype=np.float64).T
    kinds = (np.int64, np.int64, np.float64, np.float64, np.float64, np.float64)
    units = ("1", "1", "1", unit, "1", unit)
    names = ("points", "toppled", "least", "least_at", "greatest", "greatest_at")
    return {
        name: Column(column.astype(kind), its, "")
        for name, column, kind, its in zip(names, values, kinds, units, strict=True)
    }


def _known(gains: Sequence[float | None]) -> NDArray[np.float64]:
    return np.array([nan if gain is None else gain for gain in gains])
