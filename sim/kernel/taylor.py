"""Taylor coefficients of the motion and of its excitation at one instant, and evaluation of the polynomials.

Coefficient k of x(t0 + t) = sum x_k t^k follows from the lower ones through the equations of motion: products are
convolutions, sines and roots have recurrences (Jorba and Zou, 2005). Rows of `c` are u1, u2, v1, v2, theta, omega.

Every function applies to one member or, if its arrays have an additional last axis of length `sim.kernel.lanes.LANES`,
to that number of members at once. The docstrings give the shapes for one member.
"""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import generic
from sim.kernel.lanes import cosine, fma, get, get2, greater, magnitude, put, put2, root, sine, some, zero
from sim.kernel.packing import C1, C2, GRAVITY, H1, H_B, INERTIA, K1, K2, K_C, M1, M2, MASS, B, D

WORK_ROWS = 8
"""Rows of scratch space that `rocking_coefficients` needs."""


@generic
def forcing_coefficients(row: NDArray[np.float64], t: float, a: NDArray[np.float64], n: int) -> None:
    """Write coefficients 0..n of the base acceleration, at time `t` of a packed segment `row`, to `a`.

    With S = sin(phi), C = cos(phi) and phi' = omega + kappa t: (k+1) S_{k+1} = omega C_k + kappa C_{k-1}, and
    likewise for C. The amplitude is a cubic, so that its product with the sine has four terms.
    """
    nothing = zero(row)
    for k in range(n + 1):
        put(a, k, nothing)
    bent = some(get(row, 2)) or some(get(row, 3)) or some(get(row, 4))
    if bent or some(get(row, 1)):
        kappa = get(row, 7)
        omega, phase = get(row, 6) + kappa * t, get(row, 5) + t * (get(row, 6) + 0.5 * kappa * t)
        # the cubic, expanded at t
        p0 = get(row, 1) + t * (get(row, 2) + t * (get(row, 3) + t * get(row, 4)))
        p1 = get(row, 2) + t * (2.0 * get(row, 3) + 3.0 * t * get(row, 4))
        p2, p3 = get(row, 3) + 3.0 * t * get(row, 4), get(row, 4)
        s, c = sine(phase), cosine(phase)
        s_1 = s_2 = s_3 = c_1 = nothing
        for k in range(n + 1):
            value = p0 * s
            if bent:
                value = fma(p1, s_1, fma(p2, s_2, fma(p3, s_3, value)))
            put(a, k, value)
            inverse = 1.0 / (k + 1)
            up, down = fma(omega, c, kappa * c_1) * inverse, fma(omega, s, kappa * s_1) * -inverse
            s_3, s_2, s_1, c_1 = s_2, s_1, s, c
            s, c = up, down
    put(a, 0, get(a, 0) + (get(row, 8) + t * get(row, 9)))
    put(a, 1, get(a, 1) + get(row, 9))


@generic
def resting_coefficients(p: NDArray[np.float64], a: NDArray[np.float64], c: NDArray[np.float64], n: int) -> None:
    """Write coefficients 1..n of the linear frame, while the block rests, to `c`, whose column 0 is the state.

    The spring force is k_C u1 (k_C = 0 for the bare frame); theta and omega are zero.
    """
    k2, c2, nothing = get(p, K2), get(p, C2), zero(p)
    inverse_1, inverse_2 = 1.0 / get(p, M1), 1.0 / get(p, M2)
    damping, coupling = -(get(p, C1) + c2) * inverse_1, c2 * inverse_1
    stiffness, shear = -(get(p, K1) + k2 + get(p, K_C)) * inverse_1, k2 * inverse_1
    damping_2, stiffness_2 = c2 * inverse_2, k2 * inverse_2
    u1, u2, v1, v2 = get2(c, 0, 0), get2(c, 1, 0), get2(c, 2, 0), get2(c, 3, 0)
    for k in range(n):
        inverse = 1.0 / (k + 1)
        pull = fma(damping, v1, fma(coupling, v2, fma(stiffness, u1, fma(shear, u2, -get(a, k)))))
        pull_2 = fma(damping_2, v1 - v2, fma(stiffness_2, u1 - u2, -get(a, k)))
        u1, u2, v1, v2 = v1 * inverse, v2 * inverse, pull * inverse, pull_2 * inverse
        put2(c, 0, k + 1, u1)
        put2(c, 1, k + 1, u2)
        put2(c, 2, k + 1, v1)
        put2(c, 3, k + 1, v2)
        put2(c, 4, k + 1, nothing)
        put2(c, 5, k + 1, nothing)


