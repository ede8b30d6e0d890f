"""Stiffness and modal damping ratios of a frame from its constants, and how they change with them."""

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.response import Constants

Array = NDArray[np.float64]

NAMES = ("k1", "k2", "xi1", "xi2", "c1", "c2", "omega1", "omega2")
"""What a decay tells of a frame, in SI units: stiffnesses, modal damping ratios, dashpots, undamped frequencies."""

UNITS = ("N/m", "N/m", "1", "1", "N s/m", "N s/m", "rad/s", "rad/s")
K1, K2, XI1, XI2, C1, C2, OMEGA1, OMEGA2 = range(len(NAMES))


def quantities(constants: Constants) -> Array:
    """Those of `NAMES`, shape (8,): xi_i = phi_i' C phi_i / (2 omega_i) with mass-normalised undamped modes."""
    omega, shapes = _modes(constants)
    c1, c2 = constants.c1, constants.c2
    damping = np.array([[c1 + c2, -c2], [-c2, c2]])
    xi = np.einsum("ji,jk,ki->i", shapes, damping, shapes) / (2.0 * omega)
    return np.array([constants.k1, constants.k2, *xi, c1, c2, *omega])


def slopes(constants: Constants) -> tuple[Array, Array]:
    """Derivatives of `quantities` to (k1, k2, c1, c2), shape (8, 4), and to (m1, m2), shape (8, 2)."""
    columns: list[Array] = []
    for place, value in enumerate(constants):
        step = 1e-6 * max(abs(value), 1e-3)
        up, down = [*constants], [*constants]
        up[place] += step
        down[place] -= step
        columns.append((quantities(Constants(*up)) - quantities(Constants(*down))) / (2.0 * step))
    whole = np.array(columns).T
    return whole[:, 2:], whole[:, :2]


def _modes(constants: Constants) -> tuple[Array, Array]:
    root = np.sqrt(np.array([constants.m1, constants.m2]))
    stiffness = np.array([[constants.k1 + constants.k2, -constants.k2], [-constants.k2, constants.k2]])
    values, vectors = np.linalg.eigh(stiffness / np.outer(root, root))
    return np.sqrt(np.maximum(values, 0.0)), vectors / root[:, None]
