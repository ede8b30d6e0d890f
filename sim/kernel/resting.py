"""Exact integration step of the frame while the block rests, with a proof that no event occurs within the step.

At rest everything is linear. With y = [u1, u2, v1, v2, a_g, a_g'] and a linear base acceleration,
y' = A y, so a step of length h is y(h) = exp(A h) y(0): [Phi | Gamma0 | Gamma1] are the first four rows (Van Loan,
1978; Nigam and Jennings, 1969). The matrix is computed once per length.

A quantity f y stays within h^2 / 8 max |f y''| of the chord between its end values, and
|f y''| <= |f A^2| exp(|A| h) |y(0)| elementwise. Thus six products bound the moment, a peak or a velocity over the
whole step.
"""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled
from sim.kernel.packing import C1, C2, COUPLED, GRAVITY, H1, H_B, K1, K2, K_C, M1, M2, MASS, B

TABLE_ROWS = 9
"""Rows of a propagator: u1, u2, v1, v2, then bounds of the moment, u1, the drift, and the rates of u1 and drift."""

SPACE = 9, 6, 6
"""Shape of the scratch space of `propagator`."""

_A, _EXPONENTIAL, _TERM, _PRODUCT, _WATCHED, _BEND = 0, 2, 4, 6, 7, 8
"""First indices in the scratch space: the matrix, its exponential and a term of its series, each followed by that of
the magnitudes, a product of matrices, the watched quantities, and their second derivatives.
"""

MUST_STEP, GLIDED, LOOK_INSIDE, ANOTHER_KIND = range(4)
"""Results of `glide`: the block may lift in the segment; all segments are taken; the block does not lift, but a peak
may be inside the segment; the segment is a sine or has another length.
"""


@compiled("void(float64[::1], float64, int64, float64, float64[:,::1], float64[:,:,::1])", internal=True)
def propagator(
    p: NDArray[np.float64],
    h: float,
    n: int,
    tolerance: float,
    table: NDArray[np.float64],
    space: NDArray[np.float64],
) -> None:
    """Write the exact step of length `h` [s] and its bounds to `table`, shape (TABLE_ROWS, 6).

    The first element, which is otherwise positive, is 0 if the table cannot be used, because a Taylor polynomial of
    order `n`, needed for the peaks within the step, does not reach `tolerance`. `space` is scratch space.
    """
    # plain loops: array expressions would add seconds of compilation
    for k in range(9):
        for i in range(6):
            for j in range(6):
                space[k, i, j] = 0.0
    linear, watched, bend = space[_A], space[_WATCHED], space[_BEND]
    linear[0, 2] = linear[1, 3] = linear[4, 5] = 1.0
    linear[2, 0], linear[2, 1] = -(p[K1] + p[K2] + p[K_C]) / p[M1], p[K2] / p[M1]
    linear[2, 2], linear[2, 3] = -(p[C1] + p[C2]) / p[M1], p[C2] / p[M1]
    linear[3, 0], linear[3, 1] = p[K2] / p[M2], -p[K2] / p[M2]
    linear[3, 2], linear[3, 3] = p[C2] / p[M2], -p[C2] / p[M2]
    linear[2, 4] = linear[3, 4] = -1.0
    stiffness = max(linear[2, 1] - linear[2, 0], linear[3, 0] - linear[3, 1])
    damping = max(linear[2, 3] - linear[2, 2], linear[3, 2] - linear[3, 3])
    reach = h * (np.sqrt(stiffness) + damping)
    truncated = 1.0
    for k in range(1, n):
        truncated *= reach / k
    if not (reach <= 1.0 and truncated <= tolerance):
        table[0, 0] = 0.0
        return
    # exp(A h) and exp(|A| h) by their series: 1 / 25! is far below rounding
    for i in range(6):
        for k in range(_EXPONENTIAL, _PRODUCT):
            space[k, i, i] = 1.0
        for j in range(6):
            space[_A + 1, i, j] = abs(linear[i, j])
    for k in range(1, 26):
        for which in range(2):
            for i in range(6):
                for j in range(6):
                    total = 0.0
                    for m in range(6):
                        total += space[_TERM + which, i, m] * space[_A + which, m, j]
                    space[_PRODUCT, i, j] = total * h / k
            for i in range(6):
                for j in range(6):
                    space[_TERM + which, i, j] = space[_PRODUCT, i, j]
                    space[_EXPONENTIAL + which, i, j] += space[_PRODUCT, i, j]
    watched[0, 0], watched[0, 4] = -p[K_C] * p[H1], p[H_B] * p[MASS]
    watched[1, 0] = watched[2, 1] = watched[3, 2] = watched[4, 3] = 1.0
    watched[2, 0] = watched[4, 2] = -1.0
    for i in range(5):
        for j in range(6):
            for m in range(6):
                for k in range(6):
                    bend[i, j] += watched[i, m] * linear[m, k] * linear[k, j]
        for j in range(6):
            table[4 + i, j] = 0.0
            if i < 4:
                table[i, j] = space[_EXPONENTIAL, i, j]
            for k in range(6):
                table[4 + i, j] += 0.125 * h * h * abs(bend[i, k]) * space[_EXPONENTIAL + 1, k, j]


