"""Peaks and the first event of a step, from its polynomials.

`c`, shape (6, n + 1), contains the Taylor coefficients of u1, u2, v1, v2, theta, omega, and `a` those of the base
acceleration. A step lasts from 0 to `h`. `e` is scratch space, shape (n + 1,).
"""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled
from sim.kernel.lanes import fma
from sim.kernel.packing import COUPLED, GRAVITY, H1, H_B, K_C, MASS, B
from sim.kernel.roots import evaluate, first_root, greatest_magnitude
from sim.kernel.steps import PEAKS
from sim.kernel.taylor import bends

NO_EVENT, IMPACT, OVERTURNING, UPLIFT = range(4)
"""Endings of a step."""

UPLIFT_MARGIN = 1e-12
"""Relative excess of |m| over b g M that counts as uplift, so that rounding alone never lifts a block."""


@compiled(
    "void(float64[:,::1], int64, float64, float64, float64[::1], boolean, float64[::1], float64[::1])", internal=True
)
def raise_peaks(
    c: NDArray[np.float64],
    n: int,
    start: float,
    h: float,
    following: NDArray[np.float64],
    rocking: bool,
    e: NDArray[np.float64],
    report: NDArray[np.float64],
) -> None:
    """Update the peaks |u1|, |u2 - u1| and, if `rocking`, |theta| in the `report` of a run for the interval [start, h].

    following : the state at `h`, shape (6,).
    """
    bends(c, n, h, e)
    bend_1, bend_2, bend_3 = e[0], e[1], e[2]
    for which in range(3 if rocking else 2):
        if which == 0:
            bend, begin, end, slope, last = bend_1, c[0, 0], following[0], c[2, 0], following[2]
        elif which == 1:
            bend, begin, end = bend_2, c[1, 0] - c[0, 0], following[1] - following[0]
            slope, last = c[3, 0] - c[2, 0], following[3] - following[2]
        else:
            bend, begin, end, slope, last = bend_3, c[4, 0], following[4], c[5, 0], following[5]
        most, peak = max(abs(begin), abs(end)), report[PEAKS + which]
        if start == 0.0 and slope * last > 0.0 and abs(slope) + abs(last) > bend * h:
            # the slope has no zero, so that the largest value is at one of the ends
            report[PEAKS + which] = max(peak, most)
        # most steps raise no peak: the distance from the chord is at most h^2 / 8 times the largest second derivative
        elif most + 0.125 * h * h * bend > peak:
            for k in range(n + 1):
                e[k] = c[0, k] if which == 0 else (c[1, k] - c[0, k] if which == 1 else c[4, k])
            if start > 0.0:
                begin, slope, _ = evaluate(e, n, start)
            report[PEAKS + which] = greatest_magnitude(e, n, start, h, begin, slope, end, last, peak)


@compiled("float64(float64, float64, float64)", internal=True)
def least_of_parabola(first: float, line: float, bend: float) -> float:
    """Minimum of first + line s + bend s^2 for s in [0, 1]."""
    if bend > 0.0 and -2.0 * bend < line < 0.0:
        return first - 0.25 * line * line / bend
    return min(first, first + line + bend)


@compiled(
    "boolean(float64, float64, float64, float64, float64, float64, float64, float64, int64, float64)", internal=True
)
def is_clear(
    sg: float,
    theta_0: float,
    theta_1: float,
    theta_2: float,
    theta_3: float,
    theta_4: float,
    rest: float,
    h: float,
    known: int,
    theta_limit: float,
) -> bool:
    """Whether a bound proves that a step of a rocking block contains no event.

    The bound follows from the first five coefficients of theta and from `rest`, the `tail` of the others. After
    division by the known roots, the first three coefficients are a parabola, whose minimum is exact.
    """
    if known == 0:
        first, line, bend, rest = theta_0, theta_1, theta_2, fma(fma(rest, h, abs(theta_4)), h, abs(theta_3))
    elif known == 1:
        first, line, bend, rest = theta_1, theta_2, theta_3, fma(rest, h, abs(theta_4))
    else:
        first, line, bend = theta_2, theta_3, theta_4
    first, line, bend, rest = sg * first, sg * line * h, sg * bend * h * h, rest * h * h * h
    most = first + abs(line) + abs(bend) + rest
    for _ in range(known):
        most *= h
    return least_of_parabola(first, line, bend) > rest and most < theta_limit


@compiled(
    "Tuple((float64, int64, float64))(float64[::1], float64, float64[:,::1], float64[::1], int64, float64, int64,"
    " float64, float64[::1])",
    internal=True,
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
    """Time and kind of the first event in [0, h], and the direction of an uplift (+1 to A, -1 to B); h and NO_EVENT if
    there is none.

    known : number of roots theta = 0 of a rocking phase at the start of the step, which are divided out.
    Source of the uplift: Eq. (9) and (A.3).
    """
    event, direction = NO_EVENT, 0.0
    if sg == 0.0 and p[COUPLED] == 0.0:
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
        rest = 0.0
        for k in range(degree, 2, -1):
            rest = fma(rest, h, abs(e[k]))
        if least_of_parabola(e[0], e[1] * h, e[2] * h * h) > rest * h * h * h:
            continue
        t = first_root(e, degree, h)
        if t >= 0.0:
            h = t
            direction = 1.0 if candidate == 0 else -1.0
            event = UPLIFT if sg == 0.0 else (IMPACT if candidate == 0 else OVERTURNING)
    return h, event, direction
