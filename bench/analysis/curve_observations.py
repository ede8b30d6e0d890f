"""Independent observations of both lasers' error curves, from the equations of all tests.

The equations (`bench.analysis.storey_equations`) are combined to observations that are independent for curves with a
given prior. The variance of an equation is the one with the largest evidence for flexible curves. It is enlarged by the
ratio of what the residuals of whole blocks contribute to what independent residuals would: errors of the model, which
are correlated, count as noise.

Noise of the readings is also in the coefficients, so that a motion that is nearly a single sine would seem to have
errors in proportion to its readings. In the n equations of one test, whose values have the noise sigma, rows with the
regression coefficients g on this noise add n sigma^2 g to rows^T values and n sigma^2 g g^T to rows^T rows on average.
Both are subtracted (moment estimator of errors in variables: Fuller, 1987, Measurement Error Models, section 2.2). The
noise in the rows that is independent of that of the values is neglected: it is small beside the rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUNDING = 1e-10
"""Relative size of a combination below which it is due to rounding."""

USEFUL = 1e-3
"""Smallest variance of an observation relative to its noise that is not neglected."""

NOISES: Array = np.geomspace(1e-8, 1e-3, 240)
"""Standard deviations of an equation that are compared [m]."""


@dataclass(frozen=True, eq=False)
class Observations:
    """Observed `values`, shape (k,), of linear functions of the unknowns, `rows`, shape (k, unknowns), with independent
    `noise`, shape (k,), given as standard deviation.
    """

    rows: Array
    values: Array
    noise: Array

    def beside(self, other: "Observations", common: int) -> "Observations":
        """These and the `other` ones, with the first `common` unknowns in common; the further ones of the other
        follow those of these.
        """
        own, others = self.rows.shape[1] - common, other.rows.shape[1] - common
        rows = np.concatenate(
            (
                np.pad(self.rows, ((0, 0), (0, others))),
                np.insert(other.rows, [common] * own, 0.0, axis=1),
            )
        )
        return Observations(
            rows, np.concatenate((self.values, other.values)), np.concatenate((self.noise, other.noise))
        )


@dataclass(frozen=True, eq=False)
class Combined(Observations):
    """Observations that are combinations of equations. `transform`, shape (unknowns, k): values = transform^T rows^T
    values of the equations. `expected`, shape (unknowns,), is the posterior mean of the unknowns for flexible curves.
    """

    transform: Array
    expected: Array


def observations(
    rows: Array,
    values: Array,
    removed: int,
    blocks: NDArray[np.intp],
    priors: tuple[Array, Array],
    least: float = NOISES[0],
) -> Combined:
    """Useful combinations of equations, from which `removed` columns were projected out; `blocks` are the indices of
    the first equation of each block. The noise is estimated for flexible curves with the covariances `priors`; further
    unknowns have the standard deviation 1. `least` [m] is the smallest noise of an equation.
    """
    left, sizes, right = np.linalg.svd(rows, full_matrices=False)
    present = sizes > ROUNDING * sizes[0]
    left, sizes, right = left[:, present], sizes[present], right[present]
    combined, seen = sizes[:, None] * right, left.T @ values
    prior = np.eye(rows.shape[1])
    n, m = len(priors[0]), len(priors[1])
    prior[:n, :n], prior[n : n + m, n : n + m] = priors
    variances, turned = np.linalg.eigh(combined @ prior @ combined.T)
    variances = np.maximum(variances, 0.0)
    left, combined, seen = left @ turned, turned.T @ combined, turned.T @ seen
    beside, free = max(float(values @ values - seen @ seen), 0.0), values.size - removed - seen.size
    spread = variances + NOISES[:, None] ** 2
    evidence = -0.5 * (np.sum(seen**2 / spread + np.log(spread), axis=1) + beside / NOISES**2) - free * np.log(NOISES)
    noise = np.full(seen.size, max(float(NOISES[evidence.argmax()]), least))
    # residuals of curves that follow correlated errors less closely show more of them
    for _ in range(2):
        noise = np.maximum(noise, _correlated(left, seen, values, blocks, variances, noise))
    useful = variances > USEFUL * noise**2
    combined, seen, noise = combined[useful], seen[useful], noise[useful]
    return Combined(
        rows=combined,
        values=seen,
        noise=noise,
        transform=(right.T / sizes) @ turned[:, useful],
        expected=prior @ combined.T @ (seen / (variances[useful] + noise**2)),
    )


def _correlated(
    left: Array, seen: Array, values: Array, blocks: NDArray[np.intp], variances: Array, noise: Array
) -> Array:
    """Standard deviation of independent residuals that would contribute as much to each combination, `seen` = left^T
    values with the prior `variances`, as the residuals of whole blocks do [m]. The variances of few blocks scatter:
    each is averaged with the mean over all useful combinations.
    """
    useful = variances > USEFUL * noise**2
    residual = values - left @ (seen * variances / (variances + noise**2))
    squares = np.sum(np.add.reduceat(left * residual[:, None], blocks, axis=0) ** 2, axis=0)
    # the sum over all blocks vanishes
    squares *= blocks.size / (blocks.size - 1)
    mean = float(squares[useful].mean()) if useful.any() else 0.0
    return np.sqrt(0.5 * (mean + squares))


def without_noise_in_rows(
    observed: Combined, rows: Array, values: Array, slopes: Array, ends: Sequence[int]
) -> Observations:
    """`observed` without the expected contribution of the noise in the rows.

    `rows`, shape (number, unknowns), and `values`, shape (number,) [m], are the equations of all tests, and `ends` the
    indices after the last equation of each; `slopes`, shape (tests, unknowns), are the regression coefficients of its
    rows on the noise.
    """
    residual = values - rows @ observed.expected
    squares = np.array([residual[begin:end] @ residual[begin:end] for begin, end in pairwise((0, *ends))])
    across = slopes @ observed.transform
    return Observations(
        observed.rows - (across.T * squares) @ slopes, observed.values - squares @ across, observed.noise
    )
