"""Equations of motion, Eq. (8) and (A.1), and mechanical energy.

The equations have the same form for both corners. With sg = +1 and B2 = 0 about corner A (theta > 0), sg = -1 and
B2 = 2b about corner B (theta < 0), s = sin(theta), c = cos(theta):

    dx = d + B2 (1 - c) - h1 s - u1        horizontal length of the spring, Eq. (4)
    dy = -h1 (1 - c) - B2 s                vertical length of the spring
    L  = sqrt(dx^2 + dy^2),  q = (L - d) / L
    m1 (u1'' + a_g) = -(c1 + c2) v1 + c2 v2 - (k1 + k2) u1 + k2 u2 + k_C q dx
    m2 (u2'' + a_g) = -c2 (v2 - v1) - k2 (u2 - u1)
    J theta'' = M g (h_b s - sg b c) + M a_g (h_b c + sg b s) - k_C q G
    G = ((B2 + d) B2 + h1^2) s - h1 d c + u1 (h1 c - B2 s)

As printed in the paper, they suffer from cancellation at small theta and u1. Here 1 - c = 2 sin^2(theta/2), and with
e = dx - d, L - d = (2 d e + e^2 + dy^2) / (L + d).
"""

from math import cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled
from sim.kernel.packing import C1, C2, GRAVITY, H1, H_B, INERTIA, K1, K2, K_C, M1, M2, MASS, B, D
from sim.kernel.packing import COUPLED as COUPLED
from sim.kernel.packing import RESTITUTION as RESTITUTION


@compiled("void(float64[::1], float64, float64[::1], float64, float64[::1])")
def rates(p: NDArray[np.float64], sg: float, x: NDArray[np.float64], a_g: float, out: NDArray[np.float64]) -> None:
    """Write the time derivative of x = [u1, u2, v1, v2, theta, omega] to `out`, shape (6,).

    p : packed parameters, shape (16,).  sg : +1 about A, -1 about B, 0 at rest.  a_g : base acceleration [m/s2].
    Source: Eq. (8) and (A.1); at rest theta'' = 0 and the spring acts as k_C u1.
    """
    u1, u2, v1, v2, theta, omega = x[0], x[1], x[2], x[3], x[4], x[5]
    force = -p[K_C] * u1
    angular = 0.0
    if sg != 0.0:
        s, c, half = sin(theta), cos(theta), sin(0.5 * theta)
        versine = 2.0 * half * half
        corner = 0.0 if sg > 0.0 else 2.0 * p[B]
        excess = corner * versine - p[H1] * s - u1
        dx, dy = p[D] + excess, -p[H1] * versine - corner * s
        length = sqrt(dx * dx + dy * dy)
        q = (2.0 * p[D] * excess + excess * excess + dy * dy) / (length * (length + p[D]))
        arm = ((corner + p[D]) * corner + p[H1] * p[H1]) * s - p[H1] * p[D] * c + u1 * (p[H1] * c - corner * s)
        force = p[K_C] * q * dx
        weight = p[GRAVITY] * (p[H_B] * s - sg * p[B] * c) + a_g * (p[H_B] * c + sg * p[B] * s)
        angular = (p[MASS] * weight - p[K_C] * q * arm) / p[INERTIA]
    out[0], out[1], out[4] = v1, v2, omega
    out[2] = (-(p[C1] + p[C2]) * v1 + p[C2] * v2 - (p[K1] + p[K2]) * u1 + p[K2] * u2 + force) / p[M1] - a_g
    out[3] = (p[C2] * (v1 - v2) + p[K2] * (u1 - u2)) / p[M2] - a_g
    out[5] = angular


@compiled("float64(float64[::1], float64, float64[::1])")
def energy(p: NDArray[np.float64], sg: float, x: NDArray[np.float64]) -> float:
    """Kinetic and potential energy [J] relative to the ground; 0 at rest. Source: Eq. (3) and (5).

    p, sg and x are those of `rates`.
    """
    u1, u2, v1, v2, theta, omega = x[0], x[1], x[2], x[3], x[4], x[5]
    half = sin(0.5 * theta)
    versine, s = 2.0 * half * half, sin(theta)
    corner = 0.0 if sg >= 0.0 else 2.0 * p[B]
    excess = corner * versine - p[H1] * s - u1
    dx, dy = p[D] + excess, -p[H1] * versine - corner * s
    stretch = (2.0 * p[D] * excess + excess * excess + dy * dy) / (sqrt(dx * dx + dy * dy) + p[D])
    kinetic = p[M1] * v1 * v1 + p[M2] * v2 * v2 + p[INERTIA] * omega * omega
    springs = p[K1] * u1 * u1 + p[K2] * (u2 - u1) * (u2 - u1) + p[K_C] * stretch * stretch
    return 0.5 * (kinetic + springs) + p[MASS] * p[GRAVITY] * (sg * p[B] * s - p[H_B] * versine)
