"""Independent truth to thirty digits: the printed equations, extrapolated by Gragg's method in mpmath.

Nothing is shared with `sim.kernel`: other equations (the printed ones), another method (extrapolation instead of
Taylor series), another arithmetic. Events are located by secants that repeat the whole step.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import mpmath as mp

from sim.specimen import Specimen

Number = Any
"""mpmath ships no types."""

Vector = list[Number]
Acceleration = Callable[[Number], Number]

DIGITS, COLUMNS = 36, 12
"""Digits carried, and columns of the extrapolation (order 24)."""


def exact_rates(specimen: Specimen, corner: int, x: Vector, a_g: Number) -> Vector:
    """Eq. (8) for corner +1 (A), Eq. (A.1) for corner -1 (B), the linear frame for 0, in working precision."""
    u1, u2, v1, v2, theta, omega = x
    frame, block = specimen.frame, specimen.block
    c1, c2 = (mp.mpf(c) for c in frame.dashpots)
    m1, m2, k1, k2, h1 = (mp.mpf(value) for value in (frame.m1, frame.m2, frame.k1, frame.k2, frame.h1))
    b, h_b, mass, inertia = (mp.mpf(value) for value in (block.b, block.h_b, block.mass, block.inertia))
    k_c, d, g = (mp.mpf(value) for value in (specimen.k_c, specimen.d, specimen.g))
    s, c = mp.sin(theta), mp.cos(theta)
    angular = mp.mpf(0)
    if corner == 0:
        pull = k_c * u1
    elif corner > 0:
        length = mp.sqrt(d**2 - 2 * (d - u1) * h1 * s - 2 * d * u1 - 2 * h1**2 * c + 2 * h1**2 + u1**2)
        stretch = k_c * (length - d) / length
        pull = -(d - h1 * s - u1) * stretch
        spring = h1 * ((u1 - d) * c + h1 * s) * stretch
        angular = -(c * (b * g * mass - h_b * mass * a_g) - mass * s * (b * a_g + g * h_b) + spring) / inertia
    else:
        terms = 8 * b**2 - 4 * b * (2 * b + d) * c + u1 * (4 * b * c - 4 * b - 2 * d + u1)
        terms += 4 * b * d + d**2 + 2 * h1 * (u1 - d) * s - 2 * h1**2 * (c - 1)
        length = mp.sqrt(terms)
        stretch = k_c * (length - d) / length
        pull = (-2 * b - d + 2 * b * c + h1 * s + u1) * stretch
        spring = (h1 * (u1 - d) * c + (h1**2 + 2 * b * (2 * b + d - u1)) * s) * stretch
        angular = -(-c * (b * g * mass + h_b * mass * a_g) + mass * s * (b * a_g - g * h_b) + spring) / inertia
    first = -(pull + (c1 + c2) * v1 - c2 * v2 + (k1 + k2) * u1 - k2 * u2) / m1 - a_g
    second = -(c2 * (v2 - v1) + k2 * (u2 - u1)) / m2 - a_g
    return [v1, v2, first, second, omega, angular]


def extrapolated(rates: Callable[[Number, Vector], Vector], t: Number, x: Vector, h: Number) -> Vector:
    """The state after one step `h` by the modified midpoint rule with 2, 4, ..., 2 COLUMNS substeps (Gragg, 1965)."""
    table: list[Vector] = []
    start = rates(t, x)
    for column in range(1, COLUMNS + 1):
        n = 2 * column
        part = h / n
        before, now = x, [a + part * b for a, b in zip(x, start, strict=True)]
        for i in range(1, n):
            slope = rates(t + i * part, now)
            before, now = now, [a + 2 * part * b for a, b in zip(before, slope, strict=True)]
        slope = rates(t + h, now)
        row = [(a + b + part * c) / 2 for a, b, c in zip(now, before, slope, strict=True)]
        previous, table = table, [row]
        for j, coarse in enumerate(previous):
            ratio = mp.mpf(column) / (column - j - 1)
            table.append([a + (a - b) / (ratio**2 - 1) for a, b in zip(table[j], coarse, strict=True)])
    return table[-1]


def exact_motion(
    specimen: Specimen, base: Sequence[Acceleration], breakpoints: Sequence[Number], start: Vector, longest: float
) -> tuple[Vector, list[Number], list[Number]]:
    """End state, times of the uplifts and of the impacts; `base` has one acceleration for every two breakpoints.

    `longest` is the step [s]; halving it shows how many digits hold. The block must not come back to rest.
    """
    x = [mp.mpf(value) for value in start]
    corner = int(mp.sign(x[4] if x[4] != 0 else x[5]))
    uplifts: list[Number] = []
    impacts: list[Number] = []
    known = 0 if x[4] != 0 else 1  # roots theta = 0 at the start of the step
    b_g_m = mp.mpf(specimen.block.b) * specimen.g * specimen.block.mass
    h_b_m = mp.mpf(specimen.block.h_b) * specimen.block.mass
    for (t, end), a_g in zip(pairwise(breakpoints), base, strict=True):
        while t < end:
            mode = corner

            def rates(time: Number, y: Vector, mode: int = mode, a_g: Acceleration = a_g) -> Vector:
                return exact_rates(specimen, mode, y, a_g(time))

            def margin(time: Number, y: Vector, mode: int = mode, a_g: Acceleration = a_g) -> Number:
                if mode != 0:
                    return mode * y[4]
                return b_g_m - abs(h_b_m * a_g(time) - mp.mpf(specimen.k_c) * specimen.frame.h1 * y[0])

            h = min(mp.mpf(longest), end - t)
            after = extrapolated(rates, t, x, h)
            if margin(t + h, after) > 0:
                t, x, known = t + h, after, 0
                continue
            # secants on the margin over t^known, each repeating the step
            older, newer = h, h * mp.mpf("0.9")
            value = margin(t + older, after) / older**known
            for _ in range(40):
                after = extrapolated(rates, t, x, newer)
                following = margin(t + newer, after) / newer**known
                if following == value or abs(newer - older) < mp.mpf(10) ** (5 - DIGITS):
                    break
                older, newer, value = newer, newer - following * (newer - older) / (following - value), following
            t, x = t + newer, after
            if mode == 0:
                uplifts.append(t)
                corner, known = (1 if h_b_m * a_g(t) > mp.mpf(specimen.k_c) * specimen.frame.h1 * x[0] else -1), 2
                x[4] = x[5] = mp.mpf(0)
            else:
                impacts.append(t)
                corner, known = -mode, 1
                x[4], x[5] = mp.mpf(0), x[5] * mp.mpf(specimen.block.restitution)
    return x, uplifts, impacts
