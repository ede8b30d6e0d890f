"""Low-pass filter cards between sensors and converter."""

from functools import lru_cache
from math import pi, sin, tan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.parameters import Parameters, quantity

if TYPE_CHECKING:
    from sim.kernel.filter import FilterState

Array = NDArray[np.float64]


@lru_cache
def butterworth(order: int, share: float) -> tuple[Array, Array]:
    """Design a Butterworth low-pass whose cutoff is the fraction `share` of the sample rate.

    Returns its second-order sections b0, b1, b2, 1, a1, a2, shape (m, 6), the poles nearest to the unit circle last,
    and their states, shape (m, 2), after settling at a constant input of 1.

    Bilinear transform of the analogue poles, in the order of operations of `scipy.signal.butter`, which is not used
    because its import alone takes longer than the simulation of a minute.
    """
    warped = 4.0 * np.tan(np.pi * (share / 0.5) / 2.0)
    angles = 1j * np.pi * np.arange(1 - order, order, 2, dtype=np.float64) / (2 * order)
    analogue: NDArray[np.complex128] = warped * -np.exp(angles)
    poles: NDArray[np.complex128] = (4.0 + analogue) / (4.0 - analogue)
    half = order // 2
    # give both poles of a conjugate pair the same rounding errors
    pairs = 0.5 * (poles[:half] + poles[::-1][:half].conj())
    kept = [*pairs, *poles.real[half : order - half]]
    kept.sort(key=lambda pole: -abs(1.0 - abs(pole)))
    sections = np.array([_section(complex(pole)) for pole in kept])
    sections[0, :3] *= warped**order * (1.0 / np.prod(4.0 - analogue)).real
    return sections, _settled(sections)


def _section(pole: complex) -> tuple[float, ...]:
    """Section with a pair of conjugate poles or one real pole, and with zeros at half the sample rate."""
    if pole.imag == 0.0:
        return 1.0, 1.0, 0.0, 1.0, -pole.real, 0.0
    return 1.0, 2.0, 1.0, 1.0, -(pole + pole.conjugate()).real, (pole * pole.conjugate()).real


def _settled(sections: Array) -> Array:
    """Steady state of each section when the input of the first is a constant 1."""
    found, level = np.empty((len(sections), 2)), 1.0
    for state, (b0, b1, b2, _, a1, a2) in zip(found, sections, strict=True):
        changes = np.array([[1.0 + a1, -1.0], [a2, 1.0]])
        state[:] = level * np.linalg.solve(changes, np.array([b1 - a1 * b0, b2 - a2 * b0]))
        level *= (b0 + b1 + b2) / (1.0 + a1 + a2)
    return found


class FilterUnit(Parameters):
    """Analogue low-pass before the converter: the same Butterworth card in every channel.

    Simulated at the sample rate by the bilinear transform, prewarped so that the cutoff is exact.
    """

    order: int = quantity(4, "1", "order of the Butterworth low-pass", ge=1, le=10)
    cutoff: float = quantity(100.0, "Hz", "frequency at which the gain is -3 dB", gt=0)

    def delay(self, sample_rate: float) -> float:
        """Delay of slow signals [s], as simulated at `sample_rate` [1/s]: 1 / (omega_c sin(pi / 2n)).

        This is the group delay at zero frequency of a Butterworth low-pass, from its poles, with omega_c as warped by
        the bilinear transform.
        """
        bent = 2.0 * sample_rate * tan(pi * self.cutoff / sample_rate)
        return 1.0 / (bent * sin(pi / (2 * self.order)))

    def stream(self, sample_rate: float) -> "FilterStream":
        """Filter cards for channels sampled at `sample_rate` [1/s], before their first sample."""
        return FilterStream(*butterworth(self.order, self.cutoff / sample_rate))


class FilterStream:
    """Running filter cards, already settled at the first sample."""

    def __init__(self, sections: Array, settled: Array) -> None:
        from sim.kernel import filter as kernel

        self._kernel = kernel
        self._sections, self._settled = np.ascontiguousarray(sections), np.ascontiguousarray(settled)
        self._state: FilterState | None = None

    def state(self, channels: int) -> "FilterState":
        """State of the cards of so many channels. Raises ValueError if their number changes."""
        if self._state is None:
            states, begun = np.zeros((len(self._sections), channels, 2)), np.zeros(1, dtype=np.int64)
            self._state = self._kernel.FilterState(self._sections, self._settled, states, begun)
        if self._state.states.shape[1] != channels:
            raise ValueError(f"{channels} channels on filter cards for {self._state.states.shape[1]}")
        return self._state

    def read(self, volts: Array) -> Array:
        """Filter voltages, shape (n_channels, n). Returns an array of the same shape."""
        filtered = np.array(volts, dtype=np.float64, order="C")
        if filtered.size:
            self._kernel.cascade(self.state(len(filtered)), filtered)
        return filtered
