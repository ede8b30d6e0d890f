"""Single points of the motion from the samples around them: when the block hit the ground, how far it swung.

Nothing is assumed of the motion but that it is smooth between impacts, so these points check a model that is fitted to
the whole. A Butterworth low-pass keeps a smooth motion as it is, only later: its gain has no term in omega^2, so its
impulse response has no second cumulant, and a parabola comes out as it went in. What it does to the kink at an impact
is gone after `AFTER`, and those samples are left out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_rocking.swings import Seen, Swings

Array = NDArray[np.float64]

BEFORE, AFTER = 0.005, 0.025
"""Time before and after an impact that is left out [s]. A low-pass of fourth order at 100 Hz, whose delay is 2.6 ms,
keeps exp(-6) of a kink of some 15 um for 25 ms."""

_WINDOW, _PART = 0.08, 0.45
"""Largest half width of the fit around an impact [s], and its part of the shorter half swing beside it."""

_TURN = 0.6
"""Half width of the fit around a turning point, in halves of the half swing."""

_DEGREE = 4
_FEWEST = 12
"""Samples below which a point is not known."""


@dataclass(frozen=True, eq=False)
class Points:
    """`impacts` [s], shape (n,), good to 50 us, and `amplitudes` [rad], shape (n,), signed, of the turning points that
    follow them, with standard uncertainties of noise; NaN where too few samples are left.
    """

    impacts: Array
    impact_uncertainty: Array
    amplitudes: Array
    amplitude_uncertainty: Array


def find_points(seen: Seen, swings: Swings, zero: float) -> Points:
    """The points of all `swings`, when the laser shows `zero` [m] for the standing block."""
    times, angle = seen.times, seen.angle(zero)
    marks = np.append(swings.crossings, np.nan)
    impacts: list[tuple[float, float]] = []
    turns: list[tuple[float, float]] = []
    for number, crossing in enumerate(swings.crossings):
        # the last half swing has no impact behind it: it is not longer than the one before
        length = marks[number + 1] - crossing if number + 1 < swings.crossings.size else crossing - marks[number - 1]
        window = min(_WINDOW, _PART * float(length))
        impacts.append(_impact(times, angle, float(crossing), window))
        turns.append(_turn(times, angle, float(crossing), float(length)))
    found = np.array([*impacts, *turns]).reshape(2, -1, 2)
    return Points(found[0, :, 0], found[0, :, 1], found[1, :, 0], found[1, :, 1])


def _impact(times: Array, angle: Array, guess: float, window: float) -> tuple[float, float]:
    """Instant at which a cubic whose slope and curvature change there passes zero, and its uncertainty [s]."""
    instant, doubt = guess, np.nan
    for _ in range(3):
        instant, doubt = _closer(times, angle, instant, window)
    return instant, doubt


def _closer(times: Array, angle: Array, instant: float, window: float) -> tuple[float, float]:
    """One step towards the zero of the cubic, from an `instant` near it; NaN where too few samples are left."""
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
    spread = functional_uncertainty(inverse[0], angle[used] - basis @ fitted, basis.shape[1])
    return instant - float(fitted[0]) / slope, spread / abs(slope)


def _turn(times: Array, angle: Array, crossing: float, length: float) -> tuple[float, float]:
    """Largest angle of the half swing after `crossing`, signed, and its uncertainty [rad]."""
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
    """Standard uncertainty of `weights` @ signal, both of shape (n,), by the `residual` of a fit of so many parameters.

    The residual's neighbours are correlated, by the filters and the steps of the laser: its autocovariance counts up to
    where it first falls to zero.
    """
    n = residual.size
    covariance = np.correlate(residual, residual, "full")[n - 1 :] / max(n - parameters, 1)
    kept = np.flatnonzero(covariance <= 0.0)
    lags = int(kept[0]) if kept.size else n
    products = np.correlate(weights, weights, "full")[n - 1 :]
    variance = covariance[0] * products[0] + 2.0 * float(covariance[1:lags] @ products[1:lags])
    return float(np.sqrt(max(variance, covariance[0] * products[0])))
