"""Standard uncertainty of the mean of a series of correlated values, as those of successive cycles.

For a positive correlation r1 of neighbours, as of a motion that decays slowly, M values count as M (1 - r1) / (1 + r1)
independent ones (Zhang, N. F., Metrologia 43 (2006) S276, for a first-order autoregressive series). Rounding errors of
a periodic motion repeat after a few cycles, so that those of neighbours have opposite signs, and the mean is better
known than that of independent values. The means of batches of neighbours then take the place of the values (Law, A. M.,
2015, Simulation Modeling and Analysis, section 9.5.3): with few degrees of freedom, but they still show slow changes.
"""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BATCH, FEWEST = 3, 5
"""Number of values of a batch, and fewest batches; fewer values count as independent if r1 is negative."""

MOST = 0.95
"""Largest correlation of neighbours that is assumed."""


def standard_error(series: Array) -> tuple[float, float]:
    """Standard uncertainty of the mean of a `series`, shape (M,), and its degrees of freedom."""
    if series.size < 3:
        return float(np.ptp(series)), 1.0
    variance, r1 = _moments(series)
    count = series.size
    if r1 < 0.0 and count >= BATCH * FEWEST:
        count //= BATCH
        variance, r1 = _moments(series[: BATCH * count].reshape(count, BATCH).mean(axis=1))
    if variance == 0.0:
        return 0.0, count - 1.0
    r1 = min(max(r1, 0.0), MOST)
    effective = max(count * (1.0 - r1) / (1.0 + r1), 1.0)
    return sqrt(variance / effective), max(effective - 1.0, 1.0)


def _moments(series: Array) -> tuple[float, float]:
    """Variance of a series, shape (M,), and correlation of its neighbours, 0 without variance."""
    deviation = series - series.mean()
    variance = float(deviation @ deviation) / (series.size - 1)
    if variance == 0.0:
        return 0.0, 0.0
    return variance, float(deviation[1:] @ deviation[:-1]) / ((series.size - 1) * variance)
