"""Error curve of a laser as a random function of the reading, and what the harmonics of its readings tell about it.

A data sheet states the largest linearity error over the measuring range, not its shape. The error is modelled as a
function of the reading with the amplitude of the data sheet: either a Gaussian process with squared exponential
covariance, for an irregular curve, or a sine of random phase. The number of waves over the range is unknown.

The readings of a linear laser at a linear frame that is driven by a sine have no harmonics except the small ones caused
by those of the table. The harmonics of a reading x(phase) are those of its error e(x(phase)): for a pure sine they are
the Chebyshev coefficients of the curve over the swing. For each number of waves, the posterior of the curve given the
harmonics is that of Gaussian process regression (Rasmussen and Williams, 2006, section 2.2); each is weighted by a
power `CAUTION` of its evidence (section 5.2). The amplitude is not estimated, since a small swing does not determine
amplitude and number of waves separately.

A calibration measures the curve over a part of the range. Its Chebyshev coefficients are equivalent to the harmonics of
a sine over this part, with the fundamental, which contains the unknown scale of the laser: the posterior extrapolates
the curve beyond the calibrated readings.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.column_harmonics import ColumnHarmonics

Array = NDArray[np.float64]

FEWEST, NUMBERS = 0.25, 13
WAVES: Array = np.array([FEWEST * 2.0 ** (0.5 * k) for k in range(NUMBERS)])
"""Numbers of waves within the measuring range, from 0.25 to 16. A curve with fewer waves is a scale error, which the
tests have in common; a curve with more waves is averaged over a swing. The numbers increase by a factor of sqrt(2), so
that the exponent of the covariance doubles.
"""

ZETA_3 = 1.2020569
"""zeta(3), the sum of 1 / m^3 over m = 1, 2, ..."""

CAUTION = 0.3
"""Factor applied to the logarithm of the evidence. It is below 1 because a true curve is not a draw from the process,
and because the harmonics of a small swing hardly determine the number of waves.
"""

SCALE = 0.01
"""Standard deviation of the unknown relative error of a laser's scale: more than any, so that it is measured."""

LEAST = 1e-5
"""Smallest uncertainty of a harmonic, relative to the limit of the data sheet, so that exact harmonics can be
evaluated.
"""


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Harmonics of the reading of one laser in a test of a linear frame.

    `readings`, shape (n,) [m], over one period at equal steps of the phase, relative to the rest position; `found`,
    shape (m,), complex [m], are the amplitudes c_k, from the order `first` on, in signal = Re(sum of c_k exp(-i k
    phase)); `uncertainty`, shape (m,) [m], is the standard uncertainty of their real and imaginary parts. `first` is 2
    unless the motion is known, so that the fundamental tells the error of the scale. `columns` are the harmonics of a
    frame whose columns are not linear, None if these are not considered.
    """

    readings: Array
    found: NDArray[np.complex128]
    uncertainty: Array
    first: int = 2
    columns: ColumnHarmonics | None = None
    _enlarged: "dict[float, Harmonics]" = field(default_factory=lambda: _none(), init=False, repr=False)

    @property
    def swing(self) -> float:
        """Span of the readings [m]."""
        return float(np.ptp(self.readings))

    def rounded(self, step: float) -> "Harmonics":
        """The harmonics with the additional uncertainty due to the `step` [m] of the readings (`rounding`). Returns the
        same object for the same step.
        """
        return self.with_uncertainty(rounding(self.swing, step))

    def with_uncertainty(self, uncertainty: float) -> "Harmonics":
        """The harmonics with an additional standard `uncertainty` [m] of each part. Returns the same object for the
        same uncertainty, so that what is computed from it can be cached.
        """
        if uncertainty not in self._enlarged:
            self._enlarged[uncertainty] = replace(self, uncertainty=np.hypot(self.uncertainty, uncertainty))
        return self._enlarged[uncertainty]


def _none() -> dict[float, Harmonics]:
    return {}


def rounding(swing: float, step: float) -> float:
    """Standard uncertainty [m] of both parts of a harmonic of a reading in steps of `step` [m], with the span `swing`
    [m]: at most that of one rounding.

    The scatter of the cycles does not contain it, since all cycles are rounded alike. By the sum in
    `bench.analysis.rounding`, the mean square of the amplitude of one harmonic is zeta(3) q^3 / (pi^4 A) for a sine of
    amplitude A, half of it in each part.
    """
    amplitude = max(0.5 * swing, step, np.finfo(np.float64).tiny)
    return min(sqrt(0.5 * ZETA_3 * step**3 / (pi**4 * amplitude)), step / sqrt(12.0))


Checks = tuple[Harmonics, Harmonics]
"""Harmonics of both lasers' readings in one test."""

MOST = 8
"""Largest number of tests whose harmonics are evaluated: the time grows with its third power, and further tests with
smaller swings hardly contribute.
"""


def widest(checks: Sequence[Harmonics]) -> Sequence[Harmonics]:
    """At most `MOST` of the checks, those with the widest swings, in their order."""
    if len(checks) <= MOST:
        return checks
    kept = sorted(range(len(checks)), key=lambda k: checks[k].swing, reverse=True)[:MOST]
    return [checks[k] for k in sorted(kept)]


