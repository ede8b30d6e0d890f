"""Linearity error of a laser whose shape is unknown, and the errors of measured peaks that it causes.

A data sheet states the largest error over the measuring range, not its shape. The error is modelled as a Gaussian
process of the reading at the height of the data sheet, with the squared exponential covariance of an irregular curve,
or as a sine of random phase; the number of waves over the range is unknown. Without further information the curve or
sine with the largest effect is assumed.

The bare frame is a running check: it is linear and driven by a sine, so that the readings of a linear laser have no
harmonics but the small ones of the table. The harmonics of a reading x(phase) are those of its error e(x(phase)): for a
pure sine they are the Chebyshev coefficients of the curve over the swing. The posterior of the curve given the
harmonics is that of Gaussian process regression (Rasmussen and Williams, 2006, section 2.2), averaged over the numbers
of waves by their evidence (section 5.2). A lower height is not assumed, since a small swing shows neither the height
nor the number of waves alone. Its mean is not subtracted from the result: it is part of the uncertainty as an
uncorrected effect (GUM F.2.4.5).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import exp, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from sim.linear import steady_response
from sim.specimen import Specimen

Array = NDArray[np.float64]

FEWEST, NUMBERS = 0.25, 13
WAVES: Array = np.array([FEWEST * 2.0 ** (0.5 * k) for k in range(NUMBERS)])
"""Numbers of waves within the measuring range, from 0.25 to 16. Fewer are a scale error, which tests share; more are
averaged over a swing. They grow by the root of 2, so that the exponent of the covariance doubles.
"""

SMOOTH = 1.5
"""Waves above which a linearity error is not smooth. A sine of 1.5 periods over the range is found to have 1.2 waves,
one of 3 to have 1.9.
"""

ZETA_3 = 1.2020569
"""Sum of 1 / m^3."""

CAUTION = 0.3
"""Share of the logarithm of the evidence that counts: no curve is a draw of the process, and the harmonics of a small
swing hardly tell their number.
"""

LEAST = 1e-5
"""Smallest uncertainty of a harmonic, relative to the limit of the data sheet; it admits exact harmonics."""

ROUNDING = 1e-12
"""Smallest share of a variance that is not due to rounding."""


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Harmonics of the reading of one laser in a test of a linear frame.

    `readings`, shape (n,) [m], over one period at equal steps of the phase, relative to the rest; `found`, shape (m,),
    complex [m], are those of the orders from 2, as signal = Re(sum of c_k exp(-i k phase)); `uncertainty`, (m,) [m],
    that of the real and the imaginary part.
    """

    readings: Array
    found: NDArray[np.complex128]
    uncertainty: Array

    @lru_cache(maxsize=64)  # noqa: B019 - few objects, which serve many gains
    def rounded(self, step: float) -> "Harmonics":
        """The harmonics with the uncertainty due to readings in steps [m], at most that of one rounding; the same
        object for the same step.

        It is not in the scatter, since all cycles are rounded alike: see `bench.analysis.gain.PEAK_ROUNDINGS`, of which
        one harmonic has 2 zeta(3) q^3 / (pi^4 A), half of it in each part.
        """
        swing = max(0.5 * float(np.ptp(self.readings)), step, np.finfo(np.float64).tiny)
        rounding = min(sqrt(ZETA_3 * step**3 / (pi**4 * swing)), step / sqrt(12.0))
        return self.widened(rounding)

    @lru_cache(maxsize=64)  # noqa: B019 - as above
    def widened(self, uncertainty: float) -> "Harmonics":
        """The harmonics with a further standard uncertainty [m] of each part; the same object for the same one."""
        return replace(self, uncertainty=np.hypot(self.uncertainty, uncertainty))


Checks = tuple[Harmonics, Harmonics]
"""Harmonics of both lasers in one test."""


@dataclass(frozen=True)
class LinearFrame:
    """The frame without block, seen by lasers on the ground or (`grounded` False) on the table."""

    specimen: Specimen
    grounded: bool

    def readings(self, omega: float, acceleration: complex) -> tuple[complex, complex]:
        """Complex amplitudes [m] of both readings under that of the table [m/s2] at `omega` [rad/s]."""
        table = -acceleration / omega**2 if self.grounded else 0.0
        first, second = (acceleration * each for each in steady_response(self.specimen, omega, 1.0))
        return first + table, second + table


@dataclass(frozen=True, eq=False)
class Effect:
    """Error of a peak caused by the error e of one laser: sum of `weights` e(`places` [m]), shapes (n,)."""

    places: Array
    weights: Array


