"""Gain coefficients under earthquake records, against stiffness and against the lower end of the band, as tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.accelerograms.accelerogram import Accelerogram
from bench.config.model import BenchConfiguration
from bench.config.numbers import read_band
from bench.control.preparation import PreparedMotion, prepare
from bench.control.stroke_fit import Method, periods_of
from bench.control.target import Reach
from bench.datafile.tables import Column, Table
from bench.prediction.bands import Bands, record_bands
from bench.prediction.conditioning import end_time_errors, rounded_time
from bench.prediction.requests import BandStudyRequest, RecordsRequest, SeismicRequest
from bench.prediction.steady import rounded
from bench.progress import Progress, silent
from sim.errors import InvalidInput
from sim.gain import SeismicGain, seismic_curve
from sim.knowledge import SpecimenKnowledge
from sim.specimen import Specimen
from sim.sweep import connection

Band = tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class SeismicCurve:
    """Prediction for one record: the table motion, and a gain for each stiffness.

    `time_errors` are the errors of the times of overturning [s] (`bench.prediction.conditioning`), NaN if the block
    does not overturn; `bands` are the bands of alpha_2 at each stiffness, if requested.
    """

    accelerogram: Accelerogram
    prepared: PreparedMotion
    gains: list[SeismicGain]
    time_errors: list[float]
    bands: Bands | None = None


def band_of(text: str | None, configuration: BenchConfiguration) -> Band:
    """Band [Hz] requested by `text`: "LOW:HIGH", "none", or None for the configured one. Raises InvalidInput."""
    if text is None:
        return configuration.table_band
    if text == "none":
        return None
    try:
        return read_band(text)
    except ValueError as error:
        allowed = str(error) or "it must be LOW:HIGH, two ascending frequencies above 0 Hz, or none"
        raise InvalidInput("--table-band", text, allowed) from None


def seismic_curves(
    specimen: Specimen,
    records: Sequence[Accelerogram],
    request: SeismicRequest,
    configuration: BenchConfiguration,
    known: SpecimenKnowledge | None = None,
    progress: Progress = silent,
) -> list[SeismicCurve]:
    """Compute one curve for each record, with the requested bands if the uncertainty of the specimen is `known`.

    Raises InvalidInput for a record that cannot be prepared.
    """
    band, betas = band_of(request.table_band, configuration), sorted(request.beta)
    reach = None if request.stroke_fit == "none" else Reach.of(configuration)
    method = Method.HIGH_PASS if request.stroke_fit == "high-pass" else Method.LEAST_CHANGE
    curves: list[SeismicCurve] = []
    with connection(request.scheduler):
        for record in records:
            progress("simulating the records", len(curves), len(records))
            curves.append(_curve(specimen, record, request, betas, band, reach, method))
        if known is None or not request.members:
            return curves
        coupled = [specimen.coupled(beta) for beta in betas]
        banded: list[SeismicCurve] = []
        for curve in curves:
            progress("computing the uncertainty bands", len(banded), len(curves))
            found = record_bands(coupled, curve.prepared.record, known, request.members, request.scheduler)
            banded.append(replace(curve, bands=found))
    return banded


def band_study(
    specimen: Specimen,
    records: Sequence[Accelerogram],
    request: BandStudyRequest,
    configuration: BenchConfiguration,
    progress: Progress = silent,
) -> list[SeismicCurve]:
    """Compute one curve for each record and, in ascending order, each lower end of the band.

    Each motion is scaled to the requested peak separately.

    Raises InvalidInput for a band that is not ascending, or a record that cannot be prepared.
    """
    band, betas = band_of(request.table_band, configuration), sorted(request.beta)
    if band is None:
        raise InvalidInput("--table-band", "none", "the study varies the band's lower end: omit it or give LOW:HIGH")
    if max(request.corner) >= band[1]:
        raise InvalidInput("--corner", max(request.corner), f"it must be below the band's upper end, {band[1]:g} Hz")
    bands = [(record, (corner, band[1])) for record in records for corner in sorted(request.corner)]
    curves: list[SeismicCurve] = []
    with connection(request.scheduler):
        for record, limited in bands:
            progress("simulating the records", len(curves), len(bands))
            curves.append(_curve(specimen, record, request, betas, limited))
    return curves


def _curve(
    specimen: Specimen,
    record: Accelerogram,
    request: RecordsRequest,
    betas: Sequence[float],
    band: Band,
    reach: Reach | None = None,
    method: Method = Method.LEAST_CHANGE,
) -> SeismicCurve:
    try:
        prepared = prepare(
            record.sampled,
            band=band,
            peak=request.peak_factor * specimen.uplift_acceleration,
            reach=reach,
            method=method,
            trim=request.trim or None,
            length_ratio=request.length_ratio,
            periods=periods_of(specimen.frame),
        )
    except InvalidInput as refused:
        raise InvalidInput(f"{refused.item} of {record.name}", refused.value, refused.allowed) from None
    gains = seismic_curve(specimen, prepared.record, betas, request.scheduler)
    toppled = [i for i, gain in enumerate(gains) if gain.motion.overturned is not None]
    coupled, motions = [specimen.coupled(betas[i]) for i in toppled], [gains[i].motion for i in toppled]
    errors = dict(zip(toppled, end_time_errors(coupled, prepared.record, motions, request.scheduler), strict=True))
    return SeismicCurve(record, prepared, gains, [errors.get(i, np.nan) for i in range(len(gains))])


DIGITS = 9
"""Significant digits of peaks and gains: impacts amplify the relative error of an integration step, 1e-10."""

Columns = Mapping[str, tuple[type, str, str]]

RECORD: Columns = {
    "record": (np.str_, "", "name of the record"),
    "synthetic": (np.bool_, "1", "whether the record is synthetic, not measured"),
}

BAND: Columns = {
    "band_low_hz": (np.float64, "Hz", "lower end of the table's frequency band; absent if no filter was used"),
    "band_high_hz": (np.float64, "Hz", "upper end of the table's frequency band; absent if no filter was used"),
}

GAINS: Columns = {
    **RECORD,
    **BAND,
    "beta": (np.float64, "1", "stiffness ratio k_C/k1 of the coupling spring"),
    "alpha_1": (np.float64, "1", "gain of the peak of u1, coupled over bare; absent if the run ended early"),
    "alpha_2": (np.float64, "1", "gain of the peak drift u2 - u1, coupled over bare; absent if the run ended early"),
    "status": (np.str_, "", "final status of the run"),
    "toppled": (np.bool_, "1", "whether the block overturned"),
    "toppled_time_s": (
        np.float64,
        "s",
        "time of overturning since the start of the motion, rounded to the digits that its error leaves valid; absent "
        "if the block did not overturn or no digit is valid",
    ),
    "toppled_time_error_s": (
        np.float64,
        "s",
        "error of the time of overturning, from a run at the finest tolerance; absent if that run ends differently",
    ),
    "impacts": (np.int64, "1", "number of impacts of the block"),
    "u1_max_m": (np.float64, "m", "greatest |u1|; absent if the run ended early"),
    "drift_max_m": (np.float64, "m", "greatest |u2 - u1|; absent if the run ended early"),
    "theta_max_rad": (np.float64, "rad", "greatest |theta|; absent if the run ended early"),
    "bare_u1_max_m": (np.float64, "m", "greatest |u1| of the bare frame"),
    "bare_drift_max_m": (np.float64, "m", "greatest |u2 - u1| of the bare frame"),
}

GAIN_BANDS: Columns = {
    "alpha_2_low": (
        np.float64,
        "1",
        "lower bound of the 95 % interval of alpha_2 over the drawn specimens that did not topple",
    ),
    "alpha_2_high": (np.float64, "1", "upper bound of the 95 % interval of alpha_2"),
    "members_share": (np.float64, "1", "fraction of the drawn specimens that did not topple"),
}

MOTIONS: Columns = {
    **RECORD,
    "source": (np.str_, "", "file of the record, or method of its synthesis"),
    "sha256": (np.str_, "", "SHA-256 of the file's bytes, or of the samples"),
    **BAND,
    "record_peak_m_s2": (np.float64, "m/s2", "greatest acceleration of the record"),
    "factor": (np.float64, "1", "factor by which all accelerations were scaled"),
    "peak_m_s2": (np.float64, "m/s2", "greatest acceleration of the motion"),
    "velocity_max_m_per_s": (np.float64, "m/s", "greatest velocity of the table"),
    "displacement_max_m": (np.float64, "m", "greatest displacement of the table"),
    "begin_s": (np.float64, "s", "start of the motion on the time axis of the record after similitude"),
    "duration_s": (np.float64, "s", "duration of the motion"),
    "steps": (np.str_, "", "processing steps, in order"),
}


def gains_table(curves: Sequence[SeismicCurve]) -> Table:
    """Table with one row for each record, band and stiffness."""
    table = _table(
        GAINS,
        [_gain(curve, *each) for curve in curves for each in zip(curve.gains, curve.time_errors, strict=True)],
    )
    found = [curve.bands for curve in curves if curve.bands is not None]
    if len(found) < len(curves):
        return table
    rows = [row for each in found for row in zip(each.low, each.high, each.share, strict=True)]
    return {**table, **_table(GAIN_BANDS, rows)}


def motions_table(curves: Sequence[SeismicCurve]) -> Table:
    """Table with one row for each table motion, with its record and processing."""
    return _table(MOTIONS, [_motion(curve) for curve in curves])


def _gain(curve: SeismicCurve, gain: SeismicGain, time_error: float) -> list[Any]:
    motion, bare = gain.motion, gain.bare
    completed, toppled = gain.alpha_2 is not None, motion.overturned is not None
    peaks = (motion.peaks.u1, motion.peaks.drift, motion.peaks.theta) if completed else (np.nan,) * 3
    return [
        *_record(curve),
        *_band(curve.prepared),
        gain.beta,
        np.nan if gain.alpha_1 is None else gain.alpha_1,
        np.nan if gain.alpha_2 is None else gain.alpha_2,
        str(motion.status),
        toppled,
        rounded_time(motion.end_time, time_error),
        time_error,
        motion.impacts,
        *peaks,
        bare.u1,
        bare.drift,
    ]


def _motion(curve: SeismicCurve) -> list[Any]:
    record, prepared = curve.accelerogram, curve.prepared
    return [
        *_record(curve),
        record.source,
        record.sha256,
        *_band(prepared),
        prepared.peak_before,
        prepared.factor,
        prepared.peak,
        prepared.motion.peak_velocity,
        prepared.motion.peak_displacement,
        prepared.begin,
        prepared.record.duration,
        "; ".join(prepared.steps),
    ]


def _record(curve: SeismicCurve) -> tuple[str, bool]:
    return curve.accelerogram.name, curve.accelerogram.synthetic


def _band(prepared: PreparedMotion) -> tuple[float, float]:
    return prepared.band or (np.nan, np.nan)


def _table(columns: Columns, rows: Sequence[Sequence[Any]]) -> Table:
    made: dict[str, Column] = {}
    for (name, (kind, unit, description)), values in zip(columns.items(), zip(*rows, strict=True), strict=True):
        if kind is np.float64:
            made[name] = Column(rounded(np.array(values, np.float64), DIGITS), unit, description)
        else:
            made[name] = Column(np.array(values, np.dtype(kind)), unit, description)
    return made
