"""Linear analysis: modes of the bare frame and of the coupled system, and exact steady response to a sine.

Complex amplitudes: a base acceleration a_g = A sin(omega t) = Im(A exp(i omega t)) gives u = Im(U exp(i omega t)).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput
from sim.rocking import Peaks
from sim.specimen import Frame, Specimen


@dataclass(frozen=True, eq=False)
class Modes:
    """Undamped modes of a linear system, in ascending order of the eigenvalue.

    `omega`, shape (n,) [rad/s]: sign(lambda) sqrt|lambda| for the eigenvalues lambda of M^-1 K. A negative element is
    minus the growth rate of a *divergent* mode, whose stiffness is negative.
    `shapes`, shape (n, n): column i is mode i, scaled to u1 = 1 (or to a largest entry of 1 where u1 vanishes).
    """

    omega: NDArray[np.float64]
    shapes: NDArray[np.float64]

    @property
    def divergent(self) -> NDArray[np.bool_]:
        """Mask of the modes that grow instead of oscillating, shape (n,)."""
        return self.omega < 0.0

    @property
    def hertz(self) -> NDArray[np.float64]:
        """`omega` / (2 pi), shape (n,); negative where divergent."""
        return self.omega / (2.0 * np.pi)


def frame_matrices(frame: Frame) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mass, damping and stiffness matrices of the bare frame for (u1, u2), each of shape (2, 2)."""
    c1, c2 = frame.dashpots
    mass = np.diag([frame.m1, frame.m2])
    damping = np.array([[c1 + c2, -c2], [-c2, c2]])
    stiffness = np.array([[frame.k1 + frame.k2, -frame.k2], [-frame.k2, frame.k2]])
    return mass, damping, stiffness


def bare_modes(frame: Frame) -> Modes:
    """Both modes of the frame without the block, with shapes in (u1, u2)."""
    mass, _, stiffness = frame_matrices(frame)
    return _modes(mass, stiffness)


def coupled_modes(specimen: Specimen) -> Modes:
    """Modes of the linearised coupled system, with shapes in (u1, u2, theta). Source: Eq. (12) to (14).

    The first of the three modes is divergent if h1^2 k_C k1 / (k1 + k_C) < h_b M g: the overturning moment of gravity
    then exceeds the restoring moment of spring and frame in series. With the paper's frame, h1^2 k1 < h_b M g, so that
    this holds for every k_C.
    """
    frame, block = specimen.frame, specimen.block
    frame_mass, _, frame_stiffness = frame_matrices(frame)
    mass, stiffness = np.zeros((3, 3)), np.zeros((3, 3))
    mass[:2, :2], mass[2, 2] = frame_mass, block.inertia
    stiffness[:2, :2] = frame_stiffness
    spring = np.array([1.0, 0.0, frame.h1])
    stiffness += specimen.k_c * np.outer(spring, spring)
    stiffness[2, 2] -= block.h_b * block.mass * specimen.g
    return _modes(mass, stiffness)


def steady_response(
    specimen: Specimen, omega: float, amplitude: float, *, resting: bool = False
) -> tuple[complex, complex]:
    """Complex amplitudes (U1, U2) [m] in the steady state under `amplitude` [m/s2] sin(`omega` [rad/s] t).

    They apply to the bare frame or, with `resting`, to the frame whose spring is attached to a block that never lifts.
    Raises InvalidInput unless omega is positive and finite, and the amplitude is finite.
    """
    if not (0.0 < omega < np.inf):
        raise InvalidInput("omega", omega, "it must be a positive circular frequency in rad/s")
    if not np.isfinite(amplitude):
        raise InvalidInput("amplitude", amplitude, "it must be a finite acceleration in m/s2")
    mass, damping, stiffness = frame_matrices(specimen.frame)
    dynamic = stiffness - omega * omega * mass + 1j * omega * damping
    if resting:
        dynamic[0, 0] += specimen.k_c
    u1, u2 = np.linalg.solve(dynamic, -amplitude * np.diag(mass))
    return complex(u1), complex(u2)


def steady_peaks(specimen: Specimen, omega: float, amplitude: float, *, resting: bool = False) -> Peaks:
    """Largest |u1| and |u2 - u1| [m] of `steady_response`; theta is 0."""
    u1, u2 = steady_response(specimen, omega, amplitude, resting=resting)
    return Peaks(u1=abs(u1), drift=abs(u2 - u1), theta=0.0)


def bare_peaks(
    frames: Sequence[Frame], omega: NDArray[np.float64], amplitude: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Largest |u1| and |u2 - u1| [m] of n bare frames, shape (n, 2), each under its own `amplitude` [m/s2] sin(`omega`
    [rad/s] t); the same as n times `steady_peaks`.
    """
    m1, m2, k1, k2, c1, c2 = np.array([(each.m1, each.m2, each.k1, each.k2, *each.dashpots) for each in frames]).T
    dynamic = np.empty((len(frames), 2, 2), dtype=np.complex128)
    dynamic[:, 0, 0] = k1 + k2 - omega * omega * m1 + 1j * omega * (c1 + c2)
    dynamic[:, 1, 1] = k2 - omega * omega * m2 + 1j * omega * c2
    dynamic[:, 0, 1] = dynamic[:, 1, 0] = -k2 - 1j * omega * c2
    push = -amplitude[:, None] * np.column_stack((m1, m2))
    u1, u2 = np.linalg.solve(dynamic, push[:, :, None])[..., 0].T
    return np.column_stack((np.abs(u1), np.abs(u2 - u1)))


def _modes(mass: NDArray[np.float64], stiffness: NDArray[np.float64]) -> Modes:
    """Modes for symmetric matrices K and M, M diagonal, from the eigenvectors of M^-1/2 K M^-1/2."""
    root = np.sqrt(np.diag(mass))
    values, vectors = np.linalg.eigh(stiffness / np.outer(root, root))
    shapes = vectors / root[:, None]
    largest = shapes[np.abs(shapes).argmax(axis=0), np.arange(values.size)]
    first = shapes[0]
    shapes = shapes / np.where(np.abs(first) > 1e-9 * np.abs(largest), first, largest)
    return Modes(omega=np.sign(values) * np.sqrt(np.abs(values)), shapes=shapes)