@generic
def rocking_coefficients(
    p: NDArray[np.float64],
    sg: float,
    a: NDArray[np.float64],
    c: NDArray[np.float64],
    w: NDArray[np.float64],
    n: int,
) -> None:
    """Write coefficients 1..n of the rocking motion about one corner to `c`, whose column 0 is the state.

    Source: Eq. (8) (sg = +1) and (A.1) (sg = -1) in the form of `sim.kernel.equations`. `w` is scratch space of
    WORK_ROWS rows. There are seven and a half convolutions with a spring, and three without.

    With X = dx + u1, L^2 = X^2 + dy^2 - u1 (2 X - u1), and X^2 + dy^2 = const - 2 R cos - 2 h1 d sin has no products.
    L L = L^2, L e = dx and L g = G give e = dx / L and g = G / L, so that q dx = dx - d e and q G = G - d g; only
    coefficient 0 of these suffers from cancellation, and is computed as in `equations`.
    """
    h1, d, b, h_b, nothing = get(p, H1), get(p, D), get(p, B), get(p, H_B), zero(p)
    k1, k2, c2, k_c = get(p, K1), get(p, K2), get(p, C2), get(p, K_C)
    inverse_1, inverse_2, inverse_j = 1.0 / get(p, M1), 1.0 / get(p, M2), 1.0 / get(p, INERTIA)
    inertial = get(p, MASS) * inverse_j
    weight, spring = inertial * get(p, GRAVITY), -k_c * inverse_j
    damping, stiffness = -(get(p, C1) + c2), -(k1 + k2)
    corner, side = (1.0 - sg) * b, sg * b
    radius, reach, elastic = (corner + d) * corner + h1 * h1, h1 * d, some(k_c)
    u1, theta = get2(c, 0, 0), get2(c, 4, 0)
    half = sine(0.5 * theta)
    versine = 2.0 * half * half
    s, cs = sine(theta), cosine(theta)
    swing = h_b * cs + side * s
    # rows of w: 0 sin, 1 cos, 2 u1 - 2 X, 3 h1 cos - corner sin, 4 L, 5 dx / L, 6 G / L, 7 h_b cos + sg b sin
    put2(w, 0, 0, s)
    put2(w, 1, 0, cs)
    put2(w, 7, 0, swing)
    force = moment = shorten = nothing
    if elastic:
        beyond = corner * versine - h1 * s
        excess, lever = beyond - u1, h1 * cs - corner * s
        dx, dy = d + excess, -h1 * versine - corner * s
        length = root(dx * dx + dy * dy)
        shorten = 1.0 / length
        q = (2.0 * d * excess + excess * excess + dy * dy) / (length * (length + d))
        arm = radius * s - reach * cs + u1 * lever
        put2(w, 2, 0, u1 - 2.0 * (d + beyond))
        put2(w, 3, 0, lever)
        put2(w, 4, 0, length)
        put2(w, 5, 0, dx * shorten)
        put2(w, 6, 0, arm * shorten)
        force, moment = q * dx, q * arm
    pushed = get(a, 0) * swing
    for k in range(n):
        if k > 0:
            s = cs = pushed = square = arm = lengths = e = g = nothing
            if elastic:
                # one loop for all sums: with a loop for each sum, each addition would wait for the previous one
                for j in range(1, k):
                    omega, u, length = get2(c, 5, j), get2(c, 0, j), get2(w, 4, j)
                    s = fma(omega, get2(w, 1, k - 1 - j), s)
                    cs = fma(omega, get2(w, 0, k - 1 - j), cs)
                    pushed = fma(get(a, j), get2(w, 7, k - j), pushed)
                    square = fma(u, get2(w, 2, k - j), square)
                    arm = fma(u, get2(w, 3, k - j), arm)
                    lengths = fma(length, get2(w, 4, k - j), lengths)
                    e = fma(length, get2(w, 5, k - j), e)
                    g = fma(length, get2(w, 6, k - j), g)
            else:
                for j in range(1, k):
                    s = fma(get2(c, 5, j), get2(w, 1, k - 1 - j), s)
                    cs = fma(get2(c, 5, j), get2(w, 0, k - 1 - j), cs)
                    pushed = fma(get(a, j), get2(w, 7, k - j), pushed)
            omega, inverse = get2(c, 5, 0), 1.0 / k
            s, cs = fma(omega, get2(w, 1, k - 1), s) * inverse, fma(omega, get2(w, 0, k - 1), cs) * -inverse
            swing = fma(h_b, cs, side * s)
            pushed = fma(get(a, 0), swing, fma(get(a, k), get2(w, 7, 0), pushed))
            put2(w, 0, k, s)
            put2(w, 1, k, cs)
            put2(w, 7, k, swing)
            if elastic:
                u = get2(c, 0, k)
                beyond, lever = -fma(corner, cs, h1 * s), fma(h1, cs, -corner * s)
                product = u - 2.0 * beyond
                square = fma(u1, product, fma(u, get2(w, 2, 0), square)) - 2.0 * fma(radius, cs, reach * s)
                arm = fma(radius, s, fma(-reach, cs, fma(u1, lever, fma(u, get2(w, 3, 0), arm))))
                length = 0.5 * (square - lengths) * shorten
                dx = beyond - u
                e = (dx - fma(length, get2(w, 5, 0), e)) * shorten
                g = (arm - fma(length, get2(w, 6, 0), g)) * shorten
                put2(w, 2, k, product)
                put2(w, 3, k, lever)
                put2(w, 4, k, length)
                put2(w, 5, k, e)
                put2(w, 6, k, g)
                force, moment = fma(-d, e, dx), fma(-d, g, arm)
        v1, v2, shear, inverse = get2(c, 2, k), get2(c, 3, k), get2(c, 0, k) - get2(c, 1, k), 1.0 / (k + 1)
        put2(c, 0, k + 1, v1 * inverse)
        put2(c, 1, k + 1, v2 * inverse)
        put2(c, 4, k + 1, get2(c, 5, k) * inverse)
        frame = fma(damping, v1, fma(c2, v2, fma(stiffness, get2(c, 0, k), k2 * get2(c, 1, k))))
        put2(c, 2, k + 1, fma(fma(k_c, force, frame), inverse_1, -get(a, k)) * inverse)
        put2(c, 3, k + 1, fma(fma(c2, v1 - v2, k2 * shear), inverse_2, -get(a, k)) * inverse)
        gravity = weight * fma(h_b, s, -side * cs)
        put2(c, 5, k + 1, fma(spring, moment, fma(inertial, pushed, gravity)) * inverse)


