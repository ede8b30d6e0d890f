"""Observation of a record: motion of the table, and peaks of drift and u1 with the readings of the sensors at them."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bench.analysis.drift_zero import drift_zero
from bench.analysis.linearity import LinearFrame
from bench.analysis.signals import DISPLACEMENT, DRIFT, LASER_1, LASER_2, SIGNALS, U1
from bench.analysis.transient_base import BaseMotion, base_motion
from bench.analysis.transient_peak import TransientPeak, transient_peak
from sim.errors import InvalidInput

Array = NDArray[np.float64]

QUIET = 0.5
"""Fraction of the rest before a record that is used to determine the noise; in the remainder, the zero-phase filters
already respond to the record.
"""


@dataclass(frozen=True)
class PeakSeen:
    """A peak, and the sensor signals at its time.

    `lasers` [m] are the readings of the lasers and `table` [m] the table's displacement, both positive in the direction
    of the peak; `speeds` [m/s] are the rates of change of the lasers' signals, and `swings` [m] the ranges of these
    signals within the fit window. `others` are peaks of other half cycles that are almost as large: the largest true
    one may be among them. `zero` [m], shape (2, n), are readings of the lasers whose mean is the zero of the peak; None
    if it was taken at rest.
    """

    peak: TransientPeak
    lasers: tuple[float, float]
    speeds: tuple[float, float]
    swings: tuple[float, float]
    table: float
    others: tuple["PeakSeen", ...] = ()
    zero: Array | None = None


@dataclass(frozen=True, eq=False)
class Observed:
    """Measurement under one record: motion of the table, peaks of `drift` and `u1` [m] relative to the zero at rest.

    `centred` is the peak of the drift relative to the zero from the momentum of the second storey; None if it was not
    evaluated.
    """

    base: BaseMotion
    drift: PeakSeen
    u1: PeakSeen
    centred: PeakSeen | None = None


def observe(signals: Array, rest: int, sample_rate: float, frame: LinearFrame | None = None) -> Observed:
    """Evaluate the signals of a complete record, shape (n, len(SIGNALS)), whose first `rest` samples are at rest.

    With the `frame`, and if the motion is long enough, `centred` is evaluated as well. Raises InvalidInput for signals
    without a measurable motion or peak.
    """
    still = signals[: round(QUIET * rest)]
    return Observed(
        base=base_motion(signals, still, sample_rate),
        drift=_with_others(_sensor_peak(signals, still, DRIFT, sample_rate), signals, still, sample_rate),
        u1=_sensor_peak(signals, still, U1, sample_rate),
        centred=None if frame is None else _centred(signals, still, sample_rate, frame),
    )


def _centred(signals: Array, still: Array, sample_rate: float, frame: LinearFrame) -> PeakSeen | None:
    """The peak of the drift relative to the zero from momentum, with its rivals; None if there is no such zero."""
    zero = drift_zero(signals, frame, sample_rate)
    if zero is None:
        return None
    moved = signals.copy()
    moved[:, DRIFT] -= zero.drift
    seen = _with_others(_sensor_peak(moved, still, DRIFT, sample_rate), moved, still, sample_rate)
    return replace(seen, zero=zero.readings, others=tuple(replace(each, zero=zero.readings) for each in seen.others))


NEAR = 0.02
"""Relative difference from the largest peak up to which another peak may be larger, given the errors of the lasers."""

_MOST = 4


def _with_others(seen: PeakSeen, signals: Array, still: Array, sample_rate: float) -> PeakSeen:
    """The peak of the drift with those of other half cycles that are at most `NEAR` smaller."""
    others, last = list[PeakSeen](), seen
    left = signals.copy()
    while len(others) < _MOST:
        _remove(left[:, DRIFT], last.peak, sample_rate)
        try:
            last = _sensor_peak(left, still, DRIFT, sample_rate)
        except InvalidInput:
            break
        if last.peak.value < (1.0 - NEAR) * seen.peak.value:
            break
        others.append(last)
    return replace(seen, others=tuple(others))


def _remove(values: Array, peak: TransientPeak, sample_rate: float) -> None:
    """Clip the half cycle of a peak at half its height."""
    place, half = round(peak.time * sample_rate), 0.5 * peak.sign * peak.value
    beyond = np.flatnonzero(~(peak.sign * values > abs(half)))
    end = int(np.searchsorted(beyond, place))
    begin = int(beyond[end - 1]) + 1 if end else 0
    values[begin : int(beyond[end]) if end < beyond.size else values.size] = half


def _sensor_peak(signals: Array, still: Array, column: int, sample_rate: float) -> PeakSeen:
    values, quiet = signals[:, column], still[:, column]
    peak = transient_peak(values, quiet[np.isfinite(quiet)], sample_rate)
    place, half = round(peak.time * sample_rate), max(round(peak.window * sample_rate), 2)
    window = signals[max(place - half, 0) : place + half + 1]
    # values and rates come from a fit over the window, which is insensitive to single samples
    time = (np.arange(len(window)) - min(place, half)) / sample_rate
    lines = [_line(time, window[:, each], SIGNALS[each]) for each in (LASER_1, LASER_2, DISPLACEMENT)]
    (first, v1), (second, v2), (table, _) = lines
    swings = [float(np.nanmax(window[:, each]) - np.nanmin(window[:, each])) for each in (LASER_1, LASER_2)]
    return PeakSeen(
        peak,
        lasers=(peak.sign * first, peak.sign * second),
        speeds=(v1, v2),
        swings=(swings[0], swings[1]),
        table=peak.sign * table,
    )


def _line(time: Array, values: Array, name: str) -> tuple[float, float]:
    known = np.isfinite(values)
    if np.count_nonzero(known) < 3:
        raise InvalidInput(name, f"{np.count_nonzero(known)} valid samples", "it has too few of them around the peak")
    # a parabola, since a straight line misses the value at a turning point
    parabola = np.polynomial.Polynomial.fit(time[known], values[known], 2).convert()
    return float(parabola(0.0)), float(parabola.deriv()(0.0))
