"""Error curves of both lasers as random functions, and their posterior given observations of them.

The curves are random functions as in `bench.analysis.error_curve`, for each pair of candidates for the two lasers; a
pair is weighted by a power of its evidence. They are splines through their values at readings `SPACING` apart, of which
observations are linear functions, so that mean and covariance of the curves follow from Gaussian process regression
(Rasmussen and Williams, 2006, section 2.2).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bench.analysis.curve_observations import Observations
from bench.analysis.error_curve import NUMBERS, WAVES, likelihoods, prior
from bench.analysis.linearity import Effect, LinearityErrors

Array = NDArray[np.float64]
Basis = Callable[[Array], Array]
"""Function that gives the values of the basis functions of a curve, shape (n, k), at readings [m], shape (k,)."""

SPACING = 1.0 / 80.0
"""Distance between the values of a curve, relative to the measuring range: five for the shortest wave."""

FLEXIBLE = 10
"""Candidate with which the noise is estimated: an irregular curve with eight waves."""

LIKELY = 1e-3
"""Smallest weight of a pair of candidates relative to the largest that is not neglected."""

FINER = 2
"""Number of sines for each factor of sqrt(2) between numbers of waves where the evidence counts in full: it then
distinguishes numbers that differ by less. With one, 87 instead of 96 % of the intervals of drawn lasers with 3 to 6
waves contain the gain of a free motion (15 rad/s, beta 0.97).
"""


@dataclass(frozen=True, eq=False)
class LaserCurves:
    """Errors of both lasers as functions of their readings relative to rest.

    `places` are the readings [m] at which the curves are described, shapes (n,) and (m,). `mean`, shape (n + m + 1,),
    and `covariance` are those of the errors there [m], of laser 1 and of laser 2, and of the scale of laser 2 relative
    to that of laser 1. `noise` [m] is the rms standard deviation of an equation.
    """

    places: tuple[Array, Array]
    mean: Array
    covariance: Array
    noise: float

    def expected(self, laser: int, readings: Array) -> Array:
        """Expected errors [m] of laser 0 or 1 at `readings` [m], minus that at rest; same shape, NaN stays NaN."""
        places, curve = self.places[laser], self._curves[laser]
        scale = 0.0 if laser == 0 else float(self.mean[-1])
        found = np.full(readings.shape, np.nan)
        known = np.isfinite(readings)
        found[known] = curve(np.clip(readings[known], places[0], places[-1])) - curve(np.zeros(1))
        return found + scale * readings

    def bend(self, laser: int) -> float:
        """Largest deviation of the expected errors of laser 0 or 1 from a straight line, less their expanded
        uncertainty [m]; at least zero.
        """
        places, n = self.places[laser], self.places[0].size
        errors = self.expected(laser, places)
        straight = np.stack((places, np.ones(places.size)), axis=1)
        variances = np.diag(self.covariance)[:n] if laser == 0 else np.diag(self.covariance)[n:-1]
        deviations = np.abs(errors - straight @ np.linalg.lstsq(straight, errors, rcond=None)[0])
        return max(float((deviations - 2.0 * np.sqrt(np.maximum(variances, 0.0))).max()), 0.0)

    def errors(self, effects: Sequence[tuple[Effect | None, Effect | None]]) -> LinearityErrors:
        """Errors of quantities of corrected readings, each with the effects on it of the errors of both lasers, None
        for none.
        """
        rows = np.array([np.concatenate([self._row(k, each) for k, each in enumerate(pair)]) for pair in effects])
        return LinearityErrors(rows @ self.covariance @ rows.T, 0.0)

    @cached_property
    def _bases(self) -> tuple[Basis, Basis]:
        return _basis(self.places[0]), _basis(self.places[1])

    @cached_property
    def _curves(self) -> tuple[Basis, Basis]:
        n = self.places[0].size
        return _spline(self.places[0], self.mean[:n]), _spline(self.places[1], self.mean[n:-1])

    def _row(self, laser: int, effect: Effect | None) -> Array:
        places = self.places[laser]
        if effect is None:
            return np.zeros(places.size + laser)
        row = self._bases[laser](effect.places) @ effect.weights
        return row if laser == 0 else np.append(row, effect.weights @ effect.places)


@dataclass(frozen=True, eq=False)
class Candidates:
    """Candidates for the curves of both lasers: prior covariances of the values at `places` [m2], shapes (K, n, n) and
    (K, m, m), with the prior weights `possible`, shape (K,), which are multiplied by the power `caution` of their
    evidence.
    """

    places: tuple[Array, Array]
    priors: tuple[Array, Array]
    possible: Array
    caution: float

    @classmethod
    def over(
        cls,
        readings: tuple[Array, Array],
        limits: tuple[float, float],
        ranges: tuple[float, float],
        caution: float,
    ) -> "Candidates":
        """Candidates over the `readings` of both lasers, NaN where missing, with the largest linearity errors `limits`
        and the measuring ranges `ranges` [m].
        """
        finer = FINER if caution == 1.0 else 1
        sines = WAVES[0] * 2.0 ** (0.5 / finer * np.arange(finer * (NUMBERS - 1) + 1))
        first, second = (_places(each, SPACING * whole) for each, whole in zip(readings, ranges, strict=True))
        one, other = (
            prior(places, np.eye(places.size), places, np.eye(places.size), limit, whole, sines=sines)
            for places, limit, whole in zip((first, second), limits, ranges, strict=True)
        )
        possible = np.concatenate((np.ones(NUMBERS), np.full(sines.size, 1.0 / finer)))
        return cls((first, second), (one, other), possible, caution)

    @property
    def bases(self) -> tuple[Basis, Basis]:
        """Basis functions of both curves."""
        return _basis(self.places[0]), _basis(self.places[1])

    @property
    def flexible(self) -> tuple[Array, Array]:
        """Prior covariances of curves with which the noise is estimated."""
        return self.priors[0][FLEXIBLE], self.priors[1][FLEXIBLE]

    def curves(self, observed: Observations, scales: Array, further: Array | None = None) -> LaserCurves:
        """The curves according to observations of the values of both, of the scale of laser 2 relative to that of laser
        1, and of further unknowns, relative to `scales`, their units, shape (unknowns,).

        The prior standard deviations of the scale and of further unknowns are 1, or `further`, shape (S, unknowns
        besides the curves): any of S possibilities, which have equal prior weights.
        """
        mean, covariance = self._posterior(observed, further)
        units = scales[: mean.size]
        noise = float(np.sqrt(np.mean(observed.noise**2)))
        return LaserCurves(self.places, units * mean, np.outer(units, units) * covariance, noise)

    def _posterior(self, observed: Observations, further: Array | None) -> tuple[Array, Array]:
        """Mean and covariance of the values of both curves and of the scale."""
        first, second = self.priors
        n, known = first.shape[1], first.shape[1] + second.shape[1] + 1
        rows, beside = observed.rows[:, :known], observed.rows[:, known - 1 :]
        spreads = np.ones((1, beside.shape[1])) if further is None else further
        crossed = [rows[:, :n] @ first, np.tile(rows[:, n:-1] @ second, (len(spreads), 1, 1))]
        own = crossed[0] @ rows[:, :n].T
        loose = np.array([(each * beside) @ (each * beside).T for each in spreads])
        others = crossed[1] @ rows[:, n:-1].T + np.repeat(loose, len(second), axis=0)
        others = others + np.diag(observed.noise**2)
        factors = np.linalg.cholesky(own[:, None] + others[None])
        white = np.linalg.solve(factors, np.broadcast_to(observed.values[:, None], (*factors.shape[:3], 1)))[..., 0]
        possible = np.outer(self.possible, np.tile(self.possible, len(spreads)))
        likely = possible * likelihoods(factors, white, self.caution)
        likely /= likely.max()
        likely = np.where(likely >= LIKELY, likely, 0.0)
        likely /= likely.sum()
        one, other = np.nonzero(likely)
        weights, inverse = likely[one, other], np.linalg.inv(factors[one, other])
        scale = np.repeat(spreads[:, 0] ** 2, len(second))
        parts = (
            inverse @ crossed[0][one],
            inverse @ crossed[1][other],
            inverse @ rows[:, -1:] * scale[other, None, None],
        )
        across = np.concatenate(parts, axis=2)
        expected = np.einsum("pki,pk->pi", across, white[one, other])
        mean = weights @ expected
        reduced = (np.sqrt(weights)[:, None, None] * across).reshape(-1, rows.shape[1])
        covariance = expected.T @ (weights[:, None] * expected) - np.outer(mean, mean) - reduced.T @ reduced
        covariance[:n, :n] += np.einsum("k,kij->ij", likely.sum(axis=1), first)
        covariance[n:-1, n:-1] += np.einsum(
            "k,kij->ij", likely.sum(axis=0).reshape(len(spreads), -1).sum(axis=0), second
        )
        covariance[-1, -1] += likely.sum(axis=0) @ scale
        return mean, covariance


def _places(readings: Array, spacing: float) -> Array:
    """Readings at which a curve is described, over the span of the `readings` and beyond its ends [m]; NaN where they
    are missing.
    """
    low, high = float(np.nanmin(readings)) - spacing, float(np.nanmax(readings)) + spacing
    return np.linspace(low, high, max(int(np.ceil((high - low) / spacing)) + 1, 6))


def _spline(places: Array, values: Array) -> Callable[[Array], Array]:
    from scipy.interpolate import CubicSpline

    return CubicSpline(places, values)


def _basis(places: Array) -> Callable[[Array], Array]:
    curves = _spline(places, np.eye(places.size))
    return lambda readings: curves(np.clip(readings, places[0], places[-1])).T
