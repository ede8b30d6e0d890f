"""Exact linear response of the frame on a moving table, in closed form in modal coordinates.

With z the absolute displacements of the storeys and x that of the table, the lower spring k_1 and dashpot c_1 act on
the motion relative to the table:

    M z'' + C z' + K z = (k_1 x + c_1 x', 0)

With w = z' - (c_1 / m_1, 0) x, the derivative of x is not required. The state (z, w) has two pairs of complex modes;
each follows q' = lambda q + beta x, which is integrated exactly for linear interpolation of x (first-order hold).
Source: Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed., 6.3.2.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Constants(NamedTuple):
    """Masses [kg], stiffnesses [N/m] and dashpots [N s/m] of the frame.

    A spring between storey 1 and the table is part of k1: if the block is held, k1 + k_C is measured.
    """

    m1: float
    m2: float
    k1: float
    k2: float
    c1: float
    c2: float


@dataclass(frozen=True, eq=False)
class Response:
    """The frame's two modes; `poles`, shape (2,) [1/s], are those in the upper half plane, the slower first.

    `shapes`, shape (4, 2), are the mode shapes in (z1, z2, w1, w2); `adjoint`, shape (2, 4), maps a state to the modes;
    `push`, shape (2,), is the input vector for x. `step` is the time between samples [s], `feed` [1/s] the direct feed
    of x to z1'.
    """

    poles: Complex
    shapes: Complex
    adjoint: Complex
    push: Complex
    step: float
    feed: float

    def free(self, n: int) -> Complex:
        """exp(lambda t) of the modes at n samples, shape (2, n)."""
        return np.exp(self.poles[:, None] * (self.step * np.arange(n)))

    def forced(self, x: Array) -> Complex:
        """Modal coordinates under the table displacement `x` [m], shape (n,), from rest: shape (2, n)."""
        from scipy import signal

        lfilter: Any = signal.lfilter
        h = self.step
        z = self.poles * h
        turn = np.exp(z)
        first = (turn - 1.0) / z
        second = (turn - 1.0 - z) / z**2
        q = np.zeros((2, x.size), np.complex128)
        # a locked table does not push
        for mode in range(2) if x.any() else ():
            taps = self.push[mode] * h * np.array([second[mode], first[mode] - second[mode]])
            # the first sample has no segment of the interpolated motion before it
            q[mode] = lfilter(taps, [1.0, -turn[mode]], x, zi=-taps[:1] * x[0])[0]
        return q

    def storeys(self, q: Complex) -> Array:
        """Absolute displacements (z1, z2) [m], shape (2, n), for modal coordinates, shape (2, n)."""
        return 2.0 * (self.shapes[:2] @ q).real

    def velocities(self, q: Complex, x: Array) -> Array:
        """Absolute velocities (z1', z2') [m/s], shape (2, n), with the table displacement `x` [m], shape (n,)."""
        found = 2.0 * (self.shapes[2:] @ q).real
        found[0] += self.feed * x
        return found


def response(constants: Constants, step: float) -> Response:
    """The modes of a frame sampled every `step` [s]. Raises ArithmeticError unless both modes oscillate."""
    m1, m2, k1, k2, c1, c2 = constants
    inverse = np.array([[1.0 / m1], [1.0 / m2]])
    stiffness = inverse * np.array([[k1 + k2, -k2], [-k2, k2]])
    damping = inverse * np.array([[c1 + c2, -c2], [-c2, c2]])
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-stiffness, -damping]])
    feed = np.array([c1 / m1, 0.0])
    entry = np.concatenate((feed, np.array([k1 / m1, 0.0]) - damping @ feed))
    if not np.isfinite(system).all():
        raise ArithmeticError("the matrices of the frame are not finite")
    found, vectors = np.linalg.eig(system)
    poles = np.asarray(found, np.complex128)
    upper = np.flatnonzero(poles.imag > 0.0)
    if upper.size != 2:
        raise ArithmeticError("the frame does not oscillate in two modes")
    upper = upper[np.argsort(np.abs(poles[upper]))]
    adjoint = np.linalg.inv(vectors)[upper]
    return Response(
        poles=poles[upper],
        shapes=vectors[:, upper].astype(np.complex128),
        adjoint=adjoint.astype(np.complex128),
        push=(adjoint @ entry).astype(np.complex128),
        step=step,
        feed=float(feed[0]),
    )


NAMES = ("k1", "k2", "xi1", "xi2", "c1", "c2", "omega1", "omega2")
"""Quantities identified from a decay: stiffnesses, modal damping ratios, dashpots, undamped circular frequencies."""

UNITS = ("N/m", "N/m", "1", "1", "N s/m", "N s/m", "rad/s", "rad/s")
K1, K2, XI1, XI2, C1, C2, OMEGA1, OMEGA2 = range(len(NAMES))


def quantities(constants: Constants) -> Array:
    """Quantities of `NAMES`, shape (8,): xi_i = phi_i' C phi_i / (2 omega_i) with mass-normalised undamped modes."""
    omega, shapes = _modes(constants)
    c1, c2 = constants.c1, constants.c2
    damping = np.array([[c1 + c2, -c2], [-c2, c2]])
    xi = np.einsum("ji,jk,ki->i", shapes, damping, shapes) / (2.0 * omega)
    return np.array([constants.k1, constants.k2, *xi, c1, c2, *omega])


def slopes(constants: Constants) -> tuple[Array, Array]:
    """Derivatives of `quantities` with respect to (k1, k2, c1, c2), shape (8, 4), and to (m1, m2), shape (8, 2)."""
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