@dataclass(frozen=True, eq=False)
class Posterior:
    """Information from m measured harmonics about the error curve, for each of K candidates with different numbers of
    waves. `whitening`, shape (K, m, m), transforms the harmonics to independent numbers of unit variance; `measured`,
    shape (K, m), are the transformed harmonics; `likely`, shape (K,), is the weight of each candidate. `observed`,
    shape (m, n), computes the harmonics of a curve from its values at the `places`, shape (n,). `scale` is the prior
    standard deviation of the laser's relative error of scale if they tell it, otherwise zero.
    """

    places: Array
    observed: Array
    whitening: Array
    measured: Array
    likely: Array
    scale: float


@lru_cache(maxsize=4)
def posterior(checks: tuple[Harmonics, ...], limit: float, whole: float) -> Posterior:
    places = np.concatenate([each.readings for each in checks])
    observed = block_diagonal([_fourier(each.readings.size, each.found.size, each.first) for each in checks])
    measured = np.concatenate([np.concatenate((each.found.real, each.found.imag)) for each in checks])
    noise = np.diag(np.concatenate([np.tile(each.uncertainty, 2) for each in checks]) ** 2 + (LEAST * limit) ** 2)
    scale = SCALE if any(each.first == 1 for each in checks) else 0.0
    factors = np.linalg.cholesky(prior(places, observed, places, observed, limit, whole, scale) + noise)
    whitening = np.asarray(np.linalg.inv(factors), dtype=np.float64)
    white = whitening @ measured
    likely = likelihoods(factors, white)
    return Posterior(places, observed, whitening, white, likely / likely.sum(), scale)


def likelihoods(
    factors: NDArray[np.floating[Any]], white: NDArray[np.floating[Any]], caution: float = CAUTION
) -> Array:
    """Weights of candidates relative to that of the likeliest, shape (...): for the triangular `factors` of the
    covariances of what was measured, shape (..., m, m), and the `white` numbers that these make of it, shape (..., m).
    """
    sizes = np.log(np.diagonal(factors, axis1=-2, axis2=-1)).sum(axis=-1)
    evidence = -0.5 * np.einsum("...m,...m->...", white, white) - sizes
    return np.asarray(np.exp(caution * (evidence - evidence.max())), dtype=np.float64)


def prior(
    one: Array,
    left: Array,
    other: Array,
    right: Array,
    limit: float,
    whole: float,
    scale: float = 0.0,
    sines: Array = WAVES,
) -> Array:
    """Covariances [m2] of linear functions of the error curve of a laser with the measuring range `whole` [m], the
    largest error `limit` [m], and the standard deviation `scale` of the relative error of its scale; see `covariances`.
    """
    found = 0.5 * limit**2 * covariances(one, left, other, right, whole, sines)
    return found if scale == 0.0 else found + scale**2 * np.outer(left @ one, right @ other)


def covariances(one: Array, left: Array, other: Array, right: Array, whole: float, sines: Array = WAVES) -> Array:
    """Covariances of linear functions of the error curve, relative to its variance, shape (NUMBERS + K, l, r): the
    first NUMBERS entries are for irregular curves, the others for `sines` with these numbers of waves, shape (K,).
    `left`, shape (l, n), applies to the values at the places `one`, shape (n,), and `right`, shape (r, m), to those at
    `other`, shape (m,).
    """
    first = 2.0 * pi * FEWEST / whole
    distances: Array = one[:, None] - other[None, :]
    curve: Array = np.exp(-0.5 * (first * distances) ** 2)
    found = np.empty((NUMBERS + sines.size, left.shape[0], right.shape[0]))
    for k in range(NUMBERS):
        # this order of products is faster, because `right` has fewer rows
        found[k] = left @ (curve @ right.T)
        curve *= curve
    # covariance of a sine of random phase: the cosine of the phase difference
    angles = 2.0 * pi / whole * sines
    for part in (np.cos, np.sin):
        near, far = part(np.outer(angles, one)) @ left.T, part(np.outer(angles, other)) @ right.T
        products = near[:, :, None] * far[:, None, :]
        found[NUMBERS:] = products if part is np.cos else found[NUMBERS:] + products
    return found


def block_diagonal(blocks: Sequence[Array]) -> Array:
    """Block-diagonal matrix of the given blocks."""
    found = np.zeros((sum(len(each) for each in blocks), sum(each.shape[1] for each in blocks)))
    top = left = 0
    for each in blocks:
        found[top : top + len(each), left : left + each.shape[1]] = each
        top, left = top + len(each), left + each.shape[1]
    return found


@lru_cache(maxsize=8)
def _fourier(points: int, orders: int, first: int) -> Array:
    """Matrix, shape (2 * orders, points), from `points` values over one period to their cosine and sine coefficients,
    from the order `first` on.
    """
    angles = np.outer(np.arange(first, first + orders), np.arange(points) * (2.0 * pi / points))
    return np.concatenate((np.cos(angles), np.sin(angles))) * (2.0 / points)
