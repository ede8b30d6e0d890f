"""First root and greatest magnitude of a polynomial on an interval, by certified subdivision.

An interval is discarded only when a bound on the derivatives proves that it holds nothing, and searched only when a
bound proves that it holds one thing: no grazing dip falls between samples.
"""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled

SMALLEST_PART, FLOOR_GROWTH = 1e-9, 1.1
"""Part of the interval below which a double root is taken as a touch and not subdivided further.

That floor grows whenever it is reached: the work stays bounded for polynomials whose bounds say nothing.
"""

ROUNDING, NOTHING = 2e-15, 1e-300
"""Rounding of a polynomial's value in parts of the sum of its terms' magnitudes, and what is smaller than any motion:
among denormal numbers relative bounds fail."""


@compiled("Tuple((float64, float64, float64))(float64[::1], int64, float64)")
def evaluate(p: NDArray[np.float64], n: int, t: float) -> tuple[float, float, float]:
    """Value, first derivative and half the second derivative of sum p_k t^k, k = 0..n (Horner)."""
    value = slope = half_bend = 0.0
    for k in range(n, -1, -1):
        half_bend = half_bend * t + slope
        slope = slope * t + value
        value = value * t + p[k]
    return value, slope, half_bend


@compiled("float64(float64[::1], int64, float64)")
def first_root(p: NDArray[np.float64], n: int, h: float) -> float:
    """Smallest t in [0, h] at which sum p_k t^k, k = 0..n, stops being positive; -1 when there is none."""
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
        if value <= steepest * half:  # else: positive all over this part
            if abs(slope) <= sharpest * half:
                if width > floor:
                    width *= 0.5
                    continue
                floor *= FLOOR_GROWTH
            # monotone here (or too small to matter): the sign at the right end is the whole question
            if evaluate(p, n, right)[0] <= 0.0:
                break
        left, width = right, 2.0 * width
    if left >= h:
        return -1.0
    for _ in range(100):
        value, slope, _ = evaluate(p, n, t)
        if value > 0.0:
            left = t
        else:
            right = t
        trial = t - value / slope if slope < 0.0 else left
        if not left < trial < right:
            trial = 0.5 * (left + right)
        moved, t = abs(trial - t), trial
        # of the root itself, not of the step: errors of a short flight add up over hundreds of bounces
        if moved <= 4e-16 * t:
            break
    return t


@compiled("float64(float64[::1], int64, float64, float64, float64)")
def greatest_magnitude(p: NDArray[np.float64], n: int, start: float, h: float, best: float) -> float:
    """The greater of `best` and the greatest |sum p_k t^k|, k = 0..n, for t in [start, h]."""
    # the ends first: a step that is long for its motion rises like a high power of t, and all before its end is small
    best = max(best, abs(evaluate(p, n, start)[0]), abs(evaluate(p, n, h)[0]))
    most = sharpest = jerkiest = bounded = 0.0
    left, width, floor = start, h - start, SMALLEST_PART * h
    while left < h:
        right = min(left + width, h)
        if right != bounded:
            # bounds on [0, right], of the value and the second and third derivatives: those on all of [0, h] would
            # divide the beginning of such a step into thousands of parts
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
        # more than `best` by rounding alone, here or in the sum, is not searched for, nor what is nothing
        above = best * (1.0 + 1e-14) + ROUNDING * most + NOTHING
        if abs(value) + half * (abs(slope) + 0.5 * sharpest * half) > above:
            if abs(slope) <= sharpest * half and 2.0 * abs(half_bend) <= jerkiest * half:
                if width > floor:
                    width *= 0.5
                    continue
                floor *= FLOOR_GROWTH
            # at most one extremum here: both ends count, and the zero of the slope between them if there is one
            low, high = left, right
            low_value, low_slope, _ = evaluate(p, n, low)
            high_value, high_slope, _ = evaluate(p, n, high)
            best = max(best, abs(low_value), abs(high_value))
            if low_slope * high_slope < 0.0:
                for _ in range(60):
                    value, slope, half_bend = evaluate(p, n, t)
                    best = max(best, abs(value))
                    if slope * low_slope > 0.0:
                        low = t
                    else:
                        high = t
                    trial = t - 0.5 * slope / half_bend if half_bend != 0.0 else low
                    if not low < trial < high:
                        trial = 0.5 * (low + high)
                    if abs(trial - t) <= 1e-9 * h:
                        break
                    t = trial
        left, width = right, 2.0 * width
    return best
