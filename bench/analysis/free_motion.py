"""Description of an unsteady motion: its peaks, its period, and the rate of its approach to a periodic motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import tau
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle
from bench.analysis.gain import SteadyPeak, steady_peak
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.signals import DRIFT, LASER_1, LASER_2, U1
from bench.analysis.unsteady_peaks import UnsteadyPeaks, uninterrupted, unsteady_peaks
from sim.attractor import LONGEST_PERIOD, period_of

CYCLES = 4 * LONGEST_PERIOD
"""Largest number of cycles, counted from the end, from which peaks and period are determined."""

KEPT = 1000
"""Largest number of cycles from which the rate is computed."""

LINEAR = 0.98
"""Smallest fraction of the changes from cycle to cycle that one pair of multipliers must explain for a rate to be
reported.
"""


KNOWN, TURNS = 0.02, 2.0
"""Largest standard uncertainty of the modulus, and minimum number of turns of the spiral about the orbit, for which the
orbit's peak is reported: a mean over less than one turn covers only one side of the orbit.
"""

UNKNOWN = 0.1
"""Standard uncertainty of the modulus above which no rate is reported, since the multiplier is then due to noise."""

SMALL = 0.15
"""Largest deviation of the peaks, half their range relative to their mean, for which the orbit's peak is reported."""

SHORTEST, SINGULAR, STEP = 24, 1e8, 1e-6
"""Settings for the computation of a rate: smallest number of changes, largest condition number of the equations, and
step of the finite differences.
"""


@dataclass(frozen=True)
class Rate:
    """Slowest-decaying pair of multipliers of a motion near a periodic motion: `modulus` per cycle with its standard
    `uncertainty`, and `angle` [rad] per cycle.
    """

    modulus: float
    uncertainty: float
    angle: float

    @property
    def decays(self) -> bool:
        """Whether the deviation from a periodic motion decays significantly."""
        return self.modulus + 2.0 * self.uncertainty < 1.0


@dataclass(frozen=True)
class FreeMotion:
    """Peaks of the drift, see `bench.analysis.unsteady_peaks`. `repeats` is the number of cycles after which the motion
    repeats, 0 if it does not; `rate` is None if the changes are too few, too noisy or not those of a linear system.
    """

    peaks: UnsteadyPeaks
    repeats: int
    rate: Rate | None


def free_motion(cycles: Sequence[Cycle], omega: float, accuracy: SensorAccuracy) -> FreeMotion:
    """Description of cycles at a constant drive of `omega` [rad/s]; peaks and period are those of the last `CYCLES`.

    Where cycles are missing, period and rate are those of the longest stretch without a missing cycle.
    """
    last = cycles[-CYCLES:]
    return FreeMotion(
        peaks=unsteady_peaks(last, omega, accuracy),
        repeats=period_of(np.array([cycle.extreme[[U1, DRIFT]] for cycle in _longest(last)])),
        rate=rate_of(cycles),
    )


def orbit_peak(cycles: Sequence[Cycle], motion: FreeMotion, omega: float) -> SteadyPeak | None:
    """Peak of the mean of the last `CYCLES` cycles at `omega` [rad/s], which to second order in the deviation is the
    peak of the periodic motion about which the motion spirals. None if the deviation is large, or if the rate is
    unknown, too uncertain or based on too few turns.

    The square of the relative deviation is added as a transient with a rectangular distribution. On exact motions of
    the model near their boundaries of stability, with deviations up to 10 %, the error was at most 5.1e-4.
    """
    peaks, rate = motion.peaks, motion.rate
    deviation = 0.5 * (peaks.greatest.drift - peaks.least.drift) / peaks.mean.drift
    if rate is None or deviation > SMALL or rate.uncertainty > KNOWN or rate.angle * peaks.mean.cycles < TURNS * tau:
        return None
    return steady_peak(cycles[-CYCLES:], omega, deviation**2)


def _longest(cycles: Sequence[Cycle]) -> Sequence[Cycle]:
    """Longest stretch without a missing cycle."""
    return max(uninterrupted(cycles), key=len)


def rate_of(cycles: Sequence[Cycle]) -> Rate | None:
    """Rate from the linear map of changes from cycle to cycle, in the plane of their two largest principal components.

    Earlier changes are the instrumental variables of the least-squares problem. Without them, noise of the amplitudes
    would bias the multipliers towards zero; the noise is independent for changes that share no cycle.
    """
    amplitudes = np.array([cycle.fundamental[[LASER_1, LASER_2]] for cycle in _longest(cycles)])
    moved = np.diff(np.concatenate((amplitudes.real, amplitudes.imag), axis=1), axis=0)
    size = float(np.sum(moved**2))
    if moved.shape[0] < SHORTEST or size == 0.0:
        return None
    _, _, axes = np.linalg.svd(moved, full_matrices=False)
    plane = moved @ axes[:2].T
    instruments, before, after = plane[:-3], plane[2:-1], plane[3:]
    common = instruments.T @ before
    if np.linalg.cond(common) > SINGULAR:
        return None
    found = np.linalg.solve(common, instruments.T @ after)
    residual = after - before @ found
    explained = 1.0 - float(np.sum(residual**2)) / float(np.sum(after**2))
    if explained < LINEAR or float(np.sum(plane**2)) < LINEAR * size:
        return None
    slowest = max(np.linalg.eigvals(found), key=abs)
    scatter = residual.T @ residual / (residual.shape[0] - 2)
    spread = np.linalg.solve(common, np.linalg.solve(common, instruments.T @ instruments).T)
    rate = Rate(float(abs(slowest)), _uncertainty(found, spread, scatter), float(abs(np.angle(slowest))))
    return rate if rate.uncertainty <= UNKNOWN else None


def _uncertainty(found: NDArray[Any], spread: NDArray[Any], scatter: NDArray[np.float64]) -> float:
    """Standard uncertainty of the largest modulus, to first order; the covariance of the elements of `found` is the
    product of `spread` (for the rows) and `scatter` (for the columns).
    """

    def modulus(change: NDArray[np.float64]) -> float:
        return float(np.abs(np.linalg.eigvals(found + change)).max())

    units = np.eye(4).reshape(4, 2, 2) * STEP
    slopes = np.array([modulus(unit) - modulus(-unit) for unit in units]).reshape(2, 2) / (2.0 * STEP)
    return float(np.sqrt(max(np.einsum("ij,kl,ik,jl->", slopes, slopes, spread, scatter), 0.0)))
