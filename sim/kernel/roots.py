"""First root and greatest magnitude of a polynomial on an interval, by certified subdivision.

An interval is discarded only if a bound on the derivatives proves that it contains no root or extremum, and is searched
only if a bound proves that it contains exactly one. A short dip below zero therefore cannot be missed between samples.
"""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled

SMALLEST_PART, FLOOR_GROWTH = 1e-9, 1.1
"""Fraction of the interval below which a double root counts as a touch and is not subdivided further. The limit is
raised each time it is reached, which limits the work for polynomials with inconclusive bounds.
"""

ROUNDING, NOTHING = 2e-15, 1e-300
"""Rounding error of a polynomial relative to the sum of the magnitudes of its terms, and a value far below any motion,
which is needed because relative bounds fail for denormal numbers.
"""

CUBIC = 1e-15
"""Bound of a cubic term, relative to the value, below which a polynomial is a parabola up to its extremum."""


@compiled("Tuple((float64, float64, float64))(float64[::1], int64, float64)", internal=True)
def evaluate(p: NDArray[np.float64], n: int, t: float) -> tuple[float, float, float]:
    """Value, first derivative and half the second derivative of sum p_k t^k, k = 0..n (Horner)."""
    value = slope = half_bend = 0.0
    for k in range(n, -1, -1):
        half_bend = half_bend * t + slope
        slope = slope * t + value
        value = value * t + p[k]
    return value, slope, half_bend


@compiled("float64(float64[::1], int64, float64)", internal=True)
def first_root(p: NDArray[np.float64], n: int, h: float) -> float:
    """Smallest t in [0, h] at which sum p_k t^k, k = 0..n, is no longer positive; -1 if there is none."""
    if p[0] <= 0.0:
        return 0.0
    steepest = sharpest = 0.0
    for k in range(n, 0, -1):
        steepest = steepest * h + k * abs(p[k])
        if k > 1:
            sharpest = sharpest * h + k * (k - 1) * abs(p[k])
    left, right, t = 0.0, h, h
    width, floor = h, SMALLEST_PART * h
    while left < h:
        right = min(left + width, h)
        half = 0.5 * (right - left)
        t = left + half
        value, slope, _ = evaluate(p, n, t)
        if value <= steepest * half:  # else: positive throughout this part
            if abs(slope) <= sharpest * half:
                if width > floor:
                    width *= 0.5
                    continue
                floor *= FLOOR_GROWTH
            # monotone here (or negligible): the sign at the right end decides
            if evaluate(p, n, right)[0] <= 0.0:
                break
        left, width = right, 2.0 * width
    if left >= h:
        return -1.0
    for _ in range(100):
        value, slope, half_bend = evaluate(p, n, t)
        if value > 0.0:
            left = t
        else:
            right = t
        # Halley's step, which triples the number of correct digits; otherwise bisection
        trial = left
        if slope < 0.0:
            trial = t - value * slope / (slope * slope - value * half_bend)
            # relative to the root, not to the step, because errors of short phases accumulate over hundreds of bounces
            if abs(trial - t) <= 4e-16 * t:
                break
        inside = left < trial < right
        if not inside:
            trial = 0.5 * (left + right)
        moved, t = abs(trial - t), trial
        # the next Newton step would be of the order of the curvature times this step squared; the next Halley step is
        # far smaller
        if moved <= 4e-16 * t:
            break
        if inside and moved <= 1e-6 * t and abs(half_bend) * moved * moved <= 1e-13 * t * -slope:
            break
    return t


@compiled("float64(float64[::1], int64, float64, float64, float64, float64, float64, float64, float64)", internal=True)
def greatest_magnitude(
    p: NDArray[np.float64],
    n: int,
    start: float,
    h: float,
    begin: float,
    rise: float,
    end: float,
    fall: float,
    best: float,
) -> float:
    """Greater of `best` and the greatest |sum p_k t^k|, k = 0..n, for t in [start, h].

    begin, rise : value and first derivative at `start`.  end, fall : value and first derivative at `h`.
    """
    # the ends first: over a step that is long for its motion, the polynomial is small until it grows like a high power
    # of t
    best = max(best, abs(begin), abs(end))
    most = sharpest = jerkiest = bounded = 0.0
    left, width, floor = start, h - start, SMALLEST_PART * h
    left_slope = rise  # NaN after a part that is discarded
    while left < h:
        right = min(left + width, h)
        if right != bounded:
            # bounds of the value and of the second and third derivatives on [0, right]: with bounds on the whole of
            # [0, h], the beginning of such a step would be divided into thousands of parts
            bounded = right
            most = sharpest = jerkiest = 0.0
            for k in range(n, -1, -1):
                most = most * right + abs(p[k])
                if k > 1:
                    sharpest = sharpest * right + k * (k - 1) * abs(p[k])
                if k > 2:
                    jerkiest = jerkiest * right + k * (k - 1) * (k - 2) * abs(p[k])
        half = 0.5 * (right - left)
        t = left + half
        value, slope, half_bend = evaluate(p, n, t)
        best = max(best, abs(value))
        right_slope = np.nan
        # ignore negligible values, and an excess over `best` that is only due to rounding, here or in the sum
        above = best * (1.0 + 1e-14) + ROUNDING * most + NOTHING
        if abs(value) + half * (abs(slope) + 0.5 * sharpest * half) > above:
            if abs(slope) <= sharpest * half and 2.0 * abs(half_bend) <= jerkiest * half:
                if width > floor:
                    width *= 0.5
                    continue
                floor *= FLOOR_GROWTH
            # at most one extremum here: where the slopes at both ends have different signs
            right_slope = fall
            if right < h:
                other, right_slope, _ = evaluate(p, n, right)
                best = max(best, abs(other))
            if np.isnan(left_slope):
                left_slope = evaluate(p, n, left)[1]
            if left_slope * right_slope < 0.0:
                low, high = left, right
                for _ in range(60):
                    if slope * left_slope > 0.0:
                        low = t
                    else:
                        high = t
                    moved = -0.5 * slope / half_bend if half_bend != 0.0 else np.inf
                    trial = t + moved
                    inside = low < trial < high
                    if inside and jerkiest * abs(moved) * moved * moved <= CUBIC * abs(value):
                        # the extremum of the parabola through this point; its third derivative is negligible
                        best = max(best, abs(value + 0.5 * slope * moved))
                        break
                    if not inside:
                        trial = 0.5 * (low + high)
                    if abs(trial - t) <= 1e-9 * h:
                        break
                    t = trial
                    value, slope, half_bend = evaluate(p, n, t)
                    best = max(best, abs(value))
        left, width, left_slope = right, 2.0 * width, right_slope
    return best
