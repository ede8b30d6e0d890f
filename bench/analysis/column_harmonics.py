"""Harmonics of storeys whose columns are not linear, in a steady motion.

Stiffness that depends on the drift and dry friction are forces f(drift) beside the linear one, periodic as the motion
is. To first order they move the linear frame:

    (K + s C + s^2 M) u = (f_2 - f_1, -f_2),    s = i k omega

for each harmonic k of the forces f_1 and f_2 of the lower and upper columns.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.linear import frame_matrices
from sim.specimen import Frame

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SIZES: Array = np.array([0.1, 0.1, 0.01])
"""Largest expected forces of one storey's columns, relative to the linear one at the largest drift: in proportion to
the drift's square and cube, and friction.
"""

FORCES = SIZES.size
"""Number of forces of one storey."""


@dataclass(frozen=True, eq=False)
class ColumnHarmonics:
    """Complex amplitudes of motions due to both storeys' columns, `found`, shape (m, 2 * FORCES) [m]: the forces are as
    large as the linear one of the storey at its `largest` drift, shape (2,) [m].
    """

    found: Complex
    largest: Array

    def scaled(self, largest: Array) -> Complex:
        """The amplitudes for forces that are SIZES times the linear one at other `largest` drifts, shape (2,)."""
        shares = (self.largest / largest)[:, None]
        factors = np.concatenate((shares, shares**2, 1.0 / shares), axis=1) * SIZES
        return np.asarray(self.found * factors.ravel(), dtype=np.complex128)


def forces(drift: Array) -> tuple[Array, float]:
    """Forces of the columns of one storey, relative to the linear one at the largest `drift`, shape (FORCES, n); and
    this drift [m]. The drift, shape (n,), is that of one period.
    """
    drift = drift - drift.mean()
    largest = max(float(np.abs(drift).max()), float(np.finfo(np.float64).tiny))
    part = drift / largest
    return np.array([part**2, part**3, np.sign(np.roll(drift, -1) - np.roll(drift, 1))]), largest


def amplitudes(values: Array) -> Complex:
    """Complex amplitudes c_k of periodic `values`, shape (..., n), which are Re(sum of c_k exp(-i k phase)); k is the
    first axis.
    """
    return np.moveaxis(np.fft.rfft(values).conj(), -1, 0) * (2.0 / values.shape[-1])


def column_harmonics(
    frame: Frame, omega: float, drifts: Array, orders: range
) -> tuple[ColumnHarmonics, ColumnHarmonics]:
    """Harmonics `orders` of both storeys at `omega` [rad/s], for the `drifts` of both over one period, shape (2, n)
    [m].
    """
    mass, damping, stiffness = frame_matrices(frame)
    # the conjugate of the response, as amplitudes multiply exp(-i k phase)
    s = -1j * omega * np.array(orders)[:, None, None]
    inverse = np.linalg.inv(stiffness + s * damping + s**2 * mass)
    parts = list[Complex]()
    largest = np.empty(2)
    pushed = np.array([-1.0, 0.0]), np.array([1.0, -1.0])
    for storey, (drift, k, where) in enumerate(zip(drifts, (frame.k1, frame.k2), pushed, strict=True)):
        relative, largest[storey] = forces(drift)
        force = k * largest[storey] * amplitudes(relative)[orders.start : orders.stop]
        parts.append((inverse @ where)[:, :, None] * force[:, None, :])
    found = np.concatenate(parts, axis=2)
    return ColumnHarmonics(found[:, 0], largest), ColumnHarmonics(found[:, 1], largest)
