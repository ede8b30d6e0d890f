"""Cycles with known amplitudes, for tests of what is made of them."""

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle


def pure_cycle(index: int, amplitudes: NDArray[np.complex128], noise: float = 0.0, samples: int = 600) -> Cycle:
    """A cycle of pure sines with the complex `amplitudes` of its signals."""
    coefficients = np.stack((np.zeros(amplitudes.size), amplitudes.real, amplitudes.imag))
    peak = np.abs(amplitudes)
    return Cycle(index, samples, coefficients, amplitudes, peak, peak, np.full(amplitudes.size, noise))
