"""Taylor coefficients of the motion and of its excitation at one instant.

Coefficient k of x(t0 + t) = sum x_k t^k follows from the lower ones through the equations of motion: products are
convolutions, sines and powers have recurrences (Jorba and Zou, 2005). Rows of `c` are u1, u2, v1, v2, theta, omega.
"""

from math import cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled
from sim.kernel.packing import C1, C2, GRAVITY, H1, H_B, INERTIA, K1, K2, K_C, M1, M2, MASS, B, D

WORK_ROWS = 9
"""Rows of scratch space that `rocking_coefficients` needs."""


@compiled("void(float64[::1], float64, float64[::1], float64[:,::1], int64)")
def forcing_coefficients(
    row: NDArray[np.float64], t: float, a: NDArray[np.float64], w: NDArray[np.float64], n: int
) -> None:
    """Coefficients 0..n of the base acceleration at time `t` of a packed segment `row`, written to `a`.

    With S = sin(phi), C = cos(phi) and phi' = omega + kappa t: (k+1) S_{k+1} = omega C_k + kappa C_{k-1}, and
    likewise for C; the amplitude is a cubic, so the product has four terms. `w` is scratch space of two rows.
    """
    for k in range(n + 1):
        a[k] = 0.0
    if row[1] != 0.0 or row[2] != 0.0 or row[3] != 0.0 or row[4] != 0.0:
        phase = row[5] + t * (row[6] + 0.5 * row[7] * t)
        omega, kappa = row[6] + row[7] * t, row[7]
        w[0, 0], w[1, 0] = sin(phase), cos(phase)
        for k in range(n):
            up, down = omega * w[1, k], omega * w[0, k]
            if k > 0:
                up += kappa * w[1, k - 1]
                down += kappa * w[0, k - 1]
            w[0, k + 1], w[1, k + 1] = up / (k + 1), -down / (k + 1)
        # the cubic, moved to its value and derivatives at t
        p0 = row[1] + t * (row[2] + t * (row[3] + t * row[4]))
        p1 = row[2] + t * (2.0 * row[3] + 3.0 * t * row[4])
        p2, p3 = row[3] + 3.0 * t * row[4], row[4]
        for k in range(n + 1):
            a[k] = p0 * w[0, k]
        if p1 != 0.0 or p2 != 0.0 or p3 != 0.0:
            for k in range(1, n + 1):
                a[k] += p1 * w[0, k - 1]
            for k in range(2, n + 1):
                a[k] += p2 * w[0, k - 2]
            for k in range(3, n + 1):
                a[k] += p3 * w[0, k - 3]
    a[0] += row[8] + t * row[9]
    a[1] += row[9]


@compiled("void(float64[::1], float64[::1], float64[:,::1], int64)")
def resting_coefficients(p: NDArray[np.float64], a: NDArray[np.float64], c: NDArray[np.float64], n: int) -> None:
    """Coefficients 1..n of the linear frame while the block rests; column 0 of `c` is the state.

    The spring acts as k_C u1 (k_C = 0 for the bare frame); theta and omega are zero.
    """
    damping, coupling = -(p[C1] + p[C2]) / p[M1], p[C2] / p[M1]
    stiffness, shear = -(p[K1] + p[K2] + p[K_C]) / p[M1], p[K2] / p[M1]
    damping_2, stiffness_2 = p[C2] / p[M2], p[K2] / p[M2]
    for k in range(n):
        u1, u2, v1, v2 = c[0, k], c[1, k], c[2, k], c[3, k]
        inverse = 1.0 / (k + 1)
        c[0, k + 1] = v1 * inverse
        c[1, k + 1] = v2 * inverse
        c[2, k + 1] = (damping * v1 + coupling * v2 + stiffness * u1 + shear * u2 - a[k]) * inverse
        c[3, k + 1] = (damping_2 * (v1 - v2) + stiffness_2 * (u1 - u2) - a[k]) * inverse
        c[4, k + 1] = 0.0
        c[5, k + 1] = 0.0


