"""What is read off a step's polynomials: samples, peaks and the first event.

`c` holds the Taylor coefficients of u1, u2, v1, v2, theta, omega, shape (6, n + 1), `a` those of the base
acceleration; a step lasts from 0 to `h`. `e` is scratch space, shape (n + 1,).
"""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled
from sim.kernel.packing import COUPLED, GRAVITY, H1, H_B, K_C, MASS, B
from sim.kernel.roots import first_root, greatest_magnitude

NO_EVENT, IMPACT, OVERTURNING, UPLIFT = range(4)
"""What ends a step."""

UPLIFT_MARGIN = 1e-12
"""Relative excess of |m| over b g M that counts as uplift: rounding alone never lifts a block."""


@compiled("void(float64[:,::1], int64, float64, float64[::1])")
def state_at(c: NDArray[np.float64], n: int, t: float, out: NDArray[np.float64]) -> None:
    """The six polynomials at time `t` of the step, written to `out`, shape (6,)."""
    # six sums side by side: each alone would wait for its own last product
    u1 = u2 = v1 = v2 = theta = omega = 0.0
    for k in range(n, -1, -1):
        u1, u2 = u1 * t + c[0, k], u2 * t + c[1, k]
        v1, v2 = v1 * t + c[2, k], v2 * t + c[3, k]
        theta, omega = theta * t + c[4, k], omega * t + c[5, k]
    out[0], out[1], out[2], out[3], out[4], out[5] = u1, u2, v1, v2, theta, omega


@compiled("void(float64[:,::1], int64, float64, float64, boolean, float64[::1], float64[::1])")
def raise_peaks(
    c: NDArray[np.float64],
    n: int,
    start: float,
    h: float,
    rocking: bool,
    e: NDArray[np.float64],
    peaks: NDArray[np.float64],
) -> None:
    """Raise `peaks` = [|u1|, |u2 - u1|, |theta|], shape (3,), to the greatest values in [start, h]."""
    # most steps raise nothing: the three bounds together, and a polynomial on its own only where its bound says so
    most_1 = most_2 = most_3 = 0.0
    for k in range(n, -1, -1):
        most_1 = most_1 * h + abs(c[0, k])
        most_2 = most_2 * h + abs(c[1, k] - c[0, k])
        most_3 = most_3 * h + abs(c[4, k])
    if most_1 <= peaks[0] and most_2 <= peaks[1] and most_3 <= peaks[2]:
        return
    for which in range(3 if rocking else 2):
        if (most_1 if which == 0 else (most_2 if which == 1 else most_3)) > peaks[which]:
            for k in range(n + 1):
                e[k] = c[0, k] if which == 0 else (c[1, k] - c[0, k] if which == 1 else c[4, k])
            peaks[which] = greatest_magnitude(e, n, start, h, peaks[which])


@compiled(
    "Tuple((float64, int64, float64))(float64[::1], float64, float64[:,::1], float64[::1], int64, float64, int64,"
    " float64, float64[::1])"
)
def first_event(
    p: NDArray[np.float64],
    sg: float,
    c: NDArray[np.float64],
    a: NDArray[np.float64],
    n: int,
    h: float,
    known: int,
    theta_limit: float,
    e: NDArray[np.float64],
) -> tuple[float, int, float]:
    """Time, kind and direction (+1 to A, -1 to B; of an uplift) of the first event in [0, h]; NO_EVENT at h.

    known : how many roots theta = 0 of a rocking phase lie at the start of the step and are divided out.
    Source: uplift Eq. (9) and (A.3).
    """
    event, direction = NO_EVENT, 0.0
    if sg == 0.0 and p[COUPLED] == 0.0:
        return h, event, direction
    if sg != 0.0:
        # most steps hold no event: one bound for both, before anything is searched
        first, spread = sg * c[4, known], 0.0
        for k in range(n, known, -1):
            spread = (spread + abs(c[4, k])) * h
        if first > spread and (first + spread) * h**known < theta_limit:
            return h, event, direction
    for candidate in range(2):
        degree = n
        if sg == 0.0:
            side = 1.0 if candidate == 0 else -1.0
            for k in range(n + 1):
                e[k] = side * (p[K_C] * p[H1] * c[0, k] - p[H_B] * p[MASS] * a[k])
            e[0] += p[B] * p[GRAVITY] * p[MASS] * (1.0 + UPLIFT_MARGIN)
        elif candidate == 0:
            degree = n - known
            for k in range(degree + 1):
                e[k] = sg * c[4, k + known]
        else:
            for k in range(n + 1):
                e[k] = -sg * c[4, k]
            e[0] += theta_limit
        spread = 0.0
        for k in range(degree, 0, -1):
            spread = (spread + abs(e[k])) * h
        if e[0] > spread:
            continue
        t = first_root(e, degree, h)
        if t >= 0.0:
            h = t
            direction = 1.0 if candidate == 0 else -1.0
            event = UPLIFT if sg == 0.0 else (IMPACT if candidate == 0 else OVERTURNING)
    return h, event, direction
