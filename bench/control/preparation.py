"""Preparation of a record as a table motion: similitude, trimming, band limitation, scaling and stroke fit.

Prediction and test use the same prepared motion and are therefore comparable. The order matters: band limitation may
remove the record's peak, so the record is scaled afterwards; the stroke limits the scaled motion.
"""

from dataclasses import dataclass
from math import ceil, isfinite, sqrt
from typing import NamedTuple

import numpy as np

from bench.analysis.table_motion import Array, TableMotion, table_motion, with_final_rest
from bench.control.stroke_fit import NOT_BOTH, PERIODS, Method, StrokeFit, fit_stroke
from bench.control.target import ORDER, REST, Reach, Target, band_gain, check_band, windowed
from sim.errors import InvalidInput
from sim.excitation import SampledRecord

ROUNDING = 1e-9
"""Relative tolerance within which the ratio of two time steps counts as an integer."""


def scaled(record: SampledRecord, length_ratio: float) -> SampledRecord:
    """`record` for a model of length scale lambda_L = `length_ratio` (model over prototype): the accelerations are
    unchanged, and the time step is multiplied by lambda_L^(1/2).

    Raises InvalidInput unless the ratio is positive.
    """
    if not (isfinite(length_ratio) and length_ratio > 0.0):
        raise InvalidInput("length_ratio", length_ratio, "the ratio of model to prototype length must be positive")
    return SampledRecord(record.acceleration, record.dt * sqrt(length_ratio))


def resampled(record: SampledRecord, dt: float) -> SampledRecord:
    """`record` linearly interpolated to a step of `dt` [s], which must not exceed the record's step.

    If `dt` divides the record's step, the motion is unchanged; otherwise its corners are cut off. If it does not divide
    the duration, a final sample of zero is added. Raises InvalidInput for a longer step, which would lose content or
    alias it to lower frequencies.
    """
    if not 0.0 < dt <= record.dt * (1.0 + ROUNDING):
        raise InvalidInput("dt", dt, f"it must be above 0 and at most the record's step, {record.dt:g} s")
    steps = record.duration / dt
    count = ceil(steps * (1.0 - ROUNDING))
    # in units of the record's step, so that an integer number of new steps ends exactly on the last sample
    place = np.arange(count + 1) * (dt / record.dt)
    if abs(count - steps) <= ROUNDING * steps:
        place[-1] = record.acceleration.size - 1
    values = np.interp(place, np.arange(record.acceleration.size), record.acceleration, right=0.0)
    return SampledRecord(values, dt)


TRIM = 0.0005
"""Default fraction of the Arias intensity that is trimmed at each end of a record."""

TAPER = 0.5
"""Duration [s] of the half-cosine taper of a trimmed record, outside the part that is kept."""

BETWEEN = 0.02
"""Fraction of the reach by which a motion may exceed the reach between samples; `bench.control.target.SHARE` reserves
more than this.
"""


@dataclass(frozen=True, eq=False)
class PreparedMotion:
    """A motion of the table with its derivation from a record.

    `record` begins at `begin` [s] on the clock of the record after similitude, whose time is `time_ratio` times that of
    the original record; before that time the table is at rest. All accelerations were multiplied by `factor`.
    `peak_before` and `peak` are the largest magnitudes of acceleration [m/s2] of the original record and of the motion;
    `motion` has the table's velocity and displacement. `band` [Hz] is None if the record was not filtered, `reach` and
    `fit` are None if no stroke was given; `steps` describes the processing steps in order.
    """

    record: SampledRecord
    begin: float
    time_ratio: float
    band: tuple[float, float] | None
    factor: float
    peak_before: float
    peak: float
    motion: TableMotion
    reach: Reach | None
    fit: StrokeFit | None
    steps: tuple[str, ...]

    @property
    def begin_in_record(self) -> float:
        """Time of the original record at which the motion begins [s]."""
        return self.begin / self.time_ratio

    def target(self, sample_rate: float) -> Target:
        """The motion at `sample_rate` [1/s], for its replication on the table.

        Raises InvalidInput if there is no band, if the band extends beyond the range of the sample rate, if the rate is
        below the record's, or if the motion exceeds `reach` by more than `BETWEEN`.
        """
        if self.band is None:
            raise InvalidInput("band", None, "the motion of the table requires a band: specify its ends")
        check_band(self.band, sample_rate)
        wave = resampled(self.record, 1.0 / sample_rate).acceleration
        # linear interpolation between the record's samples adds slight content above the band
        within = windowed(wave, 1.0 / sample_rate, self.band)
        target = Target(within, sample_rate, self.band, round(REST / self.band[0] * sample_rate))
        if self.reach is not None:
            far, fast, reach = target.peaks["displacement"], target.peaks["velocity"], self.reach
            if max(far / reach.displacement, fast / reach.velocity) > 1.0 + BETWEEN:
                allowed = f"{1e3 * reach.displacement:.3g} mm and {reach.velocity:.3g} m/s are allowed; {NOT_BOTH}"
                raise InvalidInput("record", f"{1e3 * far:.4g} mm and {fast:.3g} m/s", allowed)
        return target


