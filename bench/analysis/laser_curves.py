"""Error curves of both lasers, from the equations that the second storey gives in every test.

The curves are random functions as in `bench.analysis.error_curve`, for each pair of candidates for the two lasers; a
pair is weighted by a power of its evidence. They are splines through their values at readings `SPACING` apart, of which
the equations (`bench.analysis.storey_equations`, `bench.analysis.curve_observations`) are linear functions, so that
mean and covariance of the curves follow from Gaussian process regression (Rasmussen and Williams, 2006, section 2.2).

Equations relate the two lasers with each other: of errors in proportion to the reading they tell the difference only,
which is that of the scales. What both have in common changes all drifts alike, and the residuals with them: readings
that are all error would leave none. That is no sign of errors, so the common proportion has no part in the equations.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.curve_observations import Observations, observations, without_noise_in_rows
from bench.analysis.error_curve import CAUTION, NUMBERS, WAVES, block_diagonal, likelihoods, prior
from bench.analysis.linearity import Effect, LinearFrame, LinearityErrors
from bench.analysis.signals import LASER_1, LASER_2
from bench.analysis.storey_equations import KEPT, Equations, StoreyMotion, storey_motion

Array = NDArray[np.float64]

SPACING = 1.0 / 80.0
"""Distance between the values of a curve, relative to the measuring range: five for the shortest wave."""

FLEXIBLE = 10
"""Candidate with which the noise is estimated: an irregular curve with eight waves."""

FEWEST = 4
"""Minimum number of blocks of a test."""

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
        places, n = self.places[laser], self.places[0].size
        values, scale = (self.mean[:n], 0.0) if laser == 0 else (self.mean[n:-1], float(self.mean[-1]))
        curve = _spline(places, values)
        found = np.full(readings.shape, np.nan)
        known = np.isfinite(readings)
        found[known] = curve(np.clip(readings[known], places[0], places[-1])) - curve(np.zeros(1))
        return found + scale * readings

    def bend(self, laser: int) -> float:
        """Largest deviation of the expected errors of laser 0 or 1 from a straight line [m]."""
        places = self.places[laser]
        errors = self.expected(laser, places)
        straight = np.stack((places, np.ones(places.size)), axis=1)
        return float(np.abs(errors - straight @ np.linalg.lstsq(straight, errors, rcond=None)[0]).max())

    def errors(self, effects: Sequence[tuple[Effect | None, Effect | None]]) -> LinearityErrors:
        """Errors of quantities of corrected readings, each with the effects on it of the errors of both lasers, None
        for none.
        """
        rows = np.array([np.concatenate([self._row(k, each) for k, each in enumerate(pair)]) for pair in effects])
        return LinearityErrors(rows @ self.covariance @ rows.T, 0.0)

    def _row(self, laser: int, effect: Effect | None) -> Array:
        places = self.places[laser]
        if effect is None:
            return np.zeros(places.size + laser)
        row = _basis(places)(effect.places) @ effect.weights
        return row if laser == 0 else np.append(row, effect.weights @ effect.places)


def laser_curves(
    tests: Sequence[Array],
    frame: LinearFrame,
    sample_rate: float,
    limits: tuple[float, float],
    ranges: tuple[float, float],
    mismatch: float,
    block: float,
    caution: float = CAUTION,
) -> LaserCurves | None:
    """Curves according to the signals of `tests` with the same lasers, shape (n, len(SIGNALS)) each, of a `frame` with
    or without block; None if no test has a strong motion that is long and complete enough, or if the motions tell
    nothing of the errors.

    `limits` are the largest linearity errors and `ranges` the measuring ranges of the lasers [m]; `mismatch` is the
    standard uncertainty of the ratio of their scales. Residuals may be correlated within `block` seconds. Pairs of
    candidates are weighted by the power `caution` of their evidence.
    """
    moved = [found for each in tests if (found := storey_motion(each, frame, sample_rate)) is not None]
    if not moved or 0.0 in limits:
        return None
    # also those of tests without equations, whose peaks are corrected as well
    first, second = (
        _places(np.concatenate([each[:, column] for each in tests]), SPACING * whole)
        for column, whole in zip((LASER_1, LASER_2), ranges, strict=True)
    )
    bases = _basis(first), _basis(second)
    found = [each.equations(bases) for each in moved]
    rows, slopes = _joined(found)
    values = np.concatenate([each.values for each in found])
    scales = np.ones(rows.shape[1])
    scales[first.size + second.size] = mismatch
    # the readings themselves as errors
    alike = np.zeros(rows.shape[1])
    alike[: first.size + second.size] = np.concatenate((first, second))
    rows, slopes = (scales * each - np.outer(each @ alike, alike / (alike @ alike)) for each in (rows, slopes))
    finer = FINER if caution == 1.0 else 1
    sines = WAVES[0] * 2.0 ** (0.5 / finer * np.arange(finer * (NUMBERS - 1) + 1))
    possible = np.concatenate((np.ones(NUMBERS), np.full(sines.size, 1.0 / finer)))
    priors = [
        prior(places, np.eye(places.size), places, np.eye(places.size), limit, whole, sines=sines)
        for places, limit, whole in zip((first, second), limits, ranges, strict=True)
    ]
    flexible = priors[0][FLEXIBLE], priors[1][FLEXIBLE]
    observed = observations(rows, values, sum(each.removed for each in found), _blocks(moved, block), flexible)
    if not observed.values.size:
        return None
    ends = np.cumsum([each.values.size for each in found]).tolist()
    observed = without_noise_in_rows(observed, rows, values, slopes, ends)
    mean, covariance = _posterior(observed, priors[0], priors[1], possible, caution)
    noise = float(np.sqrt(np.mean(observed.noise**2)))
    scales = scales[: mean.size]
    return LaserCurves((first, second), scales * mean, np.outer(scales, scales) * covariance, noise)


def _joined(found: Sequence[Equations]) -> tuple[Array, Array]:
    """Rows of all tests and their slopes, shapes (equations, unknowns) and (tests, unknowns). The unknowns are those of
    the curves, the scale, and the changes of the second storey in each test.
    """
    rows, slopes = np.concatenate([each.rows for each in found]), np.array([each.slopes for each in found])
    own = block_diagonal([each.own for each in found])
    own_slopes = block_diagonal([each.own_slopes[None] for each in found])
    return np.concatenate((rows, own), axis=1), np.concatenate((slopes, own_slopes), axis=1)


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


def _blocks(moved: Sequence[StoreyMotion], block: float) -> NDArray[np.intp]:
    """Index of the first equation of each block, in all tests."""
    firsts, before = list[NDArray[np.intp]](), 0
    for each in moved:
        size = max(min(round(block * each.rate / KEPT), each.kept.size // FEWEST), 1)
        firsts.append(before + np.arange(0, each.kept.size, size))
        before += each.kept.size
    return np.concatenate(firsts)


def _posterior(
    observed: Observations, first: Array, second: Array, possible: Array, caution: float
) -> tuple[Array, Array]:
    """Mean and covariance of the values of both curves and of the scale, for the prior covariances of the candidates
    for the lasers, shapes (K, n, n) and (K, m, m), and their prior weights `possible`, shape (K,), which are multiplied
    by the power `caution` of their evidence. The prior standard deviation of the scale and of further unknowns is 1.
    """
    n, known = first.shape[1], first.shape[1] + second.shape[1] + 1
    rows, further = observed.rows[:, :known], observed.rows[:, known - 1 :]
    crossed = [rows[:, :n] @ first, rows[:, n:-1] @ second]
    own = crossed[0] @ rows[:, :n].T
    others = crossed[1] @ rows[:, n:-1].T + further @ further.T
    others = others + np.diag(observed.noise**2)
    factors = np.linalg.cholesky(own[:, None] + others[None])
    white = np.linalg.solve(factors, np.broadcast_to(observed.values[:, None], (*factors.shape[:3], 1)))[..., 0]
    likely = np.outer(possible, possible) * likelihoods(factors, white, caution)
    likely /= likely.max()
    likely = np.where(likely >= LIKELY, likely, 0.0)
    likely /= likely.sum()
    one, other = np.nonzero(likely)
    weights, inverse = likely[one, other], np.linalg.inv(factors[one, other])
    parts = inverse @ crossed[0][one], inverse @ crossed[1][other], inverse @ rows[:, -1:]
    across = np.concatenate(parts, axis=2)
    expected = np.einsum("pki,pk->pi", across, white[one, other])
    mean = weights @ expected
    reduced = (np.sqrt(weights)[:, None, None] * across).reshape(-1, rows.shape[1])
    covariance = expected.T @ (weights[:, None] * expected) - np.outer(mean, mean) - reduced.T @ reduced
    covariance[:n, :n] += np.einsum("k,kij->ij", likely.sum(axis=1), first)
    covariance[n:-1, n:-1] += np.einsum("k,kij->ij", likely.sum(axis=0), second)
    covariance[-1, -1] += 1.0
    return mean, covariance
