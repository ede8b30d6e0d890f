"""Predictions under earthquake records as tables: the gains, and the motions of the table that they belong to."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bench.control.preparation import PreparedMotion
from bench.prediction.seismic import SeismicCurve
from bench.prediction.steady import rounded
from bench.record.tables import Column, Table
from sim.gain import SeismicGain

DIGITS = 9
"""Significant digits of peaks and gains: a step errs by 1e-10, and impacts spread that."""

Columns = Mapping[str, tuple[type, str, str]]

RECORD: Columns = {
    "record": (np.str_, "", "name of the record"),
    "synthetic": (np.bool_, "1", "whether it was made, not measured"),
}

BAND: Columns = {
    "band_low_hz": (np.float64, "Hz", "lower end of the table's band; absent without filter"),
    "band_high_hz": (np.float64, "Hz", "upper end of the table's band; absent without filter"),
}

GAINS: Columns = {
    **RECORD,
    **BAND,
    "beta": (np.float64, "1", "stiffness ratio k_C/k1 of the coupling spring"),
    "alpha_1": (np.float64, "1", "gain of the peak of u1, coupled over bare; absent unless completed"),
    "alpha_2": (np.float64, "1", "gain of the peak drift u2 - u1, coupled over bare; absent unless completed"),
    "status": (np.str_, "", "how the run ended"),
    "toppled": (np.bool_, "1", "whether the block overturned"),
    "toppled_time_s": (np.float64, "s", "when it overturned, since the motion began; absent where it did not"),
    "impacts": (np.int64, "1", "impacts of the block"),
    "u1_max_m": (np.float64, "m", "greatest |u1|; absent unless completed"),
    "drift_max_m": (np.float64, "m", "greatest |u2 - u1|; absent unless completed"),
    "theta_max_rad": (np.float64, "rad", "greatest |theta|; absent unless completed"),
    "bare_u1_max_m": (np.float64, "m", "greatest |u1| of the bare frame"),
    "bare_drift_max_m": (np.float64, "m", "greatest |u2 - u1| of the bare frame"),
}

GAIN_BANDS: Columns = {
    "alpha_2_low": (np.float64, "1", "where the 95 % of alpha_2 of the drawn specimens that stood begin"),
    "alpha_2_high": (np.float64, "1", "where they end"),
    "members_share": (np.float64, "1", "share of the drawn specimens that stood"),
}

MOTIONS: Columns = {
    **RECORD,
    "source": (np.str_, "", "file of the record, or how it was made"),
    "sha256": (np.str_, "", "hash of the file's bytes, or of the samples"),
    **BAND,
    "record_peak_m_s2": (np.float64, "m/s2", "greatest acceleration of the record"),
    "factor": (np.float64, "1", "what all accelerations were multiplied by"),
    "peak_m_s2": (np.float64, "m/s2", "greatest acceleration of the motion"),
    "velocity_max_m_per_s": (np.float64, "m/s", "greatest velocity of the table"),
    "displacement_max_m": (np.float64, "m", "greatest displacement of the table"),
    "begin_s": (np.float64, "s", "where the motion begins, on the record's clock"),
    "duration_s": (np.float64, "s", "length of the motion"),
    "steps": (np.str_, "", "what was done, in order"),
}


def gains_table(curves: Sequence[SeismicCurve]) -> Table:
    """One row for each record, band and stiffness."""
    table = _table(GAINS, [_gain(curve, gain) for curve in curves for gain in curve.gains])
    found = [curve.bands for curve in curves if curve.bands is not None]
    if len(found) < len(curves):
        return table
    rows = [row for each in found for row in zip(each.low, each.high, each.share, strict=True)]
    return {**table, **_table(GAIN_BANDS, rows)}


def motions_table(curves: Sequence[SeismicCurve]) -> Table:
    """One row for each motion of the table: which record it came from, and what was done to it."""
    return _table(MOTIONS, [_motion(curve) for curve in curves])


def _gain(curve: SeismicCurve, gain: SeismicGain) -> list[Any]:
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
        motion.end_time if toppled else np.nan,
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
