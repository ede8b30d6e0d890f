"""Linearity error of a laser, as a curve of unknown shape, and the resulting errors of measured peaks.

A data sheet states the largest error over the measuring range, not its shape. The error is modelled as a function of
the reading with the amplitude of the data sheet: either a Gaussian process with squared exponential covariance, for an
irregular curve, or a sine of random phase. The number of waves over the range is unknown. Without further information,
the curve or sine with the largest effect is assumed.

Every test of the bare frame is a check: the frame is linear and driven by a sine, so that the readings of a linear
laser have no harmonics except the small ones caused by those of the table. The harmonics of a reading x(phase) are
those of its error e(x(phase)): for a pure sine they are the Chebyshev coefficients of the curve over the swing. The
posterior of the curve given the harmonics is that of Gaussian process regression (Rasmussen and Williams, 2006, section
2.2), for each number of waves. Of those that their evidence (section 5.2) does not exclude, the one with the largest
effect is assumed: a bare frame that moves much less than the coupled one excludes few. The amplitude is not estimated,
since a small swing does not determine amplitude and number of waves separately. The posterior mean is not subtracted
from the result: it is part of the uncertainty, as an uncorrected effect (GUM F.2.4.5).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import exp, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from sim.linear import steady_response
from sim.specimen import Specimen

Array = NDArray[np.float64]

FEWEST, NUMBERS = 0.25, 13
WAVES: Array = np.array([FEWEST * 2.0 ** (0.5 * k) for k in range(NUMBERS)])
"""Numbers of waves within the measuring range, from 0.25 to 16. A curve with fewer waves is a scale error, which the
tests have in common; a curve with more waves is averaged over a swing. The numbers increase by a factor of sqrt(2), so
that the exponent of the covariance doubles.
"""

SMOOTH = 1.5
"""Estimated number of waves above which a linearity error is not smooth. The estimate is 1.2 waves for a sine with 1.5
periods over the range, and 1.9 for a sine with 3 periods.
"""

ZETA_3 = 1.2020569
"""zeta(3), the sum of 1 / m^3 over m = 1, 2, ..."""

CAUTION = 0.3
"""Factor applied to the logarithm of the evidence. It is below 1 because a true curve is not a draw from the process,
and because the harmonics of a small swing hardly determine the number of waves.
"""

PLAUSIBLE = 0.5
"""Smallest weight of a number of waves, relative to the largest one, at which the checks do not exclude it."""

LEAST = 1e-5
"""Smallest uncertainty of a harmonic, relative to the limit of the data sheet, so that exact harmonics can be
evaluated.
"""

ROUNDING = 1e-12
"""Fraction of a variance below which a remainder is due to rounding."""


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Harmonics of the reading of one laser in a test of a linear frame.

    `readings`, shape (n,) [m], over one period at equal steps of the phase, relative to the rest position; `found`,
    shape (m,), complex [m], are the amplitudes c_k, from order 2 on, in signal = Re(sum of c_k exp(-i k phase));
    `uncertainty`, shape (m,) [m], is the standard uncertainty of their real and imaginary parts.
    """

    readings: Array
    found: NDArray[np.complex128]
    uncertainty: Array
    _enlarged: "dict[float, Harmonics]" = field(default_factory=lambda: _none(), init=False, repr=False)

    @property
    def swing(self) -> float:
        """Span of the readings [m]."""
        return float(np.ptp(self.readings))

    def rounded(self, step: float) -> "Harmonics":
        """The harmonics with the additional uncertainty due to the `step` [m] of the readings, at most that of one
        rounding. Returns the same object for the same step.

        The scatter of the cycles does not contain this uncertainty, since all cycles are rounded alike. By the sum in
        `bench.analysis.rounding`, the mean square of the amplitude of one harmonic is zeta(3) q^3 / (pi^4 A) for a sine
        of amplitude A, half of it in each part.
        """
        swing = max(0.5 * self.swing, step, np.finfo(np.float64).tiny)
        rounding = min(sqrt(0.5 * ZETA_3 * step**3 / (pi**4 * swing)), step / sqrt(12.0))
        return self.with_uncertainty(rounding)

    def with_uncertainty(self, uncertainty: float) -> "Harmonics":
        """The harmonics with an additional standard `uncertainty` [m] of each part. Returns the same object for the
        same uncertainty, so that what is computed from it can be cached.
        """
        if uncertainty not in self._enlarged:
            self._enlarged[uncertainty] = replace(self, uncertainty=np.hypot(self.uncertainty, uncertainty))
        return self._enlarged[uncertainty]


