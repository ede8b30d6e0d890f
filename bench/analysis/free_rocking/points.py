"""Single points of the motion, each determined from the samples around it: impact times and turning points, and the
restitution that follows from them. They assume only a smooth motion between impacts, and are therefore a check on a
model fitted to the entire motion. A Butterworth low-pass delays a smooth motion without distortion: its gain has no
term in omega^2, so its impulse response has no second cumulant, and a parabola is only delayed. Its response to the
kink at an impact has decayed after `AFTER`, and those samples are excluded.

Between impacts the energy is constant, so the largest angles before and after an impact give the restitution of the
angular velocity, exactly and independently of time:

    r_n^2 = (cos(alpha - |theta_n+1|) - cos(alpha)) / (cos(alpha - |theta_n|) - cos(alpha)).

For a constant r the logarithm of that energy changes linearly, by 2 ln(r) per impact; the line through all points gives
the mean r. alpha and the laser's scale have little influence, because they enter both the numerator and
the denominator.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_rocking.swings import Recording, Swings
from sim.free_rocking import energy

Array = NDArray[np.float64]

BEFORE, AFTER = 0.005, 0.025
"""Time excluded before and after an impact [s].

After 25 ms, a fourth-order low-pass at 100 Hz, with a delay of 2.6 ms, has reduced a kink of about 15 um by a factor of
exp(-6).
"""

_WINDOW, _PART = 0.08, 0.45
"""Largest half width of the fit around an impact: in seconds, and as a fraction of the shorter adjacent half swing."""

_TURN = 0.6
"""Half width of the fit around a turning point, as a fraction of half the duration of the half swing."""

_DEGREE = 4
_FEWEST = 12
"""Minimum number of samples in the fit of a point."""


@dataclass(frozen=True, eq=False)
class Points:
    """Times of the `impacts` [s] and signed `amplitudes` [rad] of the turning points that follow them, with their
    standard uncertainties due to noise; shape (n,) each, NaN where too few samples remain.
    """

    impacts: Array
    impact_uncertainty: Array
    amplitudes: Array
    amplitude_uncertainty: Array


def find_points(seen: Recording, swings: Swings, zero: float) -> Points:
    """The points of all `swings`, for a laser that reads `zero` [m] when the block is at rest."""
    times, angle = seen.times, seen.angle(zero)
    marks = np.append(swings.crossings, np.nan)
    impacts: list[tuple[float, float]] = []
    turns: list[tuple[float, float]] = []
    for number, crossing in enumerate(swings.crossings):
        # the end of the last half swing is not known: its duration is at most that of the previous one
        length = marks[number + 1] - crossing if number + 1 < swings.crossings.size else crossing - marks[number - 1]
        window = min(_WINDOW, _PART * float(length))
        impacts.append(_impact(times, angle, float(crossing), window))
        turns.append(_turn(times, angle, float(crossing), float(length)))
    found = np.array([*impacts, *turns]).reshape(2, -1, 2)
    return Points(found[0, :, 0], found[0, :, 1], found[1, :, 0], found[1, :, 1])


def _impact(times: Array, angle: Array, guess: float, window: float) -> tuple[float, float]:
    """Time [s] of the zero crossing of a cubic whose slope and curvature change there, and its standard uncertainty
    [s].
    """
    instant, uncertainty = guess, np.nan
    for last in (False, False, True):
        instant, uncertainty = _closer(times, angle, instant, window, judged=last)
    return instant, uncertainty


def _closer(times: Array, angle: Array, instant: float, window: float, *, judged: bool) -> tuple[float, float]:
    """One step towards the zero of the cubic, from an `instant` near it; NaN if too few samples remain. The uncertainty
    is NaN unless it is `judged`.
    """
    if not np.isfinite(instant):
        return np.nan, np.nan
    low, high = np.searchsorted(times, (instant - window, instant + window + AFTER))
    since, angle = times[low:high] - instant, angle[low:high]
    used = (since < -BEFORE) | (since > AFTER)
    s = since[used] / window
    if s.size < _FEWEST:
        return np.nan, np.nan
    basis = np.column_stack((np.ones(s.size), s, np.abs(s), s * np.abs(s), s * s, s**3))
    inverse: Array = np.asarray(np.linalg.pinv(basis), dtype=np.float64)
    fitted = inverse @ angle[used]
    slope = float(fitted[1]) / window
    nearer = instant - float(fitted[0]) / slope
    if not judged:
        return nearer, np.nan
    return nearer, functional_uncertainty(inverse[0], angle[used] - basis @ fitted, basis.shape[1]) / abs(slope)


def _turn(times: Array, angle: Array, crossing: float, length: float) -> tuple[float, float]:
    """Largest angle of the half swing after `crossing`, signed, and its standard uncertainty [rad]."""
    middle, half = crossing + 0.5 * length, 0.5 * _TURN * length
    used = slice(*np.searchsorted(times, (max(middle - half, crossing + AFTER), middle + half)))
    s = (times[used] - middle) / half
    if s.size < _FEWEST:
        return np.nan, np.nan
    basis = np.vander(s, _DEGREE + 1, increasing=True)
    inverse: Array = np.asarray(np.linalg.pinv(basis), dtype=np.float64)
    fitted = inverse @ angle[used]
    polynomial = np.polynomial.Polynomial(fitted)
    slope, bend = polynomial.deriv(1), polynomial.deriv(2)
    top = 0.0
    for _ in range(4):
        top = float(np.clip(top - slope(top) / bend(top), -0.5, 0.5))
    weights = top ** np.arange(_DEGREE + 1) @ inverse
    return float(polynomial(top)), functional_uncertainty(weights, angle[used] - basis @ fitted, basis.shape[1])


def functional_uncertainty(weights: Array, residual: Array, parameters: int) -> float:
    """Standard uncertainty of `weights` @ signal, both of shape (n,), from the `residual` of a fit.

    Filters and laser resolution correlate neighbouring residuals: their autocovariance is used up to its first zero.
    """
    n = residual.size
    covariance = np.correlate(residual, residual, "full")[n - 1 :] / max(n - parameters, 1)
    kept = np.flatnonzero(covariance <= 0.0)
    lags = int(kept[0]) if kept.size else n
    products = np.correlate(weights, weights, "full")[n - 1 :]
    variance = covariance[0] * products[0] + 2.0 * float(covariance[1:lags] @ products[1:lags])
    return float(np.sqrt(max(variance, covariance[0] * products[0])))


@dataclass(frozen=True, eq=False)
class Relation:
    """Restitution r of each impact, and of all impacts together from the fitted line.

    `speed`, shape (n,), is the speed of each impact relative to that of a fall from alpha; `each` and
    `each_uncertainty`, shape (n,), are the values of single impacts and their standard uncertainties due to noise.
    Neighbouring values share a turning point and are correlated. `restitution` has the standard `uncertainty` due to
    the scatter about the line; `weights`, shape (m,), are its sensitivities to the turning `angles` [rad], shape (m,).
    """

    speed: Array
    each: Array
    each_uncertainty: Array
    restitution: float
    uncertainty: float
    angles: Array
    weights: Array


def amplitude_relation(points: Points, alpha: float) -> Relation:
    """The amplitude relation for a block with critical angle `alpha` [rad], from the turning points up to the first
    unknown one.
    """
    known = np.isfinite(points.amplitudes)
    count = int(np.argmin(known)) if not known.all() else known.size
    angles, uncertainty = points.amplitudes[:count], points.amplitude_uncertainty[:count]
    left = energy(angles, alpha)
    steepness = _steepness(angles, alpha)
    spread = np.abs(steepness) * uncertainty
    each = np.sqrt(left[1:] / left[:-1])
    number = np.arange(count) - np.average(np.arange(count), weights=spread**-2)
    weights = number / spread**2 / np.sum(number**2 / spread**2)
    slope = float(weights @ np.log(left))
    level = float(np.average(np.log(left), weights=spread**-2))
    off = (np.log(left) - level - slope * number) / spread
    # the uncertainty follows from the observed scatter, not from the noise assumed for single points
    birge = float(np.sqrt(off @ off / (count - 2)))
    r = float(np.exp(0.5 * slope))
    return Relation(
        speed=np.sqrt(left[:-1]),
        each=each,
        each_uncertainty=0.5 * each * np.hypot(spread[1:], spread[:-1]),
        restitution=r,
        uncertainty=0.5 * r * birge * float(np.sqrt(np.sum((weights * spread) ** 2))),
        angles=angles,
        weights=0.5 * r * weights * steepness,
    )


def _steepness(angle: Array, alpha: float) -> Array:
    """Derivative of the logarithm of the energy with respect to theta [1/rad]."""
    size = np.abs(angle)
    slope = np.sin(alpha - size) / (2.0 * np.sin(alpha - 0.5 * size) * np.sin(0.5 * size))
    return np.sign(angle) * slope