@generic
def state_at(c: NDArray[np.float64], n: int, t: float, out: NDArray[np.float64]) -> None:
    """Write the values of the six polynomials at time `t` of the step to `out`, shape (6,); also for many members."""
    # six interleaved sums: if computed separately, each addition would wait for the previous one
    u1, u2, v1, v2 = get2(c, 0, n), get2(c, 1, n), get2(c, 2, n), get2(c, 3, n)
    theta, omega = get2(c, 4, n), get2(c, 5, n)
    for k in range(n - 1, -1, -1):
        u1, u2 = fma(u1, t, get2(c, 0, k)), fma(u2, t, get2(c, 1, k))
        v1, v2 = fma(v1, t, get2(c, 2, k)), fma(v2, t, get2(c, 3, k))
        theta, omega = fma(theta, t, get2(c, 4, k)), fma(omega, t, get2(c, 5, k))
    put(out, 0, u1)
    put(out, 1, u2)
    put(out, 2, v1)
    put(out, 3, v2)
    put(out, 4, theta)
    put(out, 5, omega)


@generic
def bends(c: NDArray[np.float64], n: int, h: float, out: NDArray[np.float64]) -> None:
    """Write bounds of |u1''|, |u2'' - u1''| and |theta''| over a step of length `h` to `out`, shape (3,)."""
    bend_1 = bend_2 = bend_3 = zero(out)
    for k in range(n, 1, -1):
        factor = float(k * (k - 1))
        bend_1 = fma(bend_1, h, factor * magnitude(get2(c, 0, k)))
        bend_2 = fma(bend_2, h, factor * magnitude(get2(c, 1, k) - get2(c, 0, k)))
        bend_3 = fma(bend_3, h, factor * magnitude(get2(c, 4, k)))
    put(out, 0, bend_1)
    put(out, 1, bend_2)
    put(out, 2, bend_3)


@generic
def limits(c: NDArray[np.float64], n: int, h: float, following: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """Write upper limits of |u1|, |u2 - u1| and |theta| over a step of length `h` to `out`, shape (3,).

    following : the state at `h`, shape (6,).
    """
    bends(c, n, h, out)
    part = 0.125 * h * h
    drift, after = get2(c, 1, 0) - get2(c, 0, 0), get(following, 1) - get(following, 0)
    put(out, 0, greater(magnitude(get2(c, 0, 0)), magnitude(get(following, 0))) + part * get(out, 0))
    put(out, 1, greater(magnitude(drift), magnitude(after)) + part * get(out, 1))
    put(out, 2, greater(magnitude(get2(c, 4, 0)), magnitude(get(following, 4))) + part * get(out, 2))


@generic
def last_terms(c: NDArray[np.float64], n: int, reach: float) -> tuple[float, float]:
    """Coefficients n - 1 and n of the velocities, each combined as (|v1| + |v2|) / reach + |omega|."""
    before = (magnitude(get2(c, 2, n - 1)) + magnitude(get2(c, 3, n - 1))) / reach + magnitude(get2(c, 5, n - 1))
    last = (magnitude(get2(c, 2, n)) + magnitude(get2(c, 3, n))) / reach + magnitude(get2(c, 5, n))
    return before, last


@generic
def tail(c: NDArray[np.float64], n: int, h: float, out: NDArray[np.float64]) -> None:
    """Write the sum of |theta_k| h^(k - 5) for k = 5..n to `out`, shape (1,)."""
    total = magnitude(get2(c, 4, n))
    for k in range(n - 1, 4, -1):
        total = fma(total, h, magnitude(get2(c, 4, k)))
    put(out, 0, total)
