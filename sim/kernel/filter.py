"""Recursive filters (a cascade of second-order sections for several channels, and an exponential mean), and the
converter that digitises the filtered voltages.
"""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false
# numba has no type annotations.

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from sim.kernel.compiled import FLOAT, GRID, INT, VOID, compiled

Array = NDArray[np.float64]


class FilterState(NamedTuple):
    """Running filter cards. `settled`, shape (m, 2), is the state of the `sections` after settling at an input of 1;
    `states`, shape (m, channels, 2), and `begun`, shape (1,), 0 before the first sample and then 1, change.

    The rows of `sections`, shape (m, 6), are b0, b1, b2, 1, a1, a2 (transposed direct form II, in scipy's order of
    operations).
    """

    sections: Array
    settled: Array
    states: Array
    begun: NDArray[np.int64]


FILTER: Any = types.NamedTuple((GRID, GRID, FLOAT[:, :, ::1], INT[::1]), FilterState)


@compiled(VOID(FILTER, GRID))
def cascade(cards: FilterState, volts: Array) -> None:
    """Filter `volts`, shape (channels, n), in place. The cards are settled at the first sample."""
    sections, states = cards.sections, cards.states
    if cards.begun[0] == 0:
        cards.begun[0] = 1
        for s in range(sections.shape[0]):
            for channel in range(volts.shape[0]):
                for k in range(2):
                    states[s, channel, k] = cards.settled[s, k] * volts[channel, 0]
    for channel in range(volts.shape[0]):
        for i in range(volts.shape[1]):
            value = volts[channel, i]
            for s in range(sections.shape[0]):
                given = value
                value = sections[s, 0] * given + states[s, channel, 0]
                states[s, channel, 0] = sections[s, 1] * given - sections[s, 4] * value + states[s, channel, 1]
                states[s, channel, 1] = sections[s, 2] * given - sections[s, 5] * value
            volts[channel, i] = value


@compiled("void(float64[::1], float64, float64[::1])")
def exponential_mean(values: Array, forget: float, state: Array) -> None:
    """Replace `values`, shape (n,), by their exponential mean; `state`, shape (1,), is `forget` times the last mean."""
    for i in range(values.size):
        values[i] = (1.0 - forget) * values[i] + state[0]
        state[0] = forget * values[i]


@compiled("void(float64[:,::1], float64[:,::1], float64, float64, int64, int64, int16[:,::1])")
def digitise(
    volts: Array,
    normal: Array,
    noise: float,
    lsb: float,
    lowest: int,
    highest: int,
    counts: NDArray[np.int16],
) -> None:
    """Write the counts of `volts`, shape (channels, n), to `counts`, same shape: rounded, halves to even, and limited
    to the range from `lowest` to `highest`.

    normal : shape (n, channels), standard normal numbers of the input noise.
    noise, lsb : standard deviation of the noise [V] and voltage of one count [V].
    """
    for channel in range(volts.shape[0]):
        for i in range(volts.shape[1]):
            nearest = np.rint((normal[i, channel] * noise + volts[channel, i]) / lsb)
            counts[channel, i] = int(min(max(nearest, float(lowest)), float(highest)))
