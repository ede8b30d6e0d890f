"""Several decays together.

Each quantity is the mean of the decays, weighted by what is new in each. Where they scatter more than that allows, the
scatter counts as `bench.analysis.birge` has it; it never makes an uncertainty smaller. What is common to all decays is
added once, as their mean has it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.birge import enlarged, mean_of_repeats

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Combined:
    """`values`, shape (n,), and their covariance, shape (n, n): what is new in every decay (`own`), what is `common`.

    `birge` are the Birge ratios, shape (n,), NaN for a single decay; `weights`, shape (R, n), sum to 1; `scatter`,
    shape (n,), is what the decays scatter too much, as a standard uncertainty: it is in `own`.
    """

    values: Array
    own: Array
    common: Array
    birge: Array
    weights: Array
    scatter: Array

    @property
    def covariance(self) -> Array:
        """Of the values, shape (n, n)."""
        return self.own + self.common


def combine(values: Sequence[Array], own: Sequence[Array], common: Sequence[Array]) -> Combined:
    """Combine R decays: `values`, shape (n,) each, and covariances, shape (n, n) each."""
    found = mean_of_repeats(values, [np.diag(one) for one in own])
    inner = np.einsum("rn,rm,rnm->nm", found.weights, found.weights, np.array(own))
    shared = np.mean(common, axis=0)
    return Combined(found.values, enlarged(inner, found.scatter), shared, found.birge, found.weights, found.scatter)
