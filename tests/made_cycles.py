"""Cycles with known amplitudes, for tests of what is made of them."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import TRACES, Cycle
from bench.analysis.sensor_accuracy import SensorAccuracy

WITHOUT_STEPS = SensorAccuracy(laser_resolution=0.0, laser_timing=0.0)
"""Accuracy of lasers that neither round nor are late."""


@cache
def _turns(samples: int) -> NDArray[np.complex128]:
    """exp(-i phase) at the samples of a cycle."""
    return np.exp(-2j * np.pi * np.arange(samples) / samples)


def pure_cycle(index: int, amplitudes: NDArray[np.complex128], noise: float = 0.0, samples: int = 600) -> Cycle:
    """A cycle of pure sines with the complex `amplitudes` of its signals."""
    coefficients = np.stack((np.zeros(amplitudes.size), amplitudes.real, amplitudes.imag))
    peak = np.abs(amplitudes)
    traces = np.zeros((0, len(TRACES)), dtype=np.float32)
    if amplitudes.size > max(TRACES):
        traces = np.real(_turns(samples)[:, None] * amplitudes[list(TRACES)]).astype(np.float32)
    return Cycle(index, samples, coefficients, amplitudes, peak, peak, np.full(amplitudes.size, noise), traces)
