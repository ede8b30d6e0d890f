"""A free-running laser: it measures between the ticks, and each tick finds the last value that is out.

Measurement k is taken at tick (k + phase) / per_tick, a real number, and shown `latency` measurements later.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled

RANGE, GAIN, LINEARITY, WAVES, WAVE_PHASE, STEPS, LOAD, ERROR_CURRENT = range(8)
"""Places in the table of constants: measuring range [m], sensitivity over nominal [1], linearity error [1], its
waves in the range [1] and their phase [rad], steps of the output [1], load [ohm], error current [A]."""


@compiled("float64(float64, float64[::1])")
def output(displacement: float, constants: NDArray[np.float64]) -> float:
    """Voltage [V] over the load for a displacement [m] from mid range: 4 to 20 mA, 1 % reserve, else the error."""
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
    shown: NDArray[np.float64],
    volts: NDArray[np.float64],
) -> int:
    """Write the output at each tick into `volts`, shape (n,); returns the number of the next measurement.

    tick, following : the first tick's number and the next measurement's number.
    per_tick, phase, tick_length : measurements per tick, and of the first one the share [1], [1], [s].
    noise : shape (m,), error of each new measurement [m], m = measurements up to the last tick.
    x, v : shape (n,), what is seen at the ticks [m], [m/s]; between them the cubic Hermite curve is seen.
    last : shape (2,), x and v at the tick before, moved on. shown : shape (latency + 1,), the newest outputs by
    number modulo its length, moved on.
    """
    depth, used = shown.size, 0
    for i in range(x.size):
        taken = math.floor((tick + i) * per_tick - phase)
        while following <= taken:
            place = (following + phase) / per_tick - (tick + i - 1)
            place = min(max(place, 0.0), 1.0)
            rest = 1.0 - place
            start = last[0] * (1.0 + 2.0 * place) + tick_length * last[1] * place
            end = x[i] * (1.0 + 2.0 * rest) - tick_length * v[i] * rest
            seen = start * rest * rest + end * place * place + noise[used]
            shown[following % depth] = output(seen, constants)
            following += 1
            used += 1
        last[0], last[1] = x[i], v[i]
        volts[i] = shown[(taken - depth + 1) % depth]
    return following
