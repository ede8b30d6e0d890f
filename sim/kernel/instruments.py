"""All instruments of the bench, from its motion to counts, in one call per block: with one call per instrument, the
calls took more time than the instruments.
"""
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false
# numba has no type annotations.

from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from sim.kernel.compiled import FLOAT, GRID, INT, ROW, VOID, compiled
from sim.kernel.filter import FILTER, FilterState, cascade, digitise
from sim.kernel.laser import LASER, LaserState, measure

Array = NDArray[np.float64]

_COUNTS: Any = types.int16[:, ::1]

LEVEL, SLOPE, ZERO = range(3)
"""Columns of the constants of linear sensors: noise [unit], sensitivity [V/unit], voltage at zero [V]."""

_X, _V, _U, _RATES, _A = 0, 1, 2, 4, 8
"""Columns of the samples: table, both targets of the lasers, their rates, mean acceleration of the table."""

_FIRST_LASER = 2
"""Row of the first laser's channel; the linear sensors have the rows before it and after the second laser."""

_GIVEN = (GRID, INT, GRID, FLOAT[:, :], GRID, LASER, ROW, LASER, ROW, FILTER, GRID, FLOAT, FLOAT, INT, INT)


@compiled(VOID(*_GIVEN, _COUNTS))
def digitise_motion(
    samples: Array,
    grounded: int,
    further: Array,
    linear_noise: Array,
    linear: Array,
    laser_1: LaserState,
    laser_1_noise: Array,
    laser_2: LaserState,
    laser_2_noise: Array,
    cards: FilterState,
    input_noise: Array,
    noise: float,
    lsb: float,
    lowest: int,
    highest: int,
    counts: NDArray[np.int16],
) -> None:
    """Write the counts of all channels, shape (channels, n): displacement sensor, accelerometer, lasers, `further`.

    samples : shape (n, 9), of `sim.arrangement.targets`; both lasers measure u, or x + u if they are `grounded`.
    further : shape (m, n), values [unit] for the further linear sensors.
    linear_noise, linear : standard normal numbers, shape (2 + m, n), and constants, shape (2 + m, 3), of displacement
    sensor, accelerometer and further sensors. The noise of the lasers is that of `sim.kernel.laser.measure`; the
    remaining arguments are those of `sim.kernel.filter`.
    """
    n = samples.shape[0]
    volts = np.empty((linear.shape[0] + 2, n))
    for k in range(linear.shape[0]):
        later = k - _FIRST_LASER
        row = volts[k if later < 0 else k + 2]
        for i in range(n):
            value = further[later, i] if later >= 0 else samples[i, _A if k == 1 else _X]
            row[i] = (linear_noise[k, i] * linear[k, LEVEL] + value) * linear[k, SLOPE] + linear[k, ZERO]
    x, v = np.empty(n), np.empty(n)
    for storey in range(2):
        for i in range(n):
            x[i], v[i] = samples[i, _U + storey], samples[i, _RATES + storey]
            if grounded:
                x[i] += samples[i, _X]
                v[i] += samples[i, _V]
        if storey == 0:
            measure(laser_1, laser_1_noise, x, v, volts[_FIRST_LASER])
        else:
            measure(laser_2, laser_2_noise, x, v, volts[_FIRST_LASER + 1])
    cascade(cards, volts)
    digitise(volts, input_noise, noise, lsb, lowest, highest, counts)
