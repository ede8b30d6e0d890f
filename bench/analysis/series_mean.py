"""Standard uncertainty of the mean of a series of correlated values, as those of successive cycles.

For a positive correlation r1 of neighbours, as of a motion that decays slowly, M values count as M (1 - r1) / (1 + r1)
independent ones (Zhang, N. F., Metrologia 43 (2006) S276, for a first-order autoregressive series). Rounding errors of
a periodic motion repeat after a few cycles, so that those of neighbours have opposite signs, and the mean is better
known than that of independent values: the variance of the mean is then the spectral density of the series at low
frequencies divided by M, with two degrees of freedom for each frequency.
"""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEWEST = 16
"""Fewest values for a spectral density; fewer ones that are not positively correlated count as independent."""

LOW = 4
"""Number of values for each of the frequencies that are averaged."""

MOST = 0.95
"""Largest correlation of neighbours that is assumed."""


def standard_error(series: Array) -> tuple[float, float]:
    """Standard uncertainty of the mean of a `series`, shape (M,), and its degrees of freedom."""
    if series.size < 3:
        return float(np.ptp(series)), 1.0
    deviation = series - series.mean()
    variance = float(deviation @ deviation) / (series.size - 1)
    if variance == 0.0:
        return 0.0, series.size - 1.0
    r1 = float(deviation[1:] @ deviation[:-1]) / ((series.size - 1) * variance)
    if r1 < 0.0 and series.size >= FEWEST:
        number = series.size // LOW
        powers = np.abs(np.fft.rfft(deviation)[1 : 1 + number]) ** 2
        return sqrt(float(powers.mean())) / series.size, 2.0 * number
    r1 = min(max(r1, 0.0), MOST)
    effective = max(series.size * (1.0 - r1) / (1.0 + r1), 1.0)
    return sqrt(variance / effective), max(effective - 1.0, 1.0)