def _none() -> dict[float, Harmonics]:
    return {}


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


@dataclass(frozen=True)
class LinearFrame:
    """The frame without the block, measured by lasers on the ground or (`grounded` False) on the table."""

    specimen: Specimen
    grounded: bool

    def readings(self, omega: float, acceleration: complex) -> tuple[complex, complex]:
        """Complex amplitudes [m] of both readings for a complex amplitude of the table's acceleration [m/s2] at `omega`
        [rad/s].
        """
        table = -acceleration / omega**2 if self.grounded else 0.0
        first, second = (acceleration * each for each in steady_response(self.specimen, omega, 1.0))
        return first + table, second + table


@dataclass(frozen=True, eq=False)
class Effect:
    """Error of a peak caused by the error e of one laser: the sum of weights * e(places). `weights` and the readings
    `places` [m] have the shape (n,).
    """

    places: Array
    weights: Array


@dataclass(frozen=True, eq=False)
class LinearityErrors:
    """Errors of the peaks in several tests: `moments` are their second moments about zero [m2], shape (tests, tests);
    `waves` is the number of waves of the curve over the range, estimated by a check or assumed.
    """

    moments: Array
    waves: float

    def scaled(self, factors: Sequence[float]) -> "LinearityErrors":
        """The errors multiplied by one factor per test."""
        return replace(self, moments=self.moments * np.outer(factors, factors))

    def draws(self, normal: Array) -> Array:
        """Random draws of the errors [m], shape (tests, n), from standard normal numbers `normal` of the same shape."""
        tests = len(self.moments)
        root = np.zeros((tests, tests))
        for i in range(tests):
            for j in range(i + 1):
                rest = self.moments[i, j] - root[i, :j] @ root[j, :j]
                # equal motions have equal errors: the second error has no independent part
                if i == j:
                    root[i, j] = sqrt(max(rest, 0.0)) if rest > ROUNDING * self.moments[i, i] else 0.0
                elif root[j, j] > 0.0:
                    root[i, j] = rest / root[j, j]
        return root @ normal


def linearity_errors(
    effects: Sequence[Effect], shares: Array, limit: float, whole: float, checks: Sequence[Harmonics] = ()
) -> LinearityErrors:
    """Errors of peaks measured by one laser with the measuring range `whole` [m] and the largest error `limit` [m].

    `shares`, shape (tests,), are the derivatives of the result with respect to the peaks: they determine the most
    unfavourable number of waves, of all or of those that `checks` do not exclude, which is then assumed; `waves` of the
    result is the mean number according to the checks. The evaluation of the checks is cached for later calls with the
    same objects.
    """
    tests = len(effects)
    if limit == 0.0:
        return LinearityErrors(np.zeros((tests, tests)), 0.0)
    places = np.concatenate([each.places for each in effects])
    weights = _rows([each.weights[None, :] for each in effects])
    waves = np.tile(WAVES, 2)
    prior = 0.5 * limit**2 * _covariances(places, weights, places, weights, whole)
    if not checks:
        worst = int(np.einsum("i,kij,j->k", shares, prior, shares).argmax())
        return LinearityErrors(prior[worst], float(waves[worst]))
    learned = _posterior(tuple(checks), limit, whole)
    crossed = 0.5 * limit**2 * _covariances(learned.places, learned.observed, places, weights, whole)
    white = learned.whitening @ crossed
    mean = np.einsum("kmi,km->ki", white, learned.measured)
    moments = prior - white.transpose(0, 2, 1) @ white + mean[:, :, None] * mean[:, None, :]
    found = exp(float(learned.likely @ np.log(waves)))
    plausible = learned.likely >= PLAUSIBLE * learned.likely.max()
    sizes = np.where(plausible, np.einsum("i,kij,j->k", shares, moments, shares), -1.0)
    return LinearityErrors(moments[int(sizes.argmax())], found)