@dataclass(frozen=True, eq=False)
class LinearityErrors:
    """Second moments of the errors of peaks [m2], shape (tests, tests), about zero; `waves` of the curve over the
    range, as found by a check or as assumed.
    """

    moments: Array
    waves: float

    def draws(self, normal: Array) -> Array:
        """Errors [m], shape (tests, n), from standard normal numbers of that shape."""
        tests = len(self.moments)
        root = np.zeros((tests, tests))
        for i in range(tests):
            for j in range(i + 1):
                rest = self.moments[i, j] - root[i, :j] @ root[j, :j]
                # equal motions have equal errors: nothing remains of the second
                if i == j:
                    root[i, j] = sqrt(max(rest, 0.0)) if rest > ROUNDING * self.moments[i, i] else 0.0
                elif root[j, j] > 0.0:
                    root[i, j] = rest / root[j, j]
        return root @ normal


def linearity_errors(
    effects: Sequence[Effect], shares: Array, limit: float, whole: float, checks: Sequence[Harmonics] = ()
) -> LinearityErrors:
    """Errors of peaks measured by one laser of the range `whole` [m] and the largest error `limit` [m].

    `shares`, shape (tests,), are the derivatives of the result with respect to the peaks: they select the worst number
    of waves where there is no check. What the checks tell is kept for later calls with the same objects.
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
    learned = _learned(tuple(checks), limit, whole)
    crossed = 0.5 * limit**2 * _covariances(learned.places, learned.observed, places, weights, whole)
    white = learned.whitening @ crossed
    mean = np.einsum("kmi,km->ki", white, learned.measured)
    moments = prior - white.transpose(0, 2, 1) @ white + mean[:, :, None] * mean[:, None, :]
    found = exp(float(learned.likely @ np.log(waves)))
    return LinearityErrors(np.einsum("k,kij->ij", learned.likely, moments), found)


@dataclass(frozen=True, eq=False)
class _Learned:
    """What m harmonics tell of the curve, for each of K numbers of waves: `whitening`, shape (K, m, m), makes them
    independent with unit variance, `measured`, (K, m), are then their values, and `likely`, (K,), is the weight of each
    number. `observed`, (m, n), gives the harmonics of a curve at the `places` (n,).
    """

    places: Array
    observed: Array
    whitening: Array
    measured: Array
    likely: Array


@lru_cache(maxsize=32)
def _learned(checks: tuple[Harmonics, ...], limit: float, whole: float) -> _Learned:
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
    return _Learned(places, observed, whitening, white, likely / likely.sum())


def _covariances(one: Array, left: Array, other: Array, right: Array, whole: float) -> Array:
    """Covariances of linear functions of the curve, `left` (l, n) of its values at the places `one` (n,) and `right`
    (r, m) of those at `other` (m,), relative to the variance; shape (2 NUMBERS, l, r), irregular curves before sines.
    """
    first = 2.0 * pi * FEWEST / whole
    distances: Array = one[:, None] - other[None, :]
    curve: Array = np.exp(-0.5 * (first * distances) ** 2)
    found = np.empty((2 * NUMBERS, left.shape[0], right.shape[0]))
    for k in range(NUMBERS):
        # there are fewer rows on the right
        found[k] = left @ (curve @ right.T)
        curve *= curve
    # a sine has equal errors at places a wave apart
    angles = 2.0 * pi / whole * WAVES
    for part in (np.cos, np.sin):
        near, far = part(np.outer(angles, one)) @ left.T, part(np.outer(angles, other)) @ right.T
        sines = near[:, :, None] * far[:, None, :]
        found[NUMBERS:] = sines if part is np.cos else found[NUMBERS:] + sines
    return found


def _rows(blocks: Sequence[Array]) -> Array:
    """Matrix with the blocks on its diagonal."""
    found = np.zeros((sum(len(each) for each in blocks), sum(each.shape[1] for each in blocks)))
    top = left = 0
    for each in blocks:
        found[top : top + len(each), left : left + each.shape[1]] = each
        top, left = top + len(each), left + each.shape[1]
    return found


@lru_cache(maxsize=8)
def _fourier(points: int, orders: int) -> Array:
    """Cosine and sine coefficients of the orders from 2 of a period of `points`, shape (2 orders, points)."""
    angles = np.outer(np.arange(2, 2 + orders), np.arange(points) * (2.0 * pi / points))
    return np.concatenate((np.cos(angles), np.sin(angles))) * (2.0 / points)
