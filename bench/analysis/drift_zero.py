"""Zero of the drift of a transient, from the momentum of the second storey.

At rest, a laser shows its position only to within one step of its output, and this error enters the peak of the drift
in full. In motion it averages out over many steps, and the second storey tells the mean of the drift: with its absolute
displacement x_2 and the drift d,

    m_2 x_2'' = -(k_2 d + c_2 d')

for any motion of table and block, which act on the second storey only through the first. With a smooth weight w that
vanishes with its slope at both ends, here that of Hann's window, integration by parts gives

    integral of w d = -(m_2 / k_2) integral of w'' x_2 + (c_2 / k_2) integral of w' d

whose right side is small, since w changes slowly compared with the motion; an offset of x_2 has no effect.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.linearity import LinearFrame
from bench.analysis.signals import DISPLACEMENT, DRIFT, LASER_1, LASER_2

Array = NDArray[np.float64]

STRONG = 0.05
"""Drift, relative to the largest, from which the motion passes many steps of a laser: from its first to its last sample
the mean is taken.
"""

FEWEST, COMPLETE = 4.0, 0.98
"""Minimum number of periods of the first mode, and minimum fraction of valid samples, in that time."""

PLACES = 48
"""Number of readings of each laser that represent the motion."""


@dataclass(frozen=True, eq=False)
class DriftZero:
    """Reading of the drift [m] without a drift, and readings of both lasers [m], shape (2, PLACES), whose mean has the
    same error due to the linearity of the lasers.
    """

    drift: float
    readings: Array


def shortest(frame: LinearFrame) -> float:
    """Shortest duration of a strong motion that is evaluated [s]."""
    return FEWEST * 2.0 * np.pi / frame.specimen.frame.natural_frequencies[0]


def strong_part(signals: Array, frame: LinearFrame, sample_rate: float) -> slice | None:
    """Samples of `signals`, shape (n, len(SIGNALS)), from the first to the last strong drift; None if they are too few
    or too many of them are missing.
    """
    size = np.abs(signals[:, DRIFT])
    known = np.isfinite(size)
    largest = np.max(size, where=known, initial=0.0)
    strong = np.flatnonzero(size >= STRONG * largest)
    if largest == 0.0 or (strong[-1] - strong[0]) / sample_rate < shortest(frame):
        return None
    during = slice(int(strong[0]), int(strong[-1]) + 1)
    return during if known[during].mean() >= COMPLETE else None


def drift_zero(signals: Array, frame: LinearFrame, sample_rate: float) -> DriftZero | None:
    """Zero of the drift in `signals`, shape (n, len(SIGNALS)), of a `frame` with or without block; None if the motion
    is too short, or too many samples are missing.
    """
    during = strong_part(signals, frame, sample_rate)
    if during is None:
        return None
    valid = np.isfinite(signals[during, DRIFT])
    times = np.arange(valid.size)
    drift, first, second, table = (
        np.interp(times, times[valid], signals[during, column][valid])
        for column in (DRIFT, LASER_1, LASER_2, DISPLACEMENT)
    )
    # Hann's window
    weight = np.sin(np.pi * (times + 0.5) / valid.size) ** 2
    bend = np.diff(weight, 2, prepend=0.0, append=0.0) * sample_rate**2
    slope = np.gradient(weight) * sample_rate
    storey, c2 = frame.specimen.frame, frame.specimen.frame.dashpots[1]
    absolute = second if frame.grounded else second + table
    force = storey.m2 * (bend @ absolute) - c2 * (slope @ drift)
    zero = (weight @ drift + force / storey.k2) / weight.sum()
    return DriftZero(float(zero), np.stack([_quantiles(each, weight) for each in (first, second)]))


def _quantiles(readings: Array, weight: Array) -> Array:
    """Readings that divide the weighted distribution of `readings` into PLACES equal parts, in the middle of each."""
    order = np.argsort(readings)
    share = np.cumsum(weight[order])
    middles = (np.arange(PLACES) + 0.5) / PLACES * share[-1]
    return readings[order][np.searchsorted(share, middles)]
