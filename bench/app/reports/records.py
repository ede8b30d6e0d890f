"""Figures and tables of earthquake records and of the specimen's predicted response to them."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.accelerogram import Accelerogram
from bench.analysis.response_spectrum import DAMPING, logarithmic_periods, pseudo_acceleration
from bench.analysis.table_motion import table_motion
from bench.document.document import Column, Picture, Table
from bench.document.typography import listed, plain
from bench.figures.record_figure import RecordPicture, record_figure
from bench.figures.seismic_figure import GainCurve, ModelDrift, model_drift_figure, seismic_figure
from bench.prediction.seismic import SeismicCurve
from sim.rocking import simulate
from sim.specimen import Specimen

TOGETHER = 3
"""Maximum number of records in a figure."""

SHORTEST, LONGEST = 0.05, 5.0
"""Shortest and longest period of the response spectrum [s]."""

STEP = 0.01
"""Time step of a drawn history [s]."""


def record_pictures(records: Sequence[Accelerogram]) -> Iterator[Picture]:
    """Figures of the histories and response spectra of the records, up to `TOGETHER` records in each."""
    periods = logarithmic_periods(SHORTEST, LONGEST, per_octave=12)
    for first in range(0, len(records), TOGETHER):
        some = records[first : first + TOGETHER]
        drawn: list[RecordPicture] = []
        for record in some:
            motion = table_motion(record.acceleration, record.dt)
            spectrum = pseudo_acceleration(record.acceleration, record.dt, periods)
            shown = (record.acceleration, motion.velocity, motion.displacement, periods, spectrum, DAMPING)
            drawn.append(RecordPicture(record.name, record.dt, *shown))
        names = listed([record.name for record in some])
        yield Picture(
            record_figure(drawn),
            f"{names}: ground acceleration, velocity and displacement, and pseudo-acceleration spectrum.",
            "Three histories and a response spectrum for each record; the peak of each history is marked.",
        )


def gains_picture(curves: Sequence[SeismicCurve], words: str) -> Picture:
    """Figure of alpha_2 and alpha_1 against the stiffness ratio, by record; `words` describes their frequency band."""

    def known(gains: Sequence[float | None]) -> NDArray[np.float64]:
        return np.array([np.nan if gain is None else gain for gain in gains])

    drawn = [
        GainCurve(
            name=curve.accelerogram.name,
            beta=np.array([gain.beta for gain in curve.gains]),
            alpha_1=known([gain.alpha_1 for gain in curve.gains]),
            alpha_2=known([gain.alpha_2 for gain in curve.gains]),
            toppled=np.array([gain.motion.overturned is not None for gain in curve.gains]),
        )
        for curve in curves
    ]
    band = curves[0].prepared.band
    limits = "none, whole records" if band is None else f"{band[0]:g} to {band[1]:g} Hz"
    return Picture(
        seismic_figure(drawn, limits),
        f"Gains against the stiffness ratio, records {words} (predicted). A cross at the bottom: the block topples.",
        "Curves of alpha 2 and alpha 1 against the stiffness ratio, one for each record.",
    )


def motions_table(curves: Sequence[SeismicCurve]) -> Table:
    """Results by record: the table's motion, the range of alpha_2, and the share of stiffness ratios with toppling."""
    columns = [
        Column("record", words=True),
        Column("band", "Hz", words=True),
        Column("scale", "1"),
        Column("peak", "m/s²"),
        Column("table displacement", "mm"),
        Column("least α₂", "1"),
        Column("largest α₂", "1"),
        Column("topples", "%"),
    ]
    rows: list[list[str]] = []
    for curve in curves:
        gains = [gain.alpha_2 for gain in curve.gains if gain.alpha_2 is not None]
        fallen = sum(gain.motion.overturned is not None for gain in curve.gains) / len(curve.gains)
        band = curve.prepared.band
        rows.append(
            [
                curve.accelerogram.name,
                "as recorded" if band is None else f"{band[0]:g} to {band[1]:g}",
                plain(curve.prepared.factor),
                plain(curve.prepared.peak),
                plain(1e3 * curve.prepared.motion.peak_displacement),
                plain(min(gains, default=None)),
                plain(max(gains, default=None)),
                f"{100.0 * fallen:.0f}",
            ]
        )
    return Table(
        "Table motions and their gains; topples: share of stiffness ratios at which the block topples", columns, rows
    )


def drift_picture(specimen: Specimen, curves: Sequence[SeismicCurve], beta: float) -> Picture:
    """Figure of the predicted drift of the bare and of the coupled frame under each record."""
    drawn: list[ModelDrift] = []
    for curve in curves:
        record = curve.prepared.record
        times = np.arange(0.0, record.duration, STEP)
        drifts: list[NDArray[np.float64]] = []
        for each in (specimen.bare(), specimen.coupled(beta)):
            samples = simulate(each, record, sample_times=times, peaks_from=None).samples
            drift = np.full(times.size, np.nan)
            if samples is not None:
                drift[: len(samples)] = samples[:, 1] - samples[:, 0]
            drifts.append(drift)
        drawn.append(ModelDrift(curve.accelerogram.name, times, drifts[0], drifts[1]))
    band = curves[0].prepared.band
    words = "unfiltered" if band is None else f"limited to the band from {band[0]:g} to {band[1]:g} Hz"
    return Picture(
        model_drift_figure(drawn),
        f"Predicted drift of the bare and of the coupled frame (β = {beta:g}); records {words}.",
        "Drift against time, one row per record; if the block topples, the curve ends there.",
    )
