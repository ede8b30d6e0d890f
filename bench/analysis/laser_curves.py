"""Error curves of both lasers, from the equations that the second storey gives in every test.

The curves are random functions as in `bench.analysis.error_curve`, for each pair of candidates for the two lasers; a
pair is weighted by a power of its evidence. They are splines through their values at readings `SPACING`
apart, of which the equations (`bench.analysis.storey_equations`) are linear functions, so that mean and covariance of
the curves follow from Gaussian process regression (Rasmussen and Williams, 2006, section 2.2).

The variance of an equation is the one with the largest evidence for flexible curves. It is enlarged by the ratio of
what the residuals of whole blocks contribute to what independent residuals would: errors of the model, which are
correlated, count as noise.

Equations relate the two lasers with each other: of errors in proportion to the reading they tell the difference only,
which is that of the scales. What both have in common changes all drifts alike, and the residuals with them: readings
that are all error would leave none. That is no sign of errors, so the common proportion has no part in the equations.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.error_curve import likelihoods, prior
from bench.analysis.linearity import Effect, LinearFrame, LinearityErrors
from bench.analysis.signals import LASER_1, LASER_2
from bench.analysis.storey_equations import KEPT, StoreyMotion, storey_motion

Array = NDArray[np.float64]

SPACING = 1.0 / 80.0
"""Distance between the values of a curve, relative to the measuring range: five for the shortest wave."""

FLEXIBLE = 10
"""Candidate with which the noise is estimated: an irregular curve with eight waves."""

FEWEST = 4
"""Minimum number of blocks of a test."""

ROUNDING = 1e-10
"""Relative size of a combination below which it is due to rounding."""

USEFUL, LIKELY = 1e-3, 1e-3
"""Smallest variance of an observation relative to its noise, and smallest weight of a pair relative to the largest,
that are not neglected."""

NOISES: Array = np.geomspace(1e-8, 1e-3, 240)
"""Standard deviations of an equation that are compared [m]."""


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
) -> LaserCurves | None:
    """Curves according to the signals of `tests` with the same lasers, shape (n, len(SIGNALS)) each, of a `frame` with
    or without block; None if no test has a strong motion that is long and complete enough, or if the motions tell
    nothing of the errors.

    `limits` are the largest linearity errors and `ranges` the measuring ranges of the lasers [m]; `mismatch` is the
    standard uncertainty of the ratio of their scales. Residuals may be correlated within `block` seconds.
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
    rows, values = (np.concatenate([each[k] for each in found]) for k in (0, 1))
    removed = sum(each[2] for each in found)
    rows[:, -1] *= mismatch
    # the readings themselves as errors: a row times them is its value
    alike = np.concatenate((first, second, [0.0]))
    rows -= np.outer(values, alike / (alike @ alike))
    priors = [
        prior(places, np.eye(places.size), places, np.eye(places.size), limit, whole)
        for places, limit, whole in zip((first, second), limits, ranges, strict=True)
    ]
    observed = _observed(rows, values, removed, _blocks(moved, block), priors[0][FLEXIBLE], priors[1][FLEXIBLE])
    if not observed.values.size:
        return None
    mean, covariance = _posterior(observed, priors[0], priors[1])
    sizes = np.append(np.ones(mean.size - 1), mismatch)
    return LaserCurves(
        (first, second), sizes * mean, np.outer(sizes, sizes) * covariance, float(np.sqrt(np.mean(observed.noise**2)))
    )


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


@dataclass(frozen=True, eq=False)
class _Observed:
    """Independent combinations of the equations: `rows`, shape (k, n + m + 1), and `values`, shape (k,), with the
    standard deviations `noise`, shape (k,) [m].
    """

    rows: Array
    values: Array
    noise: Array


def _observed(
    rows: Array, values: Array, removed: int, blocks: NDArray[np.intp], first: Array, second: Array
) -> _Observed:
    """The useful combinations of the equations, from which `removed` columns were projected out. Their noise is
    estimated for curves with the prior covariances `first` and `second`.
    """
    left, sizes, right = np.linalg.svd(rows, full_matrices=False)
    present = sizes > ROUNDING * sizes[0]
    left, sizes, right = left[:, present], sizes[present], right[present]
    combined, seen = sizes[:, None] * right, left.T @ values
    n = len(first)
    prior = combined[:, :n] @ first @ combined[:, :n].T + combined[:, n:-1] @ second @ combined[:, n:-1].T
    variances, turned = np.linalg.eigh(prior + np.outer(combined[:, -1], combined[:, -1]))
    variances = np.maximum(variances, 0.0)
    left, combined, seen = left @ turned, turned.T @ combined, turned.T @ seen
    beside, free = max(float(values @ values - seen @ seen), 0.0), values.size - removed - seen.size
    spread = variances + NOISES[:, None] ** 2
    evidence = -0.5 * (np.sum(seen**2 / spread + np.log(spread), axis=1) + beside / NOISES**2) - free * np.log(NOISES)
    noise = np.full(seen.size, NOISES[evidence.argmax()])
    # residuals of curves that follow correlated errors less closely show more of them
    for _ in range(2):
        noise = np.maximum(noise, _correlated(left, seen, values, blocks, variances, noise))
    useful = variances > USEFUL * noise**2
    return _Observed(combined[useful], seen[useful], noise[useful])


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


def _posterior(observed: _Observed, first: Array, second: Array) -> tuple[Array, Array]:
    """Mean and covariance of the values of both curves and of the scale, whose prior standard deviation is 1, for the
    prior covariances of the candidates for the lasers, shapes (K, n, n) and (K, m, m).
    """
    n, rows = first.shape[1], observed.rows
    crossed = [rows[:, :n] @ first, rows[:, n:-1] @ second]
    own = crossed[0] @ rows[:, :n].T
    others = crossed[1] @ rows[:, n:-1].T + np.outer(rows[:, -1], rows[:, -1])
    others = others + np.diag(observed.noise**2)
    factors = np.linalg.cholesky(own[:, None] + others[None])
    white = np.linalg.solve(factors, np.broadcast_to(observed.values[:, None], (*factors.shape[:3], 1)))[..., 0]
    likely = likelihoods(factors, white)
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