def prepare(
    record: SampledRecord,
    *,
    band: tuple[float, float] | None,
    peak: float | None,
    reach: Reach | None = None,
    method: Method = Method.LEAST_CHANGE,
    trim: float | None = TRIM,
    length_ratio: float = 1.0,
    periods: Array = PERIODS,
) -> PreparedMotion:
    """The motion of the table for `record`: similitude, then `trim`, `band`, `peak` and `reach`, in this order.

    `length_ratio`: model over prototype length, with unchanged acceleration. `trim`: fraction of the Arias intensity
    removed at each end; None keeps the whole record. `band` [Hz]: -6 dB points of zero-phase filters, with rest before
    and after; the table then ends at rest where it began. `peak` [m/s2]: of the trimmed and filtered record. `reach`:
    limits of the table's motion, to which the record is fitted by `method`, which changes the peak; `periods` [s] are
    those at which the method least-change preserves the response spectrum. Raises InvalidInput for an impossible
    request.
    """
    peak_before = float(np.abs(record.acceleration).max())
    if not peak_before > 0.0:
        raise InvalidInput("record", "no motion", "a record must have non-zero samples")
    steps: list[str] = []
    made = scaled(record, length_ratio)
    if length_ratio != 1.0:
        steps.append(f"similitude: length x {length_ratio:g}, time x {length_ratio**0.5:.4g}, acceleration unchanged")
    begin = 0.0
    if trim is not None:
        made, begin, said = _trimmed(made, trim)
        steps.append(said)
    if band is not None:
        made, rest = _filtered(made, band)
        begin -= rest
        steps.append(
            f"band {band[0]:g} to {band[1]:g} Hz: zero phase, Butterworth of order {ORDER}, forwards and backwards"
        )
    factor = 1.0
    if peak is not None:
        factor = _factor(made, peak)
        made = SampledRecord(factor * made.acceleration, made.dt)
        steps.append(f"scaled by {factor:.4g} to a peak of {peak:.4g} m/s2")
    fit = None
    if reach is not None:
        fit = fit_stroke(made, reach, method, periods, band=band)
        made, begin = fit.record, begin - fit.lead
        steps.append(f"fitted to {1e3 * reach.displacement:.3g} mm and {reach.velocity:.3g} m/s: {fit.done}")
    return PreparedMotion(
        record=made,
        begin=begin,
        time_ratio=length_ratio**0.5,
        band=band,
        factor=factor,
        peak_before=peak_before,
        peak=float(np.abs(made.acceleration).max()),
        motion=table_motion(made.acceleration, made.dt),
        reach=reach,
        fit=fit,
        steps=tuple(steps),
    )


class _Trimmed(NamedTuple):
    record: SampledRecord
    begin: float
    text: str


def _trimmed(record: SampledRecord, share: float) -> _Trimmed:
    if not 0.0 < share < 0.5:
        raise InvalidInput(
            "trim", share, "the fraction of the Arias intensity trimmed at each end must be above 0 and below 0.5"
        )
    intensity: Array = np.cumsum(record.acceleration**2)
    whole = float(intensity[-1])
    first, last = (int(np.searchsorted(intensity, part * whole)) for part in (share, 1.0 - share))
    room = max(round(TAPER / record.dt), 1)
    start, stop = max(first - room, 0), min(last + room, intensity.size - 1)
    place = np.arange(start, stop + 1)
    beyond = np.maximum(np.maximum(first - place, place - last), 0) / room
    kept = record.acceleration[start : stop + 1] * 0.5 * (1.0 + np.cos(np.pi * beyond))
    said = f"kept {first * record.dt:.4g} to {last * record.dt:.4g} s of {record.duration:.4g} s"
    said += f": {100.0 * share:g} % of the Arias intensity removed at each end"
    return _Trimmed(SampledRecord(kept, record.dt), start * record.dt, said)


def _filtered(record: SampledRecord, band: tuple[float, float]) -> tuple[SampledRecord, float]:
    """The band-limited record, and the duration of the rest added before it [s]. The upper end of the band may exceed
    the record's Nyquist frequency.
    """
    from scipy.fft import next_fast_len

    low, high = band
    most = 0.5 / record.dt
    if not 0.0 < low < min(high, most):
        raise InvalidInput(
            "band",
            band,
            "its ends must be positive and ascending, and its lower end must be below "
            f"{most:g} Hz, half the sample rate of the record",
        )
    rest = round(REST / low / record.dt)
    padded = np.zeros(next_fast_len(record.acceleration.size + 2 * rest, real=True))
    padded[rest : rest + record.acceleration.size] = record.acceleration
    frequency = np.fft.rfftfreq(padded.size, record.dt).astype(np.float64)
    filtered = np.fft.irfft(band_gain(frequency, band) * np.fft.rfft(padded), padded.size)
    return SampledRecord(with_final_rest(filtered, record.dt), record.dt), rest * record.dt


def _factor(record: SampledRecord, peak: float) -> float:
    """Factor that scales the record to the requested `peak` [m/s2]."""
    if not (np.isfinite(peak) and peak > 0.0):
        raise InvalidInput("peak", peak, "it must be a positive acceleration")
    there = float(np.abs(record.acceleration).max())
    if not there > 0.0:
        raise InvalidInput("band", "no motion", "the record has no content within this band: widen it")
    return peak / there
