"""Free-running laser: measures between the ticks; each tick samples its latest output.

Measurement k is taken at tick (k + phase) / per_tick, a real number, and output `latency` measurements later.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled

RANGE, GAIN, LINEARITY, WAVES, WAVE_PHASE, STEPS, LOAD, ERROR_CURRENT = range(8)
"""Indices of the constants: measuring range [m], sensitivity over nominal [1], linearity error [1], its periods
in the range [1] and their phase [rad], steps of the output [1], load [ohm], error current [A]."""


@compiled("float64(float64, float64[::1])")
def output(displacement: float, constants: NDArray[np.float64]) -> float:
    """Voltage [V] across the load at a displacement [m] from mid range: 4 to 20 mA, 1 % reserve, else error current."""
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
    """Write the output at each tick into `volts`, shape (n,); returns the number of the next measurement.

    tick, following : the first tick's number and the next measurement's number.
    per_tick, phase, tick_length : measurements per tick [1], offset of the first one [1], length of a tick [s].
    noise : shape (m,), error of each new measurement [m], m = measurements up to the last tick.
    x, v : shape (n,), position and velocity of the target at the ticks [m], [m/s]; interpolated by cubic Hermite
    curves. last : shape (2,), x and v at the previous tick, updated. taken : shape (latency + 1,), the latest
    measurements [m], by number modulo its length, updated; those sampled by a tick are converted to an output.
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
