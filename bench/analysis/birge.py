"""Mean of a few repeats, with what they scatter beyond their own uncertainties.

The Birge ratio, the root of chi2 / (R - 1), tells whether R repeats scatter more than is stated (Birge, Physical Review
40 (1932) 207). Where it is above 1, each variance has the same addition that brings it to 1 (Mandel and Paule,
Analytical Chemistry 42 (1970) 1194): a scatter that dominates makes the weights equal. So few repeats tell that scatter
only roughly, so its part follows Student's t with R - 1 degrees of freedom: it is enlarged until +-1.96 times the
combined uncertainty holds 95 %, as elsewhere (GUM:2008, G.4). Where the scatter is one to four times as large as what
is stated, repeats may agree by chance: of two the interval then holds 87 %, of three 91 %, of five or more 93 %.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_LEVEL = 0.975
_STEPS, _CLOSE = 200, 1e-10


@dataclass(frozen=True, eq=False)
class Repeats:
    """`values`, shape (n,), the means; `weights`, shape (R, n), of the repeats, which sum to 1; `scatter`, shape (n,),
    its part of the standard uncertainties, Student's t counted; `birge`, shape (n,), NaN for a single repeat.
    """

    values: Array
    weights: Array
    scatter: Array
    birge: Array


def mean_of_repeats(values: ArrayLike, variances: ArrayLike) -> Repeats:
    """Mean of R repeats of n quantities, each for itself: `values` and their own `variances`, shapes (R, n)."""
    found, own = np.asarray(values, dtype=np.float64), np.asarray(variances, dtype=np.float64)
    number = len(found)
    added, birge = np.zeros(found.shape[1]), np.full(found.shape[1], np.nan)
    if number > 1:
        birge = np.sqrt(np.sum(_squares(found, own), axis=0) / (number - 1))
        added = _addition(found, own)
    weights = _weights(own + added)
    spread = np.sqrt(added * np.sum(weights**2, axis=0))
    return Repeats(np.sum(weights * found, axis=0), weights, student_factor(number) * spread, birge)


def enlarged(covariance: Array, scatter: Array) -> Array:
    """`covariance` of a mean, shape (n, n), with `scatter`, shape (n,), of its quantities; correlations are kept."""
    own = np.diag(covariance)
    larger = np.sqrt(1.0 + scatter**2 / np.where(own > 0.0, own, np.inf))
    return np.outer(larger, larger) * covariance


def student_factor(number: int) -> float:
    """By how much the scatter of so many repeats is enlarged: 95 % by Student's t over that of a normal one."""
    from scipy.stats import norm, t

    return float(t.ppf(_LEVEL, number - 1) / norm.ppf(_LEVEL)) if number > 1 else 0.0


def _weights(variances: Array) -> Array:
    return (1.0 / variances) / np.sum(1.0 / variances, axis=0)


def _squares(values: Array, variances: Array) -> Array:
    return (values - np.sum(_weights(variances) * values, axis=0)) ** 2 / variances


def _addition(values: Array, variances: Array) -> Array:
    """What has to be added to the variances for Birge ratios of 1, shape (n,); none where they are smaller.

    Newton's method from zero comes to it from below (DerSimonian and Kacker, Contemporary Clinical Trials 28 (2007)
    105), and doubles it in a step while it is far.
    """
    wanted = len(values) - 1
    added = np.zeros(values.shape[1])
    for _ in range(_STEPS):
        whole = variances + added
        squares = _squares(values, whole)
        excess = np.sum(squares, axis=0) - wanted
        if not np.any(excess > _CLOSE):
            break
        added += np.maximum(excess, 0.0) / np.maximum(np.sum(squares / whole, axis=0), np.finfo(np.float64).tiny)
    return added
