"""Free-running laser: it is not synchronised with the ticks, each of which samples its latest output.

Measurement k is taken at tick (k + phase) / per_tick, a real number, and is output `latency` measurements later.
"""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false
# numba has no type annotations.

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from sim.kernel.compiled import INT, ROW, VOID, compiled

Array = NDArray[np.float64]

RANGE, GAIN, LINEARITY, WAVES, WAVE_PHASE, STEPS, LOAD, ERROR_CURRENT, NOISE = range(9)
"""Indices of the constants: measuring range [m], sensitivity relative to nominal [1], linearity error [1], number of
periods of this error in the range [1] and their phase [rad], number of steps of the output [1], load [ohm], error
current [A], standard deviation of a measurement [m].
"""

PER_TICK, PHASE, TICK_LENGTH = range(3)
"""Indices of the clock: measurements per tick [1], offset of the first one [1], duration of a tick [s]."""

TICK, FOLLOWING = range(2)
"""Indices of the counters: number of the next tick, and of the next measurement."""


class LaserState(NamedTuple):
    """A running laser. `counters`, `last` and `taken` change.

    last : shape (2,), position [m] and velocity [m/s] of the target at the previous tick.
    taken : shape (latency + 1,), the latest measurements [m], indexed by their number modulo this length.
    """

    constants: Array
    clock: Array
    counters: NDArray[np.int64]
    last: Array
    taken: Array


LASER: Any = types.NamedTuple((ROW, ROW, INT[::1], ROW, ROW), LaserState)


@compiled("float64(float64, float64[::1])", internal=True)
def output(displacement: float, constants: Array) -> float:
    """Voltage [V] across the load at a displacement [m] from mid range: 4 to 20 mA with a reserve of 1 % at both ends,
    and the error current beyond this range.
    """
    place = displacement / constants[RANGE]
    share = 0.5 + constants[GAIN] * place
    share += constants[LINEARITY] * math.sin(2.0 * math.pi * constants[WAVES] * place + constants[WAVE_PHASE])
    if -0.01 <= share <= 1.01:
        return constants[LOAD] * (0.004 + 0.016 * (math.floor(share * constants[STEPS] + 0.5) / constants[STEPS]))
    return constants[LOAD] * constants[ERROR_CURRENT]


@compiled(VOID(LASER, ROW, ROW, ROW, ROW))
def measure(laser: LaserState, normal: Array, x: Array, v: Array, volts: Array) -> None:
    """Write the output at each tick to `volts`, shape (n,).

    normal : shape (m,), a standard normal number for each of the m new measurements up to the last tick.
    x, v : shape (n,), position [m] and velocity [m/s] of the target at the ticks, interpolated by cubic Hermite curves.
    """
    last, taken, tick, following = laser.last, laser.taken, laser.counters[TICK], laser.counters[FOLLOWING]
    per_tick, phase, tick_length = laser.clock[PER_TICK], laser.clock[PHASE], laser.clock[TICK_LENGTH]
    depth, used, noise = taken.size, 0, laser.constants[NOISE]
    slot = following % depth
    if tick == 0:
        # before the first tick, the output is a measurement of the storey at rest
        last[0] = x[0]
    for i in range(x.size):
        newest = math.floor((tick + i) * per_tick - phase)
        while following <= newest:
            place = (following + phase) / per_tick - (tick + i - 1)
            place = min(max(place, 0.0), 1.0)
            rest = 1.0 - place
            start = last[0] * (1.0 + 2.0 * place) + tick_length * last[1] * place
            end = x[i] * (1.0 + 2.0 * rest) - tick_length * v[i] * rest
            taken[slot] = start * rest * rest + end * place * place + noise * normal[used]
            following += 1
            used += 1
            slot = slot + 1 if slot + 1 < depth else 0
        last[0], last[1] = x[i], v[i]
        # the oldest of the latest measurements is the one that the next measurement replaces
        volts[i] = output(float(taken[slot]), laser.constants)
    laser.counters[TICK], laser.counters[FOLLOWING] = tick + x.size, following
