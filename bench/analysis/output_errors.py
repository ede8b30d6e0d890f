"""Errors of a peak due to the output of a laser: the delay of its readings and their resolution."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from bench.analysis.draws import Draws
from bench.analysis.peak_readings import PeakReadings
from bench.analysis.sensor_accuracy import SensorAccuracy

Array = NDArray[np.float64]


def late(seen: PeakReadings, laser: int, accuracy: SensorAccuracy, draws: Draws) -> Array:
    """Errors [m] due to the delay of laser 0 or 1 with a free-running clock, uniform within one measuring period, shape
    (n,).
    """
    return seen.speeds[laser] * accuracy.laser_timing * draws.uniform(-0.5, 0.5)


def steps(seen: PeakReadings, laser: int, accuracy: SensorAccuracy, draws: Draws) -> Array:
    """Errors [m] due to the resolution of laser 0 or 1, shape (n,): the rounding errors of the fit, and one rounding
    error if the zero was taken at rest. Without the fit, errors are averaged over the steps that the laser passes.
    """
    step = accuracy.laser_resolution
    if step == 0.0:
        return np.zeros(draws.n)
    if seen.fitted is not None:
        variance = seen.fitted.variances(step)[laser]
    else:
        variance = step**2 / (12.0 * (1.0 + 2.0 * seen.swings[laser] / step))
    zero = seen.sides * step * draws.uniform(-0.5, 0.5) if seen.at_rest else 0.0
    return sqrt(variance) * draws.normal() + zero
