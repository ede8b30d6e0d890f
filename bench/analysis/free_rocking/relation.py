"""Restitution from the sizes of the swings alone.

Between impacts the energy is kept, so the largest angles before and after an impact tell what it left of the angular
velocity, exactly and whatever the time it took:

    r_n^2 = (cos(alpha - |theta_n+1|) - cos(alpha)) / (cos(alpha - |theta_n|) - cos(alpha)).

For a constant r the logarithm of that energy falls along a line, by 2 ln(r) an impact; the line through all of them
gives the mean r. alpha and the laser's scale enter, but only weakly: both sides of the quotient have them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_rocking.points import Points
from sim.free_rocking import energy

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Relation:
    """r of single impacts, and of all of them by the line.

    `speed`, shape (n,), of each impact over that of a fall from alpha; `each` and `each_uncertainty`, shape (n,),
    standard, of noise; neighbours share a turning point and are correlated. `restitution` has the standard
    `uncertainty` of what scatters about the line; `weights`, shape (m,), make it from changes of the turning `angles`
    [rad], shape (m,).
    """

    speed: Array
    each: Array
    each_uncertainty: Array
    restitution: float
    uncertainty: float
    angles: Array
    weights: Array


def amplitude_relation(points: Points, alpha: float) -> Relation:
    """The relation for a block of critical angle `alpha` [rad], by the turning points up to the first unknown one."""
    known = np.isfinite(points.amplitudes)
    count = int(np.argmin(known)) if not known.all() else known.size
    angles, doubt = points.amplitudes[:count], points.amplitude_uncertainty[:count]
    left = energy(angles, alpha)
    steepness = _steepness(angles, alpha)
    spread = np.abs(steepness) * doubt
    each = np.sqrt(left[1:] / left[:-1])
    number = np.arange(count) - np.average(np.arange(count), weights=spread**-2)
    weights = number / spread**2 / np.sum(number**2 / spread**2)
    slope = float(weights @ np.log(left))
    level = float(np.average(np.log(left), weights=spread**-2))
    off = (np.log(left) - level - slope * number) / spread
    # how much it scatters is told by the scatter itself, whatever the noise of single points was taken for
    birge = float(np.sqrt(off @ off / (count - 2)))
    r = float(np.exp(0.5 * slope))
    return Relation(
        speed=np.sqrt(left[:-1]),
        each=each,
        each_uncertainty=0.5 * each * np.hypot(spread[1:], spread[:-1]),
        restitution=r,
        uncertainty=0.5 * r * birge * float(np.sqrt(np.sum((weights * spread) ** 2))),
        angles=angles,
        weights=0.5 * r * weights * steepness,
    )


def _steepness(angle: Array, alpha: float) -> Array:
    """Derivative of the logarithm of the energy to theta [1/rad]."""
    size = np.abs(angle)
    slope = np.sin(alpha - size) / (2.0 * np.sin(alpha - 0.5 * size) * np.sin(0.5 * size))
    return np.sign(angle) * slope