@compiled(
    "Tuple((int64, int64))(float64[::1], float64[:,::1], float64[:,::1], int64, float64[::1], float64, float64,"
    " float64[::1], float64[::1], float64[::1], float64[:,::1], int64)",
    internal=True,
)
def glide(
    p: NDArray[np.float64],
    table: NDArray[np.float64],
    segments: NDArray[np.float64],
    i: int,
    x: NDArray[np.float64],
    until: float,
    peaks_from: float,
    peaks: NDArray[np.float64],
    clock: NDArray[np.float64],
    following: NDArray[np.float64],
    samples: NDArray[np.float64],
    filled: int,
) -> tuple[int, int]:
    """Apply the exact step of `table` to segment `i` and the following ones, until one needs closer inspection.

    Returns the index of that segment, which is not taken, and the reason. `x`, shape (6,), is then the state at its
    start, and `following` the exact state at its end. If all segments were taken, returns their number and GLIDED.
    until : time [s] of the next sample; the segment that contains it is not taken, because the caller takes the sample.
    peaks : peaks of |u1| and |u2 - u1| from `peaks_from` [s] on, raised if the ends of a segment suffice because the
    motion between them is proved to be monotone.
    samples, filled : the state after each segment taken is written to `samples`, shape (m, 6), from row `filled` to the
    last row.
    clock : shape (2,), start of the segment [s] and its rounding error, updated like `x` and `peaks`.
    """
    h, coupled, holding = segments[i, 0], p[COUPLED] != 0.0, p[B] * p[GRAVITY] * p[MASS]
    forth, back = p[H_B] * p[MASS], p[K_C] * p[H1]
    u1, u2, v1, v2 = x[0], x[1], x[2], x[3]
    begin, lost = clock[0], clock[1]
    most_1, most_2 = peaks[0], peaks[1]
    found = GLIDED
    count, room = segments.shape[0], samples.shape[0]
    while i < count:
        a_g, slope = segments[i, 8], segments[i, 9]
        sine = segments[i, 1] != 0.0 or segments[i, 2] != 0.0 or segments[i, 3] != 0.0 or segments[i, 4] != 0.0
        if segments[i, 0] != h or sine:
            found = ANOTHER_KIND
            break
        n1 = (table[0, 0] * u1 + table[0, 1] * u2) + (table[0, 2] * v1 + table[0, 3] * v2)
        n1 += table[0, 4] * a_g + table[0, 5] * slope
        n2 = (table[1, 0] * u1 + table[1, 1] * u2) + (table[1, 2] * v1 + table[1, 3] * v2)
        n2 += table[1, 4] * a_g + table[1, 5] * slope
        n3 = (table[2, 0] * u1 + table[2, 1] * u2) + (table[2, 2] * v1 + table[2, 3] * v2)
        n3 += table[2, 4] * a_g + table[2, 5] * slope
        n4 = (table[3, 0] * u1 + table[3, 1] * u2) + (table[3, 2] * v1 + table[3, 3] * v2)
        n4 += table[3, 4] * a_g + table[3, 5] * slope
        gained = h - lost
        end = begin + gained
        s1, s2, s3, s4, s5, s6 = abs(u1), abs(u2), abs(v1), abs(v2), abs(a_g), abs(slope)
        if coupled:
            most = max(abs(forth * a_g - back * u1), abs(forth * (a_g + slope * h) - back * n1))
            most += (table[4, 0] * s1 + table[4, 1] * s2) + (table[4, 2] * s3 + table[4, 3] * s4)
            most += table[4, 4] * s5 + table[4, 5] * s6
            if not most <= holding:
                found = MUST_STEP
        elif not abs(n1) + abs(n2) + abs(n3) + abs(n4) < np.inf:
            found = MUST_STEP
        if found == GLIDED and end > peaks_from:
            most = max(s1, abs(n1))
            bound = (table[5, 0] * s1 + table[5, 1] * s2) + (table[5, 2] * s3 + table[5, 3] * s4)
            bound += table[5, 4] * s5 + table[5, 5] * s6
            if most + bound > most_1:
                bound = (table[7, 0] * s1 + table[7, 1] * s2) + (table[7, 2] * s3 + table[7, 3] * s4)
                bound += table[7, 4] * s5 + table[7, 5] * s6
                if v1 * n3 > 0.0 and min(s3, abs(n3)) > bound:
                    most_1 = max(most_1, most)
                else:
                    found = LOOK_INSIDE
            most = max(abs(u2 - u1), abs(n2 - n1))
            bound = (table[6, 0] * s1 + table[6, 1] * s2) + (table[6, 2] * s3 + table[6, 3] * s4)
            bound += table[6, 4] * s5 + table[6, 5] * s6
            if most + bound > most_2:
                bound = (table[8, 0] * s1 + table[8, 1] * s2) + (table[8, 2] * s3 + table[8, 3] * s4)
                bound += table[8, 4] * s5 + table[8, 5] * s6
                if (v2 - v1) * (n4 - n3) > 0.0 and min(abs(v2 - v1), abs(n4 - n3)) > bound:
                    most_2 = max(most_2, most)
                else:
                    found = LOOK_INSIDE
            if begin < peaks_from:
                found = LOOK_INSIDE
        if found != GLIDED or not end < until:
            following[0], following[1], following[2], following[3] = n1, n2, n3, n4
            break
        u1, u2, v1, v2 = n1, n2, n3, n4
        lost = (end - begin) - gained
        begin = end
        i += 1
        if filled < room:
            samples[filled, 0], samples[filled, 1], samples[filled, 2], samples[filled, 3] = n1, n2, n3, n4
            samples[filled, 4] = samples[filled, 5] = 0.0
            filled += 1
    x[0], x[1], x[2], x[3] = u1, u2, v1, v2
    clock[0], clock[1] = begin, lost
    peaks[0], peaks[1] = most_1, most_2
    return i, found
