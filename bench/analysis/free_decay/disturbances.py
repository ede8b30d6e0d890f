"""What the data sheet of a laser leaves open, as errors that it may make: their squares add up to the variance."""

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.fit import Fit

Array = NDArray[np.float64]

WAVES = np.arange(0.5, 3.01, 0.5)
"""Waves of a linearity error within the range of a laser."""

CLOCKS = np.array([5e-6, 1e-5, 2e-5, 5e-5, 1e-4])
"""Relative errors of a laser's clock: the larger, the sooner a measurement is gained or lost."""

PHASES = 8
"""Phases of such a wander that are looked at."""


def waves(fit: Fit, size: float, ranges: tuple[float, float]) -> Array:
    """Linearity errors of either laser: every number of waves and both quadratures, shape (m, 2, n)."""
    seen = fit.fitted
    errors: list[Array] = []
    # a phase of any size: each quadrature has half the power
    weight = size / np.sqrt(2.0 * WAVES.size)
    for laser in range(2):
        for number in WAVES:
            turn = 2.0 * np.pi * number / ranges[laser] * seen[laser]
            for shape in (np.sin(turn), np.cos(turn)):
                error = np.zeros_like(seen)
                error[laser] = weight * ranges[laser] * shape
                errors.append(error)
    return np.array(errors)


def clocks(fit: Fit, wander: float) -> Array:
    """Delays of either laser that wander like a saw by `wander` [s], at several paces and phases, shape (m, 2, n)."""
    speed, time = np.gradient(fit.fitted, fit.stretch.step, axis=1), fit.stretch.time
    errors: list[Array] = []
    for laser in range(2):
        for pace in CLOCKS if wander > 0.0 else ():
            for phase in np.arange(PHASES) / PHASES:
                late = wander * ((time * pace / wander + phase) % 1.0 - 0.5)
                error = np.zeros_like(speed)
                error[laser] = speed[laser] * late / np.sqrt(CLOCKS.size * PHASES)
                errors.append(error)
    return np.array(errors).reshape(-1, *speed.shape)
