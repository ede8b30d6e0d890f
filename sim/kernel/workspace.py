"""State and scratch space of the lanes in which members are integrated."""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.lanes import LANES
from sim.kernel.taylor import WORK_ROWS

TAIL, SIDE, LENGTH, TAU, BEGIN, LOST, MET, REACH, FLOOR, BEFORE, LAST = range(11)
"""Rows of `values`: tail of the step's polynomial, corner, length of the step [s], time since the segment's start [s],
start of the segment [s] and its rounding error, length of the last segment at rest (negative if tabulated), the
member's `sim.kernel.steps.scales`, and the `last_terms` of the velocities.
"""

MEMBER, SEGMENT, KNOWN, STEPPED, ASKS, WAITING = range(6)
"""Rows of `places`: member of the lane (-1: none), its segment, number of known roots theta = 0, the segment at
whose start the block rests and which needs Taylor steps, and whether the lane needs the exact step at rest. The first
value of WAITING is the first member without a lane.
"""

WORK = (
    "Tuple((float64[:,::1], int64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[:,:,::1],"
    " float64[:,:,::1], float64[:,::1], float64[:,::1], float64[::1], float64[:,::1], float64[::1], float64[::1]))"
)
"""Type of the arrays returned by `workspace`."""

Array = NDArray[np.float64]
Places = NDArray[np.int64]
Workspace = tuple[Array, Places, Array, Array, Array, Array, Array, Array, Array, Array, Array, Array, Array]


def workspace(n: int) -> Workspace:
    """State and scratch space of lanes without members, for Taylor series of order `n`.

    Allocated by the caller of the compiled functions, because numba compiles the allocation of an array anew for each
    shape, all of them in a fifth of the compilation time.
    """
    values, places = np.zeros((11, LANES)), np.zeros((6, LANES), np.int64)
    values[SIDE] = values[REACH] = 1.0
    places[MEMBER] = -1
    # parameters of the members and their segments; series of the excitation and the motion, for all lanes and for one
    p, row = np.ones((16, LANES)), np.zeros((10, LANES))
    a, c, w = np.zeros((n + 1, LANES)), np.zeros((6, n + 1, LANES)), np.zeros((WORK_ROWS, n + 1, LANES))
    following, bounds = np.zeros((6, LANES)), np.zeros((3, LANES))
    a1, c1, after, e = np.zeros(n + 1), np.zeros((6, n + 1)), np.zeros(6), np.zeros(n + 1)
    return values, places, p, row, a, c, w, following, bounds, a1, c1, after, e
