"""What the two lasers look at: the storeys, or the face of the block that stands alone."""

import numpy as np
from numpy.typing import NDArray

from sim.arrangement import Arrangement
from sim.block_face import displacement, displacement_rate

Array = NDArray[np.float64]


def sights(states: Array, arrangement: Arrangement, on_ground: bool) -> Array:
    """Displacement [m] and velocity [m/s] seen by laser 1, then by laser 2, shape (4, n).

    `states` are rows x, v, u1, u2, v1, v2, theta, omega, shape (8 or more, n); lasers that stand on the ground see the
    table move too. Displacements count from mid range, which is what each laser looks at when it rests; NaN where
    there is no block, or the beam misses it.
    """
    x, v, u1, u2, v1, v2, theta, omega = states[:8]
    height, specimen = arrangement.watched, arrangement.specimen
    if height is not None and specimen.beta is None:
        u2, v2 = np.full_like(u2, np.nan), np.full_like(v2, np.nan)
    elif height is not None:
        u2 = displacement(theta, height, specimen.block)
        v2 = displacement_rate(theta, height, specimen.block) * omega
    return np.array([u1 + x, v1 + v, u2 + x, v2 + v] if on_ground else [u1, v1, u2, v2])
