"""From a record to the motion that the table is to make: trimmed, within the band, scaled, within the stroke.

Prediction and test take the same motion from here, so that they can be compared. The order matters: what the band
takes away may hold the record's peak, so the record is scaled after it; the stroke is needed by the scaled motion.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.analysis.table_motion import Array, TableMotion, at_rest_in_the_end, table_motion
from bench.control.similitude import resampled, scaled
from bench.control.stroke.fit import NOT_BOTH, PERIODS, Method, StrokeFit, fit_stroke
from bench.control.stroke.reach import Reach
from bench.control.target import ORDER, REST, Target, band_gain, check_band, windowed
from sim.errors import InvalidInput
from sim.excitation import SampledRecord

TRIM = 0.0005
"""Share of the Arias intensity that may be left out at either end of a record."""

TAPER = 0.5
"""Time [s] over which a trimmed record is let down to zero, outside of what is kept: half a cosine."""

BETWEEN = 0.02
"""Share of the reach by which a motion may pass it between the samples of its record: `reach.SHARE` leaves more."""


@dataclass(frozen=True, eq=False)
class PreparedMotion:
    """A motion of the table, and how it came from its record.

    `record` begins `begin` [s] on the clock of the record that was given; before that the table rests. All of its
    accelerations were multiplied by `factor`. `peak_before` and `peak` are the greatest accelerations [m/s2] of the
    given record and of the motion; `motion` is the table's velocity and displacement. `band` [Hz] is None where no
    filter was asked for, `reach` and `fit` None where no stroke was; `steps` says in words what was done, in order.
    """

    record: SampledRecord
    begin: float
    band: tuple[float, float] | None
    factor: float
    peak_before: float
    peak: float
    motion: TableMotion
    reach: Reach | None
    fit: StrokeFit | None
    steps: tuple[str, ...]

    def target(self, sample_rate: float) -> Target:
        """The motion at `sample_rate` [1/s], for its replication on the table.

        Raises InvalidInput without a band, for one that goes beyond the rate, a rate below the record's own, and a
        motion that would leave `reach` by more than `BETWEEN`.
        """
        if self.band is None:
            raise InvalidInput("band", None, "a table has one: name its ends")
        check_band(self.band, sample_rate)
        wave = resampled(self.record, 1.0 / sample_rate).acceleration
        # the straight lines between the record's samples have a trace above the band
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

    `length_ratio`: model over prototype length, acceleration kept. `trim`: from where the Arias intensity passes this
    share of its whole to where it passes the whole less the share; None keeps everything. `band` [Hz]: -6 dB points of
    zero-phase filters, with rest before and after; the table then ends at rest where it began. `peak` [m/s2]: of the
    trimmed and filtered record. `reach`: what the table may do; the fit by `method`, which keeps the response spectrum
    at `periods` [s], then changes the peak a little. Raises InvalidInput.
    """
    peak_before = float(np.abs(record.acceleration).max())
    if not peak_before > 0.0:
        raise InvalidInput("record", "no motion", "a record must have samples that are not zero")
    steps: list[str] = []
    made = scaled(record, length_ratio)
    if length_ratio != 1.0:
        steps.append(f"similitude: length x {length_ratio:g}, time x {length_ratio**0.5:.4g}, acceleration kept")
    begin = 0.0
    if trim is not None:
        made, begin, said = _trimmed(made, trim)
        steps.append(said)
    if band is not None:
        made, rest = _filtered(made, band)
        begin -= rest
        steps.append(f"band {band[0]:g} to {band[1]:g} Hz: zero phase, Butterworth of order {ORDER} there and back")
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
    said: str


def _trimmed(record: SampledRecord, share: float) -> _Trimmed:
    if not 0.0 < share < 0.5:
        raise InvalidInput("trim", share, "a share of the Arias intensity is left out at either end: 0 to 0.5")
    intensity: Array = np.cumsum(record.acceleration**2)
    whole = float(intensity[-1])
    first, last = (int(np.searchsorted(intensity, part * whole)) for part in (share, 1.0 - share))
    room = max(round(TAPER / record.dt), 1)
    start, stop = max(first - room, 0), min(last + room, intensity.size - 1)
    place = np.arange(start, stop + 1)
    beyond = np.maximum(np.maximum(first - place, place - last), 0) / room
    kept = record.acceleration[start : stop + 1] * 0.5 * (1.0 + np.cos(np.pi * beyond))
    said = f"kept {first * record.dt:.4g} to {last * record.dt:.4g} s of {record.duration:.4g} s"
    said += f": {100.0 * share:g} % of the Arias intensity left out at either end"
    return _Trimmed(SampledRecord(kept, record.dt), start * record.dt, said)


def _filtered(record: SampledRecord, band: tuple[float, float]) -> tuple[SampledRecord, float]:
    """The record within the band, and the rest put before it [s]; a corner above what its step holds takes nothing."""
    from scipy.fft import next_fast_len

    low, high = band
    most = 0.5 / record.dt
    if not 0.0 < low < min(high, most):
        raise InvalidInput("band", band, f"it must go up from above 0, and begin below the {most:g} Hz of the record")
    rest = round(REST / low / record.dt)
    padded = np.zeros(next_fast_len(record.acceleration.size + 2 * rest, real=True))
    padded[rest : rest + record.acceleration.size] = record.acceleration
    frequency = np.fft.rfftfreq(padded.size, record.dt).astype(np.float64)
    filtered = np.fft.irfft(band_gain(frequency, band) * np.fft.rfft(padded), padded.size)
    return SampledRecord(at_rest_in_the_end(filtered, record.dt), record.dt), rest * record.dt


def _factor(record: SampledRecord, peak: float) -> float:
    """What gives the record its peak."""
    if not (np.isfinite(peak) and peak > 0.0):
        raise InvalidInput("peak", peak, "it must be a positive acceleration")
    there = float(np.abs(record.acceleration).max())
    if not there > 0.0:
        raise InvalidInput("band", "no motion", "nothing of the record lies within it: widen it")
    return peak / there
