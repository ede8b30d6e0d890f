"""Intensity measures of a record: peaks of acceleration, velocity and displacement, energy and duration.

The samples are interpolated linearly, as in the predictions, and the motion starts from rest. Since no
baseline correction or filter is applied, the final velocity and displacement show the record's drift.
"""

from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.accelerogram import Accelerogram
from bench.accelerograms.units import STANDARD_GRAVITY
from bench.analysis.table_motion import table_motion

Array = NDArray[np.float64]

DRIFTING = 0.05
"""Ratio of final to peak velocity above which a record counts as drifting."""


@dataclass(frozen=True)
class Measures:
    """Measures of one component.

    `pga` [m/s2], `pgv` [m/s] and `pgd` [m] are the largest magnitudes, including those between samples;
    `final_velocity` [m/s] and `final_displacement` [m] are the values at the last sample. `arias` [m/s] is the
    intensity of Arias (1970), pi / (2 g) times the integral of a^2. `significant_5_75` and `significant_5_95` [s] are
    the times in which it grows from 5 to 75 % and from 5 to 95 % of its final value (Trifunac and Brady, Bull. Seism.
    Soc. Am. 65, 1975).
    """

    pga: float
    pgv: float
    pgd: float
    final_velocity: float
    final_displacement: float
    arias: float
    significant_5_75: float
    significant_5_95: float

    @property
    def drifts(self) -> bool:
        """Whether the final velocity exceeds `DRIFTING` times `pgv`, which indicates a baseline error."""
        return abs(self.final_velocity) > DRIFTING * self.pgv


def measures(record: Accelerogram) -> Measures:
    """Intensity measures of the record as it is, without baseline correction."""
    a, dt = record.acceleration, record.dt
    velocity, displacement = table_motion(a, dt)
    energy = husid(a, dt)
    t_5, t_75, t_95 = (_reached(energy, share, dt) for share in (0.05, 0.75, 0.95))
    pgv, pgd = _peaks(velocity, displacement, a, dt)
    return Measures(
        pga=record.peak,
        pgv=pgv,
        pgd=pgd,
        final_velocity=float(velocity[-1]),
        final_displacement=float(displacement[-1]),
        arias=float(energy[-1]),
        significant_5_75=t_75 - t_5,
        significant_5_95=t_95 - t_5,
    )


def husid(acceleration: Array, dt: float) -> Array:
    """Arias intensity [m/s] up to each sample, shape (n,): the Husid curve, exact for linear interpolation."""
    before, after = acceleration[:-1], acceleration[1:]
    grown = np.cumsum((before**2 + before * after + after**2) * (dt / 3.0))
    return pi / (2.0 * STANDARD_GRAVITY) * np.concatenate(([0.0], grown))


def _reached(energy: Array, share: float, dt: float) -> float:
    """Time [s] at which `energy` reaches the fraction `share` of its final value, interpolated between samples."""
    level = share * float(energy[-1])
    k = int(np.searchsorted(energy, level))
    before, after = float(energy[k - 1]), float(energy[k])
    return dt * (k - 1 + (level - before) / (after - before))


def _peaks(velocity: Array, displacement: Array, acceleration: Array, dt: float) -> tuple[float, float]:
    """Largest |velocity| [m/s] and |displacement| [m], including extrema between samples, where velocity is a parabola
    and displacement a cubic.
    """
    from scipy.interpolate import CubicHermiteSpline, PPoly

    time = dt * np.arange(velocity.size)
    # v0 + a0 s + (a1 - a0) s^2 / (2 dt) in each interval
    parabolas = PPoly(np.array([np.diff(acceleration) / (2.0 * dt), acceleration[:-1], velocity[:-1]]), time)
    cubics = CubicHermiteSpline(time, displacement, velocity)
    return _largest(velocity, parabolas), _largest(displacement, cubics)


def _largest(samples: Array, curve: Any) -> float:
    """Largest magnitude of a piecewise polynomial, at a knot (values `samples`) or at an extremum between knots."""
    turns = curve.derivative().roots(extrapolate=False)
    # an interval of zero slope yields NaN, which is ignored
    turns = turns[np.isfinite(turns)]
    return max(float(np.abs(samples).max()), float(np.abs(curve(turns)).max(initial=0.0)))
