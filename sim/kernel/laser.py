"""Free-running laser: it is not synchronised with the ticks, each of which samples its latest output.

Measurement k is taken at tick (k + phase) / per_tick, a real number, and is output `latency` measurements later.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled

RANGE, GAIN, LINEARITY, WAVES, WAVE_PHASE, STEPS, LOAD, ERROR_CURRENT = range(8)
"""Indices of the constants: measuring range [m], sensitivity relative to nominal [1], linearity error [1], number of
periods of this error in the range [1] and their phase [rad], number of steps of the output [1], load [ohm], error
current [A].
"""


@compiled("float64(float64, float64[::1])")
def output(displacement: float, constants: NDArray[np.float64]) -> float:
    """Voltage [V] across the load at a displacement [m] from mid range: 4 to 20 mA with a reserve of 1 % at both ends,
    and the error current beyond this range.
    """
    place = displacement / constants[RANGE]
    share = 0.5 + constants[GAIN] * place
    share += constants[LINEARITY] * math.sin(2.0 * math.pi * constants[WAVES] * place + constants[WAVE_PHASE])
    if -0.01 <= share <= 1.01:
        return constants[LOAD] * (0.004 + 0.016 * (math.floor(share * constants[STEPS] + 0.5) / constants[STEPS]))
    return constants[LOAD] * constants[ERROR_CURRENT]


@compiled(
    "int64(int64, int64, float64, float64, float64, float64[::1], float64[::1], float64[::1], float64[::1],"
    " float64[::1], float64[::1], float64[::1])"
)
def measure(
    tick: int,
    following: int,
    per_tick: float,
    phase: float,
    tick_length: float,
    constants: NDArray[np.float64],
    noise: NDArray[np.float64],
    x: NDArray[np.float64],
    v: NDArray[np.float64],
    last: NDArray[np.float64],
    taken: NDArray[np.float64],
    volts: NDArray[np.float64],
) -> int:
    """Write the output at each tick to `volts`, shape (n,). Returns the number of the next measurement.

    tick, following : numbers of the first tick and of the next measurement.
    per_tick, phase, tick_length : measurements per tick [1], offset of the first one [1], duration of a tick [s].
    noise : shape (m,), error [m] of each of the m new measurements up to the last tick.
    x, v : shape (n,), position [m] and velocity [m/s] of the target at the ticks, interpolated by cubic Hermite curves.
    last : shape (2,), x and v at the previous tick, updated.
    taken : shape (latency + 1,), the latest measurements [m], indexed by their number modulo this length, updated.
    """
    depth, used = taken.size, 0
    for i in range(x.size):
        newest = math.floor((tick + i) * per_tick - phase)
        while following <= newest:
            place = (following + phase) / per_tick - (tick + i - 1)
            place = min(max(place, 0.0), 1.0)
            rest = 1.0 - place
            start = last[0] * (1.0 + 2.0 * place) + tick_length * last[1] * place
            end = x[i] * (1.0 + 2.0 * rest) - tick_length * v[i] * rest
            taken[following % depth] = start * rest * rest + end * place * place + noise[used]
            following += 1
            used += 1
        last[0], last[1] = x[i], v[i]
        volts[i] = output(taken[(newest - depth + 1) % depth], constants)
    return following
