"""Dominant pair of multipliers of a motion near a periodic motion, from the Fourier coefficients of successive cycles.

Near the periodic motion, the coefficients of cycle n are

    y_n = y* + sum over k of Re(c_k mu_k^n) + noise,

where y*, the vectors c_k, and one or two complex multipliers mu_k are unknown. All are fitted to the whole series at
once: unlike a regression of each cycle on its predecessor, the fit is not biased by noise of the predecessor. For given
multipliers the problem is linear, so that only these are iterated (variable projection, Golub and Pereyra, SIAM J.
Numer. Anal. 10, 1973); the matrix pencil (Hua and Sarkar, IEEE Trans. ASSP 38, 1990) provides their initial values.
"""

from dataclasses import dataclass, replace
from math import log, pi

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SHORTEST, TWICE = 16, 24
"""Minimum number of cycles for a fit of one pair, and of two pairs."""

BOUND = 0.15
"""Largest deviation of a cycle from the periodic motion, relative to the latter, for which the map is regarded as
linear.
"""

EVIDENCE = 20.0
"""Decrease of the Bayesian information criterion above which the fit with a second pair is used."""

SIGNIFICANT = 3.0
"""Smallest norm of the contribution of a significant pair to the series, relative to that expected from noise alone."""

SHARE = 0.2
"""Smallest contribution of a pair to the series, relative to that of the larger pair, for which it may be the dominant
one.
"""

PENCIL = 3
"""Ratio of the number of cycles to the row length of the matrix pencil."""

RATIOS = np.geomspace(1e-4, 1e2, 31)
"""Ratios of the variances of excitation and scatter, of which the mean is formed."""

PRIOR = 0.25
"""Power of a ratio to which its prior probability is proportional: between 0, with which most of the excitation is
missed where few cycles show it, and 1/2 (the standard deviation has a uniform density), with which it is found where
there is none. With 60 cycles, 89 to 97 % of the intervals cover the multiplier for excitations up to the scatter.
"""

EARLY = 6
"""Ratio of the number of cycles to that of the first ones, without which the fit is repeated and the excitation found:
most pairs that are not fitted have decayed by then.
"""

PASSES = 3
"""Number of fits; each after the first is weighted by the residual of the previous one."""

SMALLEST = 1e-9
"""Smallest scatter assumed for a coefficient, relative to the norm of the series, so that its weight stays finite."""


@dataclass(frozen=True)
class Multiplier:
    """Dominant pair of multipliers: `modulus` per cycle and `angle` [rad] per cycle, from 0 to pi, with their standard
    uncertainties due to noise and their correlation.

    `modulus_other` and `angle_other` are the standard uncertainties due to pairs that are not fitted: the changes of
    modulus and angle without the first cycles, beyond those expected from noise.

    `cycles` is the number of cycles used, `pairs` the number of fitted pairs, `autocorrelation` that of the residual
    from one cycle to the next, and `residual` the rms residual of a coefficient, in the unit of the series.
    """

    modulus: float
    modulus_uncertainty: float
    angle: float
    angle_uncertainty: float
    correlation: float
    modulus_other: float
    angle_other: float
    cycles: int
    pairs: int
    autocorrelation: float
    residual: float


def linear_part(series: Array, orbit: Array, bound: float = BOUND) -> slice:
    """Longest run of cycles of `series`, shape (n, m), whose deviation from `orbit`, shape (m,), is at most `bound`
    times the norm of the orbit.
    """
    within = np.linalg.norm(series - orbit, axis=1) <= bound * float(np.linalg.norm(orbit))
    edges = np.flatnonzero(np.diff(np.concatenate(([False], within, [False])).astype(np.int8)))
    if edges.size == 0:
        return slice(0, 0)
    begins, ends = edges[::2], edges[1::2]
    longest = int(np.argmax(ends - begins))
    return slice(int(begins[longest]), int(ends[longest]))


