"""Length of a step, check of a state, and impact; endings and report of a run."""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled
from sim.kernel.packing import GRAVITY, H1, H_B, INERTIA, K_C, MASS, RESTITUTION, B

COMPLETED, OVERTURNED_A, OVERTURNED_B, IMPACT_LIMIT, FAILED = range(5)
"""Endings of a run. IMPACT_LIMIT: the run ended right after the last requested impact."""

STATUS, END, IMPACTS, STEPS, SAMPLES, PEAKS = range(6)
"""Indices in the report of `run`: status, end time [s], numbers of impacts and steps, filled rows of samples, and the
first of the peaks.
"""

REPORT = 8
"""Length of the report of `run`."""

SHORTEST_STEP = 1e-9
"""Step [s] below which the tolerance counts as unattainable, so that the run fails."""

LARGEST_STATE = 1e6
"""Bound on the magnitude of every component of a state. A run fails if its state exceeds it or becomes NaN."""


@compiled("UniTuple(float64, 2)(float64[::1])", internal=True)
def scales(p: NDArray[np.float64]) -> tuple[float, float]:
    """Distance R [m] of the block's centre from its corners, and the angular velocity [rad/s] below which a step needs
    no relative accuracy: a thousandth of p alpha of the block.
    """
    reach = np.hypot(p[B], p[H_B])
    return reach, 1e-3 * p[B] / p[H_B] * np.sqrt(p[MASS] * p[GRAVITY] * reach / p[INERTIA])


@compiled(
    "float64(float64, float64, float64, float64, float64, float64, float64, int64, float64, float64)", internal=True
)
def step_length(
    reach: float,
    floor: float,
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

    reach, floor : `scales` of the specimen.
    last, before : coefficients n and n - 1 of the velocities, combined as (|v1| + |v2|) / R + |omega|.
    Source: Jorba and Zou (2005).
    """
    if not (last < np.inf and before < np.inf):
        return np.nan
    scale = tolerance * max(max(abs(v1), abs(v2)) / reach, abs(omega), floor)
    limit = np.inf
    if last > 0.0:
        limit = np.log(scale / last) / n
    if before > 0.0:
        limit = min(limit, np.log(scale / before) / (n - 1))
    return np.exp(limit) if limit < np.log(allowed) else allowed


@compiled("boolean(float64[::1])", internal=True)
def is_physical(x: NDArray[np.float64]) -> bool:
    """Whether the magnitude of every component of a state is a number below LARGEST_STATE."""
    physical = True
    for k in range(6):
        physical = physical and abs(x[k]) < LARGEST_STATE
    return physical


@compiled("void(float64[::1], float64[::1], float64, float64)", internal=True)
def strike(p: NDArray[np.float64], x: NDArray[np.float64], acceleration: float, rest_angle: float) -> None:
    """Set `x`, shape (6,), to the state after an impact, rocking or at rest, under a base acceleration [m/s2]."""
    holding = p[B] * p[GRAVITY] * p[MASS]
    moment = p[H_B] * p[MASS] * acceleration - p[K_C] * p[H1] * x[0]
    x[4] = 0.0
    x[5] *= p[RESTITUTION]
    if x[5] == 0.0 or x[5] * x[5] < 2.0 * (holding - abs(moment)) / p[INERTIA] * rest_angle:
        x[5] = 0.0
