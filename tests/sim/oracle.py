"""Independent truth for the motion: the paper's printed equations, integrated by scipy with events.

Nothing here comes from `sim.kernel`. The equations are typed from Eq. (8) and Appendix A of the paper, term by term.
"""

from collections.abc import Callable
from itertools import pairwise
from math import acos, asin, cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import ellipk, ellipkinc

from sim.specimen import Block, Specimen

Acceleration = Callable[[float], float]


def printed_rates(specimen: Specimen, corner: int, x: NDArray[np.float64], a_g: float) -> NDArray[np.float64]:
    """Eq. (8) for corner +1 (A), Eq. (A.1) for corner -1 (B), the linear frame for 0; shape (6,).

    Under the root of Eq. (8) the print has cos^2; the distance of Eq. (4) and the mirror term of (A.2) have cos.
    """
    u1, u2, v1, v2, theta, omega = (float(value) for value in x)
    frame, block, d, g, k_c = specimen.frame, specimen.block, specimen.d, specimen.g, specimen.k_c
    (c1, c2), h1, b, h_b = frame.dashpots, frame.h1, block.b, block.h_b
    mass, inertia, s, c = block.mass, block.inertia, sin(theta), cos(theta)
    angular = 0.0
    if corner == 0:
        pull = k_c * u1
    elif corner > 0:
        length = sqrt(d**2 - 2 * (d - u1) * h1 * s - 2 * d * u1 - 2 * h1**2 * c + 2 * h1**2 + u1**2)
        pull = -k_c * (d - h1 * s - u1) * (length - d) / length
        spring = k_c * h1 * ((u1 - d) * c + h1 * s) * (length - d) / length
        angular = -(c * (b * g * mass - h_b * mass * a_g) - mass * s * (b * a_g + g * h_b) + spring) / inertia
    else:
        terms = 8 * b**2 - 4 * b * (2 * b + d) * c + u1 * (4 * b * c - 4 * b - 2 * d + u1)
        terms += 4 * b * d + d**2 + 2 * h1 * (u1 - d) * s - 2 * h1**2 * (c - 1)
        length = sqrt(terms)
        pull = k_c * (-2 * b - d + 2 * b * c + h1 * s + u1) * (length - d) / length
        spring = k_c * (h1 * (u1 - d) * c + (h1**2 + 2 * b * (2 * b + d - u1)) * s) * (length - d) / length
        angular = -(-c * (b * g * mass + h_b * mass * a_g) + mass * s * (b * a_g - g * h_b) + spring) / inertia
    first = -(pull + (c1 + c2) * v1 - c2 * v2 + (frame.k1 + frame.k2) * u1 - frame.k2 * u2) / frame.m1 - a_g
    second = -(c2 * (v2 - v1) + frame.k2 * (u2 - u1)) / frame.m2 - a_g
    return np.array([v1, v2, first, second, omega, angular])


def uplift_moment(specimen: Specimen, u1: float, a_g: float) -> float:
    """h_b M a_g - k_C h1 u1 (Eq. 9 and A.3)."""
    return specimen.block.h_b * specimen.block.mass * a_g - specimen.k_c * specimen.frame.h1 * u1


def reference_motion(
    specimen: Specimen,
    base: Acceleration,
    breakpoints: list[float],
    start: NDArray[np.float64],
    corner: int,
) -> tuple[NDArray[np.float64], list[float]]:
    """End state, shape (6,), and times of the impacts, from breakpoint to breakpoint by DOP853 with events."""
    x: NDArray[np.float64] = start.copy()
    impacts: list[float] = []
    holding = specimen.block.b * specimen.g * specimen.block.mass
    for begin, end in pairwise(breakpoints):
        t = begin
        while t < end:
            mode = corner

            def rates(time: float, y: NDArray[np.float64], mode: int = mode) -> NDArray[np.float64]:
                return printed_rates(specimen, mode, y, base(time))

            def event(time: float, y: NDArray[np.float64], mode: int = mode, t: float = t) -> float:
                if mode != 0:
                    # the start of a phase, at theta = 0, is not an event
                    return mode * y[4] if time > t else 1.0
                return holding - abs(uplift_moment(specimen, y[0], base(time)))

            event.terminal = True  # pyright: ignore[reportFunctionMemberAccess]  # scipy's way to say it
            event.direction = -1.0  # pyright: ignore[reportFunctionMemberAccess]
            solution = solve_ivp(rates, (t, end), x, method="DOP853", rtol=2e-13, atol=1e-15, events=event)
            t, x = float(solution.t[-1]), np.array(solution.y[:, -1], dtype=np.float64)
            if solution.status != 1:
                break
            if mode == 0:
                corner = 1 if uplift_moment(specimen, float(x[0]), base(t)) > 0 else -1
                x[4:] = 0.0
            else:
                impacts.append(t)
                corner, x[4], x[5] = -mode, 0.0, x[5] * specimen.block.restitution
    return x, impacts


def quarter_period(block: Block, g: float, theta: float) -> float:
    """Time [s] of the free block from rest at `theta` to its impact: exact, with elliptic integrals."""
    alpha = asin(block.b / np.hypot(block.b, block.h_b))
    p = sqrt(block.mass * g * float(np.hypot(block.b, block.h_b)) / block.inertia)
    modulus = cos((alpha - theta) / 2) ** 2
    angle = asin(cos(alpha / 2) / cos((alpha - theta) / 2))
    return float(ellipk(modulus) - ellipkinc(angle, modulus)) / p


def amplitude_after(block: Block, theta: float, impacts: int) -> float:
    """Angle [rad] to which the free block rises after some impacts: its energy falls by r^2 at each."""
    alpha = asin(block.b / np.hypot(block.b, block.h_b))
    return alpha - acos(cos(alpha) + block.restitution ** (2 * impacts) * (cos(alpha - theta) - cos(alpha)))
