"""Errors of measured peaks due to the linearity errors of the lasers.

Without further information about the error curve (`bench.analysis.error_curve`), the number of waves with the largest
effect is assumed, for an irregular curve or a sine. Tests of the bare frame, which is linear and driven by a sine,
check the lasers: the harmonics of the readings give each number of waves a weight, and a posterior of the curve. The
moments of the errors are then the weighted mean over the numbers of waves (law of total variance).

Readings may be corrected by the weighted mean of the posterior means (`expected_errors`); the remaining errors are the
deviations from it. If they are not, it is part of the uncertainty, as an uncorrected effect (GUM F.2.4.5).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, sqrt

import numpy as np
from numpy.typing import NDArray

from bench.analysis.error_curve import WAVES, Harmonics, block_diagonal, posterior, prior
from sim.linear import steady_response
from sim.specimen import Specimen

Array = NDArray[np.float64]

SMOOTH = 1.5
"""Estimated number of waves above which a linearity error is not smooth. The estimate is 1.2 waves for a sine with 1.5
periods over the range, and 1.9 for a sine with 3 periods.
"""

ROUNDING = 1e-12
"""Fraction of a variance below which a remainder is due to rounding."""


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

    @property
    def reversed(self) -> "Effect":
        """The effect on the negative of the peak."""
        return Effect(self.places, -self.weights)


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
    effects: Sequence[Effect],
    shares: Array,
    limit: float,
    whole: float,
    checks: Sequence[Harmonics] = (),
    corrected: bool = False,
) -> LinearityErrors:
    """Errors of peaks measured by one laser with the measuring range `whole` [m] and the largest error `limit` [m].

    `shares`, shape (tests,), are the derivatives of the result with respect to the peaks: without `checks` they
    determine the most unfavourable number of waves, which is then assumed. With `checks`, `moments` and `waves` of the
    result are means over all numbers, weighted by the evidence. With `corrected`, the errors are those of readings from
    which `expected_errors` were subtracted. The evaluation of the checks is cached for later calls with the same
    objects.
    """
    tests = len(effects)
    if limit == 0.0:
        return LinearityErrors(np.zeros((tests, tests)), 0.0)
    places = np.concatenate([each.places for each in effects])
    weights = block_diagonal([each.weights[None, :] for each in effects])
    waves = np.tile(WAVES, 2)
    if not checks:
        alone = prior(places, weights, places, weights, limit, whole)
        worst = int(np.einsum("i,kij,j->k", shares, alone, shares).argmax())
        return LinearityErrors(alone[worst], float(waves[worst]))
    learned = posterior(tuple(checks), limit, whole)
    alone = prior(places, weights, places, weights, limit, whole, learned.scale)
    crossed = prior(learned.places, learned.observed, places, weights, limit, whole, learned.scale)
    white = learned.whitening @ crossed
    mean = np.einsum("kmi,km->ki", white, learned.measured)
    if corrected:
        mean = mean - learned.likely @ mean
    moments = alone - white.transpose(0, 2, 1) @ white + mean[:, :, None] * mean[:, None, :]
    found = exp(float(learned.likely @ np.log(waves)))
    return LinearityErrors(np.einsum("k,kij->ij", learned.likely, moments), found)


def expected_errors(places: Array, limit: float, whole: float, checks: Sequence[Harmonics]) -> Array:
    """Expected errors [m] of one laser according to the `checks`, at readings `places` [m] relative to the rest
    position, minus that at rest; shape (n,). `limit` and `whole` are those of `linearity_errors`.
    """
    if limit == 0.0:
        return np.zeros(places.size)
    learned = posterior(tuple(checks), limit, whole)
    read = np.append(places, 0.0)
    crossed = prior(learned.places, learned.observed, read, np.eye(read.size), limit, whole, learned.scale)
    means = np.einsum("kmi,km->ki", learned.whitening @ crossed, learned.measured)
    expected = learned.likely @ means
    return expected[:-1] - expected[-1]
