"""Bias of the largest of several values with errors, which is too large on average.

For the peaks of a long motion, which differ by more than their errors except for a few, the bias is what errors of the
same size would add on average if they were added again (bootstrap estimate of bias: Efron, B., and R. J. Tibshirani,
1993, An Introduction to the Bootstrap, section 10.2). Of N equal values it leaves 1 - (sqrt(2) - 1) of the bias, so
that the correction has an uncertainty.

For the maxima of one transient, which are few and may be equal, the largest true value is estimated instead.

The mean of the larger one of two values is too large for the same reason (Clark, C. E., 1961, Operations Research
9:145).
"""

from math import erfc, sqrt, tau

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RIVALS = 6.0
"""Number of standard deviations below the largest value within which another one may be the true largest."""

DRAWS = 2000
"""Number of Monte Carlo draws of errors."""

AGAIN = 1.0 / (sqrt(2.0) - 1.0)
"""Excess of the largest of equal values with errors, relative to the further excess if errors of the same size are
added again: equal values with both scatter by sqrt(2) of them.
"""

LEFT = (AGAIN - 1.0) / sqrt(3.0)
"""Standard uncertainty of a peak that is corrected for the excess of its selection, relative to the correction: at most
the excess of equal values is left.
"""

_SEED = 20
_RAISED, _HALVINGS = 0.5, 30
"""Settings of `largest_of`: see there, and steps of the bisection."""


def selection_bias(values: Array, covariance: Array) -> float:
    """Expected increase of the largest of `values`, shape (n,), if errors of this covariance were added again, which is
    an estimate of the bias due to those that they contain.
    """
    near = values >= values.max() - RIVALS * sqrt(covariance.diagonal().max())
    if np.count_nonzero(near) == 1:
        return 0.0
    # with errors that several values have in common, the matrix may be singular
    variances, directions = np.linalg.eigh(covariance[np.ix_(near, near)])
    normal = np.random.default_rng(_SEED).standard_normal((DRAWS, variances.size))
    errors = normal @ (directions * np.sqrt(np.maximum(variances, 0.0))).T
    return max(float((values[near] + errors).max(axis=1).mean() - values.max()), 0.0)


def larger_side(sides: Array, spread: float) -> float:
    """Rms of what the selection of the larger of the peaks on both `sides`, shape (n, 2), with independent errors of
    the standard deviation `spread`, adds to their mean.
    """
    if spread == 0.0:
        return 0.0
    distance = np.abs(np.diff(sides, axis=1)).ravel() / (sqrt(2.0) * spread)
    beyond = 0.5 * np.array([erfc(each / sqrt(2.0)) for each in distance.tolist()])
    return AGAIN * sqrt(2.0) * spread * float(np.mean(np.exp(-0.5 * distance**2) / sqrt(tau) - distance * beyond))


def largest_of(maxima: Array) -> tuple[float, float]:
    """The largest of several noisy maxima and its standard uncertainty.

    `maxima` has the rows (value, uncertainty), shape (n, 2). The largest of several noisy values is too large on
    average. The estimate mu is the value for which the expected maximum equals the observed one, with no true value
    above mu. The other values are raised by half a standard deviation, because near mu they appear too low once the
    largest has been selected. The bias, 2 standard deviations for 24 equal maxima, is thus reduced to less than one
    half, also for fewer maxima. The uncertainty is that of one maximum; rivals do not reduce it.
    """
    values, spreads = maxima.T
    top, widest = float(values.max()), float(spreads.max())
    if values.size == 1:
        return top, widest
    noise = spreads * np.random.default_rng(_SEED).standard_normal((DRAWS, values.size))
    low, high = top - RIVALS * widest, top
    mu = top
    for _ in range(_HALVINGS):
        mu = 0.5 * (low + high)
        seen = float((np.minimum(values + _RAISED * spreads, mu) + noise).max(axis=1).mean())
        low, high = (low, mu) if seen > top else (mu, high)
    return mu, widest