@dataclass(frozen=True, eq=False)
class _Posterior:
    """Information from m measured harmonics about the error curve, for each of K candidates with different numbers of
    waves. `whitening`, shape (K, m, m), transforms the harmonics to independent numbers of unit variance; `measured`,
    shape (K, m), are the transformed harmonics; `likely`, shape (K,), is the weight of each candidate. `observed`,
    shape (m, n), computes the harmonics of a curve from its values at the `places`, shape (n,).
    """

    places: Array
    observed: Array
    whitening: Array
    measured: Array
    likely: Array


@lru_cache(maxsize=4)
def _posterior(checks: tuple[Harmonics, ...], limit: float, whole: float) -> _Posterior:
    places = np.concatenate([each.readings for each in checks])
    observed = _rows([_fourier(each.readings.size, each.found.size) for each in checks])
    measured = np.concatenate([np.concatenate((each.found.real, each.found.imag)) for each in checks])
    noise = np.diag(np.concatenate([np.tile(each.uncertainty, 2) for each in checks]) ** 2 + (LEAST * limit) ** 2)
    factors = np.linalg.cholesky(0.5 * limit**2 * _covariances(places, observed, places, observed, whole) + noise)
    whitening = np.asarray(np.linalg.inv(factors), dtype=np.float64)
    white = whitening @ measured
    sizes = np.log(np.diagonal(factors, axis1=1, axis2=2)).sum(axis=1)
    evidence = -0.5 * np.einsum("km,km->k", white, white) - sizes
    likely = np.exp(CAUTION * (evidence - evidence.max()))
    return _Posterior(places, observed, whitening, white, likely / likely.sum())


def _covariances(one: Array, left: Array, other: Array, right: Array, whole: float) -> Array:
    """Covariances of linear functions of the error curve, relative to its variance, shape (2 NUMBERS, l, r): the first
    NUMBERS entries are for irregular curves, the others for sines. `left`, shape (l, n), applies to the values at the
    places `one`, shape (n,), and `right`, shape (r, m), to those at `other`, shape (m,).
    """
    first = 2.0 * pi * FEWEST / whole
    distances: Array = one[:, None] - other[None, :]
    curve: Array = np.exp(-0.5 * (first * distances) ** 2)
    found = np.empty((2 * NUMBERS, left.shape[0], right.shape[0]))
    for k in range(NUMBERS):
        # this order of products is faster, because `right` has fewer rows
        found[k] = left @ (curve @ right.T)
        curve *= curve
    # covariance of a sine of random phase: the cosine of the phase difference
    angles = 2.0 * pi / whole * WAVES
    for part in (np.cos, np.sin):
        near, far = part(np.outer(angles, one)) @ left.T, part(np.outer(angles, other)) @ right.T
        sines = near[:, :, None] * far[:, None, :]
        found[NUMBERS:] = sines if part is np.cos else found[NUMBERS:] + sines
    return found


def _rows(blocks: Sequence[Array]) -> Array:
    """Block-diagonal matrix of the given blocks."""
    found = np.zeros((sum(len(each) for each in blocks), sum(each.shape[1] for each in blocks)))
    top = left = 0
    for each in blocks:
        found[top : top + len(each), left : left + each.shape[1]] = each
        top, left = top + len(each), left + each.shape[1]
    return found


@lru_cache(maxsize=8)
def _fourier(points: int, orders: int) -> Array:
    """Matrix, shape (2 * orders, points), from `points` values over one period to their cosine and sine coefficients,
    from order 2 on.
    """
    angles = np.outer(np.arange(2, 2 + orders), np.arange(points) * (2.0 * pi / points))
    return np.concatenate((np.cos(angles), np.sin(angles))) * (2.0 / points)
