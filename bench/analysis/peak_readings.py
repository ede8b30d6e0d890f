"""Readings of both lasers at the peak of a drift, and the effect of the lasers' errors on it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.linearity import Effect, LinearityErrors
from bench.analysis.rounding import FittedPeak
from bench.analysis.smoothed_peaks import SmoothedPeaks

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PeakReadings:
    """Readings of both lasers at the peak of a drift, relative to the rest position of the storeys.

    drift, sign : the peak [m], and its sign, 1 or -1.
    lasers, speeds : reading of each laser [m] and its rate [m/s].
    zero : readings [m], shape (2, n), whose mean is the zero of the peak; zeros, shape (2, 1), if it was taken at rest.
    swings : span of each laser's readings [m] in the fit of the peak.
    at_rest : whether the zero was taken at rest, where rounding errors do not average out.
    weights : derivatives of the peak of a fitted cycle with respect to the readings in `zero`, shape (n,); None if the
        peak is the reading at the peak minus the mean of `zero`.
    fitted : the fitted cycles of which it is the peak, or the smoothed samples around the peaks; None for a transient.
    several : of the mean of n peaks of single cycles, or of one, the readings of both lasers at each [m], shape (2, n),
        and the derivatives of the mean with respect to the drift there, shape (n,): shares of the peaks, negative where
        the drift is. `sign` is then 1, and `lasers`, `speeds` and `swings` are means, turned to the positive side. None
        for the peak of a mean cycle or of a transient.
    """

    drift: float
    sign: float
    lasers: tuple[float, float]
    speeds: tuple[float, float]
    zero: Array
    swings: tuple[float, float]
    at_rest: bool
    weights: Array | None = None
    fitted: FittedPeak | SmoothedPeaks | None = None
    several: tuple[Array, Array] | None = None

    @property
    def sides(self) -> float:
        """Derivative of the peak, turned to the positive side, with respect to the zero of the drift, negative: 1, or
        between -1 and 1 for a mean of peaks on both sides.
        """
        return 1.0 if self.several is None else float(self.several[1].sum())

    def effect(self, laser: int) -> Effect:
        """Effect of the error of laser 0 or 1 on the peak."""
        zero = self.zero[laser]
        if self.weights is not None:
            return Effect(zero, self.weights)
        means = np.full(zero.size, -self.sides / zero.size)
        if self.several is not None:
            readings, shares = self.several
            return Effect(np.append(zero, readings[laser]), np.append(means, shares))
        return Effect(np.append(zero, self.lasers[laser]), np.append(means, 1.0))


@dataclass(frozen=True, eq=False)
class Shapes:
    """Errors of the same peaks due to the linearity of each laser and, for calibrated lasers, due to the linearity of
    the calibration's reference sensor, which affects both lasers equally.
    """

    lasers: tuple[LinearityErrors | None, LinearityErrors | None]
    common: LinearityErrors | None = None

    def scaled(self, factors: Sequence[float]) -> "Shapes":
        """The errors multiplied by one factor per peak."""
        first, second, common = (None if each is None else each.scaled(factors) for each in (*self.lasers, self.common))
        return Shapes((first, second), common)


def shares_of(seen: Sequence[PeakReadings]) -> Array:
    """Derivatives, with respect to the peaks, of the logarithm of the ratio of the second peak to the first, or of a
    single peak. Further peaks, which may be the true largest ones of these tests, are not part of the ratio.
    """
    shares = np.array([each.sign / each.drift for each in seen])
    if shares.size > 1:
        shares[0] *= -1.0
        shares[2:] = 0.0
    return shares


def beyond(effect: Effect, low: float, high: float) -> Effect:
    """Part of an effect that is due to errors at readings outside `low` to `high` [m], relative to the error at the
    nearer end.
    """
    out = (effect.places < low) | (effect.places > high)
    places, weights = effect.places[out], effect.weights[out]
    return Effect(np.append(places, np.clip(places, low, high)), np.append(weights, -weights))
