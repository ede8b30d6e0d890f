"""What one played record shows: the table's motion, the peaks, and what the lasers saw there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import DISPLACEMENT, DRIFT, LASER_1, LASER_2, U1
from bench.analysis.transient_base import BaseMotion, base_motion
from bench.analysis.transient_peak import TransientPeak, transient_peak

Array = NDArray[np.float64]

QUIET = 0.5
"""Share of the rest before a record from which the noise is taken: the filters ring in the other part."""


@dataclass(frozen=True)
class PeakSeen:
    """A peak, and what its sensors did there, counted in its direction.

    `lasers` [m]: what either laser saw; `speeds` [m/s]: how fast that changed; `swings` [m]: how far it changed within
    the window of the fit. `table` [m] is the table's displacement.
    """

    peak: TransientPeak
    lasers: tuple[float, float]
    speeds: tuple[float, float]
    swings: tuple[float, float]
    table: float


@dataclass(frozen=True, eq=False)
class Observed:
    """One record, played once; `drift` and `u1` [m] are the peaks, `history` the drift [m] at every sample."""

    base: BaseMotion
    drift: PeakSeen
    u1: PeakSeen
    history: Array


def observe(signals: Array, rest: int, sample_rate: float) -> Observed:
    """Signals of a whole record, shape (n, len(SIGNALS)), whose first `rest` samples are still. Raises InvalidInput."""
    still = signals[: round(QUIET * rest)]
    return Observed(
        base=base_motion(signals, still, sample_rate),
        drift=_seen(signals, still, DRIFT, sample_rate),
        u1=_seen(signals, still, U1, sample_rate),
        history=signals[:, DRIFT],
    )


def _seen(signals: Array, still: Array, column: int, sample_rate: float) -> PeakSeen:
    values, quiet = signals[:, column], still[:, column]
    peak = transient_peak(values, quiet[np.isfinite(quiet)], sample_rate)
    place, half = round(peak.time * sample_rate), max(round(peak.window * sample_rate), 2)
    window = signals[max(place - half, 0) : place + half + 1]
    # a straight line through the window is the value and the speed in its middle, whatever single samples do
    time = (np.arange(len(window)) - min(place, half)) / sample_rate
    lines = [_line(time, window[:, each]) for each in (LASER_1, LASER_2, DISPLACEMENT)]
    (first, v1), (second, v2), (table, _) = lines
    swings = [float(np.nanmax(window[:, each]) - np.nanmin(window[:, each])) for each in (LASER_1, LASER_2)]
    return PeakSeen(
        peak,
        lasers=(peak.sign * first, peak.sign * second),
        speeds=(v1, v2),
        swings=(swings[0], swings[1]),
        table=peak.sign * table,
    )


def _line(time: Array, values: Array) -> tuple[float, float]:
    known = np.isfinite(values)
    # the middle of a parabola, not of a chord, is where a turning point is
    parabola = np.polynomial.Polynomial.fit(time[known], values[known], 2).convert()
    return float(parabola(0.0)), float(parabola.deriv()(0.0))