@compiled("void(float64[::1], float64, float64[::1], float64[:,::1], float64[:,::1], int64)")
def rocking_coefficients(
    p: NDArray[np.float64],
    sg: float,
    a: NDArray[np.float64],
    c: NDArray[np.float64],
    w: NDArray[np.float64],
    n: int,
) -> None:
    """Coefficients 1..n of the rocking motion about one corner; column 0 of `c` is the state.

    Source: Eq. (8) (sg = +1) and (A.1) (sg = -1) in the form of `sim.kernel.equations`. `w` is scratch space of
    WORK_ROWS rows. Eight convolutions with a spring, three without: the block alone never pays for it.
    """
    h1, d, k_c, b, h_b = p[H1], p[D], p[K_C], p[B], p[H_B]
    m1, m2, c1, c2, k1, k2 = p[M1], p[M2], p[C1], p[C2], p[K1], p[K2]
    weight, inertial, spring = p[MASS] * p[GRAVITY] / p[INERTIA], p[MASS] / p[INERTIA], k_c / p[INERTIA]
    corner = 0.0 if sg > 0.0 else 2.0 * b
    radius = (corner + d) * corner + h1 * h1
    theta = c[4, 0]
    half = sin(0.5 * theta)
    versine = 2.0 * half * half
    # rows of w: 0 sin, 1 cos, 2 dx, 3 dy, 4 L^2, 5 1/L, 6 q, 7 G, 8 h_b cos + sg b sin
    w[0, 0], w[1, 0] = sin(theta), cos(theta)
    w[8, 0] = h_b * w[1, 0] + sg * b * w[0, 0]
    force = moment = 0.0
    if k_c != 0.0:
        excess = corner * versine - h1 * w[0, 0] - c[0, 0]
        w[2, 0], w[3, 0] = d + excess, -h1 * versine - corner * w[0, 0]
        w[4, 0] = w[2, 0] * w[2, 0] + w[3, 0] * w[3, 0]
        length = sqrt(w[4, 0])
        w[5, 0] = 1.0 / length
        w[6, 0] = (2.0 * d * excess + excess * excess + w[3, 0] * w[3, 0]) / (length * (length + d))
        w[7, 0] = radius * w[0, 0] - h1 * d * w[1, 0] + c[0, 0] * (h1 * w[1, 0] - corner * w[0, 0])
        force, moment = w[6, 0] * w[2, 0], w[6, 0] * w[7, 0]
    pushed = a[0] * w[8, 0]
    for k in range(n):
        if k > 0:
            sine = cosine = pushed = 0.0
            for j in range(k):
                sine += c[5, j] * w[1, k - 1 - j]
                cosine += c[5, j] * w[0, k - 1 - j]
                pushed += a[j + 1] * w[8, k - 1 - j]
            w[0, k], w[1, k] = sine / k, -cosine / k
            w[8, k] = h_b * w[1, k] + sg * b * w[0, k]
            pushed += a[0] * w[8, k]
            if k_c != 0.0:
                w[2, k] = -corner * w[1, k] - h1 * w[0, k] - c[0, k]
                w[3, k] = h1 * w[1, k] - corner * w[0, k]
                squares = lever = 0.0
                for j in range(k + 1):
                    squares += w[2, j] * w[2, k - j] + w[3, j] * w[3, k - j]
                    lever += c[0, j] * w[3, k - j]
                w[4, k] = squares
                w[7, k] = radius * w[0, k] - h1 * d * w[1, k] + h1 * c[0, k] + lever
                inverse_length = 0.0
                for j in range(1, k + 1):
                    inverse_length += (0.5 * j - k) * w[4, j] * w[5, k - j]
                w[5, k] = inverse_length / (k * w[4, 0])
                w[6, k] = -d * w[5, k]
                force = moment = 0.0
                for j in range(k + 1):
                    force += w[6, j] * w[2, k - j]
                    moment += w[6, j] * w[7, k - j]
        u1, u2, v1, v2 = c[0, k], c[1, k], c[2, k], c[3, k]
        inverse = 1.0 / (k + 1)
        c[0, k + 1] = v1 * inverse
        c[1, k + 1] = v2 * inverse
        c[4, k + 1] = c[5, k] * inverse
        pull = -(c1 + c2) * v1 + c2 * v2 - (k1 + k2) * u1 + k2 * u2 + k_c * force
        c[2, k + 1] = (pull / m1 - a[k]) * inverse
        c[3, k + 1] = ((c2 * (v1 - v2) + k2 * (u1 - u2)) / m2 - a[k]) * inverse
        gravity = weight * (h_b * w[0, k] - sg * b * w[1, k])
        c[5, k + 1] = (gravity + inertial * pushed - spring * moment) * inverse
