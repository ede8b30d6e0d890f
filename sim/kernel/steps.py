"""Length, validity and impact of a step; endings and report of a run."""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled
from sim.kernel.packing import GRAVITY, H1, H_B, INERTIA, K_C, MASS, RESTITUTION, B

COMPLETED, OVERTURNED_A, OVERTURNED_B, IMPACT_LIMIT, FAILED = range(5)
"""Endings of a run. IMPACT_LIMIT: right after the last impact requested."""

STATUS, END, IMPACTS, STEPS, SAMPLES, PEAKS = range(6)
"""Indices in the report of `run`: status, end time [s], counts, rows of samples filled; from PEAKS on the peaks."""

REPORT = 8
"""Length of the report of `run`."""

SHORTEST_STEP = 1e-9
"""Step [s] below which the tolerance counts as unattainable: the run fails."""

LARGEST_STATE = 1e6
"""Bound of every component of a physical state; a run that exceeds it, or yields NaN, fails."""


@compiled("float64(float64[::1], float64, float64, float64, float64, float64, int64, float64, float64)")
def step_length(
    p: NDArray[np.float64],
    v1: float,
    v2: float,
    omega: float,
    last: float,
    before: float,
    n: int,
    tolerance: float,
    allowed: float,
) -> float:
    """Length [s] of a step from the last two coefficients, at most `allowed`; NaN if a coefficient is not finite.

    last, before : coefficients n and n - 1 of the velocities added up as (|v1| + |v2|) / R + |omega|.
    Source: Jorba and Zou (2005).
    """
    if not (last < np.inf and before < np.inf):
        return np.nan
    reach = np.hypot(p[B], p[H_B])
    # velocities below a thousandth of the block's p alpha need no relative accuracy
    floor = 1e-3 * p[B] / p[H_B] * np.sqrt(p[MASS] * p[GRAVITY] * reach / p[INERTIA])
    scale = tolerance * max(max(abs(v1), abs(v2)) / reach, abs(omega), floor)
    limit = np.inf
    if last > 0.0:
        limit = np.log(scale / last) / n
    if before > 0.0:
        limit = min(limit, np.log(scale / before) / (n - 1))
    return np.exp(limit) if limit < np.log(allowed) else allowed


@compiled("boolean(float64[::1])")
def is_physical(x: NDArray[np.float64]) -> bool:
    """Whether every component of a state is a number below LARGEST_STATE."""
    physical = True
    for k in range(6):
        physical = physical and abs(x[k]) < LARGEST_STATE
    return physical


@compiled("void(float64[::1], float64[::1], float64, float64)")
def strike(p: NDArray[np.float64], x: NDArray[np.float64], acceleration: float, rest_angle: float) -> None:
    """Set the state `x`, shape (6,), to that after an impact under a base acceleration [m/s2]: rocking, or at rest."""
    holding = p[B] * p[GRAVITY] * p[MASS]
    moment = p[H_B] * p[MASS] * acceleration - p[K_C] * p[H1] * x[0]
    x[4] = 0.0
    x[5] *= p[RESTITUTION]
    if x[5] == 0.0 or x[5] * x[5] < 2.0 * (holding - abs(moment)) / p[INERTIA] * rest_angle:
        x[5] = 0.0
