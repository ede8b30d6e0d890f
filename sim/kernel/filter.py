"""Recursive filters (a cascade of second-order sections for several channels, and an exponential mean), and the
converter that digitises the filtered voltages.
"""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled


@compiled("void(float64[:,::1], float64[:,:,::1], float64[:,::1])")
def cascade(sections: NDArray[np.float64], state: NDArray[np.float64], volts: NDArray[np.float64]) -> None:
    """Filter `volts`, shape (channels, n), in place, and update the `state`, shape (sections, channels, 2).

    The rows of `sections`, shape (sections, 6), are b0, b1, b2, 1, a1, a2 (transposed direct form II, in scipy's order
    of operations).
    """
    for channel in range(volts.shape[0]):
        for i in range(volts.shape[1]):
            value = volts[channel, i]
            for s in range(sections.shape[0]):
                given = value
                value = sections[s, 0] * given + state[s, channel, 0]
                state[s, channel, 0] = sections[s, 1] * given - sections[s, 4] * value + state[s, channel, 1]
                state[s, channel, 1] = sections[s, 2] * given - sections[s, 5] * value
            volts[channel, i] = value


@compiled("void(float64[::1], float64, float64[::1])")
def exponential_mean(values: NDArray[np.float64], forget: float, state: NDArray[np.float64]) -> None:
    """Replace `values`, shape (n,), by their exponential mean; `state`, shape (1,), is `forget` times the last mean."""
    for i in range(values.size):
        values[i] = (1.0 - forget) * values[i] + state[0]
        state[0] = forget * values[i]


@compiled("void(float64[:,::1], float64[:,::1], float64, float64, int64, int64, int16[:,::1])")
def digitise(
    volts: NDArray[np.float64],
    normal: NDArray[np.float64],
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