def dominant_multiplier(series: Array) -> Multiplier | None:
    """Pair of multipliers with the largest modulus, among those that contribute substantially to `series`, shape (n,
    m): coefficients of successive cycles at a constant drive.

    None if there are too few cycles for a second estimate without the first ones, from at least `SHORTEST` cycles, or
    if no pair is significant in both. Raises ValueError for values that are not finite.
    """
    if not np.isfinite(series).all():
        raise ValueError("the series of coefficients has values that are not finite")
    late = series[series.shape[0] // EARLY :]
    if late.shape[0] < SHORTEST:
        return None
    found = _dominant(series)
    later = None if found is None else _dominant(late)
    if found is None or later is None:
        return None
    return replace(
        found,
        modulus_other=_beyond_noise(
            later.modulus - found.modulus, found.modulus_uncertainty, later.modulus_uncertainty
        ),
        angle_other=_beyond_noise(later.angle - found.angle, found.angle_uncertainty, later.angle_uncertainty),
    )


def _beyond_noise(change: float, uncertainty: float, of_part: float) -> float:
    """Part of a `change` that is larger than expected from noise, between an estimate from all data and one from a part
    of them, with these standard uncertainties (Hausman, Econometrica 46, 1978: the variance of the change is the
    difference of the variances).
    """
    return max(change**2 - max(of_part**2 - uncertainty**2, 0.0), 0.0) ** 0.5


def _dominant(series: Array) -> Multiplier | None:
    n = series.shape[0]
    if n < SHORTEST:
        return None
    size = float(np.linalg.norm(series - series.mean(axis=0)))
    if size == 0.0:
        return None
    scaled = (series - series.mean(axis=0)) / size
    single = _fitted(scaled, 1)
    if single is None:
        return None
    best = single
    if n >= TWICE and (double := _fitted(scaled, 2)) is not None:
        best = double if double.criterion < single.criterion - EVIDENCE else single
    return _stated(best, size) if best.significance >= SIGNIFICANT else None


@dataclass(frozen=True, eq=False)
class _Fit:
    """A fit: its multipliers, the dominant one first, the residual, shape (n, m), the derivatives of the weighted
    residual, shape (n, m, 2 pairs), with respect to the logarithm of the modulus and the angle of each pair, the
    weights, shape (m,), the `pattern` of the weighted coefficients in the motion of the first pair, shape (m,), the
    information `criterion`, and the `significance` of the first pair.
    """

    multipliers: Complex
    residual: Array
    slopes: Array
    weights: Array
    pattern: Complex
    criterion: float
    significance: float


def _fitted(series: Array, pairs: int) -> _Fit | None:
    from scipy.optimize import least_squares

    (n, m), first = series.shape, _pencil(series, pairs)
    if first is None:
        return None
    unknowns = np.stack((np.log(np.abs(first)), np.angle(first)), axis=1).ravel()
    weights = np.ones(m)
    slopes = np.zeros((n * m, 2 * pairs))
    for _ in range(PASSES):

        def weighted(values: Array, by: Array = weights) -> Array:
            return (_left(series, values) * by).ravel()

        found = least_squares(weighted, unknowns, x_scale=np.tile((0.1 / n, 0.1 / n), pairs))
        unknowns, slopes = np.asarray(found.x, dtype=np.float64), np.asarray(found.jac, dtype=np.float64)
        free = n - 1 - 2 * pairs
        scatter = np.sqrt(np.sum(_left(series, unknowns) ** 2, axis=0) / free)
        weights = 1.0 / np.maximum(scatter, SMALLEST)
    # two equal multipliers cannot be separated
    if np.linalg.matrix_rank(slopes) < 2 * pairs:
        return None
    powers = _powers(n, unknowns)
    patterns = _patterns(series, powers) * weights
    parts: Array = np.real(patterns[:, None, :] * powers.T[:, :, None])
    sizes = np.linalg.norm(parts, axis=(1, 2))
    multipliers = np.exp(unknowns[::2] + 1j * unknowns[1::2])
    # a pair with a much smaller contribution fits noise, however slowly it decays
    moduli = np.where(sizes >= SHARE * sizes.max(), np.abs(multipliers), 0.0)
    order = np.argsort(-moduli)
    residual = _left(series, unknowns)
    criterion = 2.0 * n * float(np.sum(np.log(1.0 / weights))) + 2 * pairs * (1 + m) * log(n * m)
    # the noise in the contribution of a pair has two degrees of freedom per coefficient
    significance = float(np.linalg.norm(parts[order[0]])) / (2.0 * m) ** 0.5
    slopes = slopes.reshape(n, m, pairs, 2)[:, :, order, :].reshape(n, m, 2 * pairs)
    return _Fit(multipliers[order], residual, slopes, weights, patterns[order[0]], criterion, significance)


def _stated(fit: _Fit, size: float) -> Multiplier:
    """The dominant pair of `fit`, with its covariance for a residual that is correlated between coefficients and due in
    part to random excitation of the motion, which the multiplier carries on from cycle to cycle.
    """
    whitened = fit.residual * fit.weights
    n, m = whitened.shape
    free = n - 1 - 2 * fit.multipliers.size
    between = whitened.T @ whitened / free
    inverse = np.linalg.inv(np.tensordot(fit.slopes, fit.slopes, ((0, 1), (0, 1))))
    correlated = np.tensordot(fit.slopes, np.matmul(between, fit.slopes), ((0, 1), (0, 1)))
    dominant = complex(fit.multipliers[0])
    # pairs that are not fitted, and have not decayed yet, would be taken for an excitation
    excitation = _excited(_along(whitened[n // EARLY :], fit.pattern), dominant)
    carried = _carried(np.tensordot(fit.pattern, fit.slopes, (0, 1)), dominant)
    covariance = inverse @ (correlated + 0.5 * excitation * (carried.T @ carried.conj()).real) @ inverse
    spread = np.sqrt(np.diag(covariance)[:2])
    follows = float(np.sum(whitened[1:] * whitened[:-1]) / np.sum(whitened**2))
    angle = abs(float(np.angle(dominant)))
    return Multiplier(
        modulus=abs(dominant),
        modulus_uncertainty=abs(dominant) * float(spread[0]),
        angle=angle,
        angle_uncertainty=float(spread[1]),
        correlation=float(covariance[0, 1] / np.prod(spread)) * (1.0 if np.angle(dominant) >= 0.0 else -1.0),
        modulus_other=0.0,
        angle_other=0.0,
        cycles=n,
        pairs=fit.multipliers.size,
        autocorrelation=follows,
        residual=size * float(np.sqrt(np.sum(fit.residual**2) / (free * m))),
    )


def _along(whitened: Array, pattern: Complex) -> Complex:
    """Complex coordinate of each cycle of the `whitened` residual, shape (n, m), along the `pattern` of a pair, shape
    (m,): the residual is nearest to Re(pattern coordinate).
    """
    axes = np.stack((pattern.real, -pattern.imag), axis=1)
    found = np.linalg.lstsq(axes, whitened.T, rcond=None)[0]
    return found[0] + 1j * found[1]


def _excited(along: Complex, multiplier: complex) -> float:
    """Variance of the excitation w of a coordinate z_n = s_n + e_n, s_(n+1) = mu s_n + w_n, with scatter e.

    It is the mean over the `RATIOS` to the variance of e, weighted by their restricted likelihood (Patterson and
    Thompson, Biometrika 58, 1971), which allows for what the fit absorbs. In z_(n+1) - mu z_n, excitation is white, and
    only neighbours are correlated by scatter: in a frame that turns with mu, sines are the eigenvectors for all ratios.
    """
    from scipy.fft import dst

    changes = along[1:] - multiplier * along[:-1]
    n, modulus = changes.size, abs(multiplier)
    turned = np.exp(-1j * np.angle(multiplier) * np.arange(n))
    # other values of the orbit and of mu change these
    absorbed = _powers(n, np.array([np.log(modulus), 0.0]))[:, 0], turned
    lines: Complex = dst(np.stack((*absorbed, changes * turned)), type=1, norm="ortho")
    if not lines[-1].any():
        return 0.0
    of_scatter = 1.0 + modulus**2 - 2.0 * modulus * np.cos(pi * np.arange(1, n + 1) / (n + 1))
    spectra: Array = of_scatter + RATIOS[:, None]
    products: Complex = np.einsum("jn,kn,rn->rjk", lines.conj(), lines, 1.0 / spectra)
    normal, effects = products[:, :2, :2], products[:, :2, 2:]
    left: Array = (products[:, 2:, 2:] - effects.conj().swapaxes(1, 2) @ np.linalg.solve(normal, effects)).real.ravel()
    free = n - len(absorbed)
    likelihood = -np.sum(np.log(spectra), axis=1) - np.linalg.slogdet(normal).logabsdet - free * np.log(left)
    likelihood += PRIOR * np.log(RATIOS)
    weights = np.exp(likelihood - likelihood.max())
    return float(np.sum(weights * RATIOS * left) / (np.sum(weights) * (free - 1)))


def _carried(effects: Complex, multiplier: complex) -> Complex:
    """Effect of a change of the coordinate in each cycle on the unknowns, shape (n, k), for those of the coordinate in
    each cycle, `effects` of the same shape: the multiplier carries a change on to all later cycles.
    """
    from scipy.signal import lfilter

    return np.asarray(lfilter([1.0], [1.0, -multiplier], effects[::-1], axis=0), dtype=np.complex128)[::-1]


def _powers(n: int, values: Array) -> Complex:
    """mu^n of each pair in each cycle, shape (n, pairs), scaled to a largest modulus of 1."""
    rates: Complex = values[::2] + 1j * values[1::2]
    # a growing pair is scaled to 1 in the last cycle, so that no power overflows
    times: Array = np.arange(n, dtype=np.float64)[:, None] - np.where(np.real(rates) > 0.0, n - 1.0, 0.0)
    return np.exp(rates * times)


def _columns(powers: Complex) -> Array:
    """Basis of the series, shape (n, 1 + 2 pairs): a constant, and the real and imaginary parts of the `powers`."""
    n, pairs = powers.shape
    columns = np.ones((n, 1 + 2 * pairs))
    columns[:, 1::2], columns[:, 2::2] = powers.real, powers.imag
    return columns


def _left(series: Array, values: Array) -> Array:
    """Residual of the linear problem for given multipliers, shape (n, m)."""
    across = np.linalg.qr(_columns(_powers(series.shape[0], values))).Q
    return series - across @ (across.T @ series)


def _patterns(series: Array, powers: Complex) -> Complex:
    """Coefficients of each pair, shape (pairs, m): its contribution to the series is Re(pattern power)."""
    found = np.linalg.lstsq(_columns(powers), series, rcond=None)[0]
    return found[1::2] - 1j * found[2::2]


def _pencil(series: Array, pairs: int) -> Complex | None:
    """Initial values of the multipliers, in the upper half plane; None if the series contains fewer pairs."""
    changes = np.diff(series, axis=0)
    n = changes.shape[0]
    length = n // PENCIL
    rows = np.concatenate([changes[k : n - length + k + 1] for k in range(length)], axis=1)
    left, _, _ = np.linalg.svd(rows, full_matrices=False)
    for rank in (2 * pairs, 2 * pairs + 1, 2 * pairs + 2):
        space = left[:, :rank]
        found = np.linalg.eigvals(np.linalg.lstsq(space[:-1], space[1:], rcond=None)[0])
        upper = found[(np.angle(found) > 0.0) & (np.angle(found) < pi)]
        if upper.size >= pairs:
            return upper[np.argsort(-np.abs(upper))][:pairs].astype(np.complex128)
    return None
