"""Linearity error of the table's displacement sensor, from the displacement computed from the accelerometer.

During a sine, the harmonics of the displacement sensor's readings are those of the motion and of its error, while those
of the accelerometer, divided by -(k omega)^2, are those of the motion alone. With the displacement X computed from the
acceleration and its rate V, a polynomial g of the reading is fitted to

    d = c + a X + b V + g(d)

where offset, scale and delay (c, a, b) are those of each pass, so that the noise of its fundamental takes no part.
The noise of X is proportional to 1 / omega^2, the inverse of the weight of a pass. The error g is zero at both ends of
the readings that all passes cover: the correction leaves their span as it is, and the scales of all sensors.

Errors of the accelerometer due to the inclination of the table, whose effect on X is proportional to 1 / omega^2, or to
its own linearity depend on the frequency: if the errors found at the two frequencies differ by more than their scatter,
the excess is part of the uncertainty. If the uncertainty exceeds the linearity error on the data sheet of the
displacement sensor, the readings are not corrected, and the data sheet applies.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from protocols.laser_calibration.curves import Pass
from protocols.laser_calibration.polynomial import PolynomialFit, fit_polynomial, scatter, values

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ReferenceCurve:
    """Linearity error of the displacement sensor: Chebyshev coefficients `error` [m] over the readings from `low` to
    `high` [m], its standard `uncertainty` at one reading [m], and the `limit` [m] on its data sheet. `scores` and
    `without` [m] are those of `ErrorCurve`.
    """

    low: float
    high: float
    error: Array
    uncertainty: float
    limit: float
    scores: Array
    without: Array

    @property
    def largest(self) -> float:
        """Largest error between `low` and `high` [m]."""
        return float(np.abs(values(self.error)).max())

    @property
    def corrects(self) -> bool:
        """Whether corrected readings have a smaller error than the data sheet states."""
        return sqrt(2.0) * self.uncertainty < self.limit

    @property
    def remaining(self) -> float:
        """Amplitude [m] of the error that the readings have, corrected or not."""
        return min(sqrt(2.0) * self.uncertainty, self.limit)

    @property
    def plausible(self) -> bool:
        """Whether the error is within the data sheet: an error within its limits differs from the straight line through
        its ends by less than twice the limit. Without a limit, the sensor is taken to be linear.
        """
        return self.limit == 0.0 or self.largest <= 2.0 * (self.limit + self.remaining)

    def corrected(self, passes: Sequence[Pass]) -> list[Pass]:
        """The passes with corrected displacements; unchanged if the data sheet states a smaller error."""
        if not self.corrects:
            return list(passes)
        return [replace(each, displacement=each.displacement - self._errors(each.displacement)) for each in passes]

    def _errors(self, readings: Array) -> Array:
        return values(self.error, _places(readings, self.low, self.high))


def fit_reference(passes: Sequence[Pass], linearity: float) -> ReferenceCurve:
    """Linearity error of the displacement sensor from passes at two frequencies. `linearity` is the largest error on
    its data sheet, relative to the covered range.
    """
    low = max(float(each.displacement.min()) for each in passes)
    high = min(float(each.displacement.max()) for each in passes)
    highest = min(each.highest for each in passes)
    fastest = max(each.omega for each in passes)
    fit = fit_polynomial([_rows(each, low, high, highest, (each.omega / fastest) ** 2) for each in passes])
    without = _curves(fit.without)
    # a straight line has no scatter that would stand for what is not seen
    missing = fit.residual if fit.order > 1 else fit.beyond
    return ReferenceCurve(
        low=low,
        high=high,
        error=_pinned(fit.whole),
        uncertainty=sqrt(scatter(without) ** 2 + missing**2 + _excess(fit, _by_frequency(passes))),
        limit=linearity * (high - low),
        scores=fit.scores,
        without=without,
    )


def _excess(fit: PolynomialFit, groups: Sequence[Sequence[int]]) -> float:
    """Mean square difference between the errors found in two groups of passes [m2], less that due to their scatter."""
    curves = [_curves([fit.solved(group)]) for group in groups]
    alone = [_curves([fit.solved([k for k in group if k != out]) for out in group]) for group in groups]
    return max(float(np.var(curves[1] - curves[0])) - sum(scatter(each) ** 2 for each in alone), 0.0)


def _by_frequency(passes: Sequence[Pass]) -> tuple[list[int], list[int]]:
    """Numbers of the slow and of the fast passes."""
    middle = sqrt(min(each.omega for each in passes) * max(each.omega for each in passes))
    slow = [number for number, each in enumerate(passes) if each.omega < middle]
    return slow, [number for number in range(len(passes)) if number not in slow]


def _rows(each: Pass, low: float, high: float, highest: int, weight: float) -> Array:
    """Equations of the fit, shape (k, highest + 4), from which the parts of offset, scale and delay are removed. The
    first two polynomials and two further terms are not used, and zero.
    """
    n = each.integrated.size
    turned = np.fft.irfft(1j * np.arange(n // 2 + 1) * np.fft.rfft(each.integrated), n)
    own = np.column_stack((np.ones(n), each.integrated, turned))
    terms = chebyshev.chebvander(_places(each.displacement, low, high), highest)
    terms[:, :2] = 0.0
    rows = np.column_stack((terms, np.zeros((n, 2)), each.displacement))
    return (weight * (rows - own @ np.linalg.lstsq(own, rows, rcond=None)[0])).astype(np.float64)


def _places(readings: Array, low: float, high: float) -> Array:
    return (2.0 * readings - high - low) / (high - low)


def _pinned(solution: Array) -> Array:
    """Chebyshev coefficients of the error that is zero at both ends, from the solution of a fit."""
    error = solution[:-2].copy()
    error[0], error[1] = -error[2::2].sum(), -error[3::2].sum()
    return error


def _curves(solutions: Iterable[Array]) -> Array:
    """The errors at `PLACES` [m], shape (solutions, READINGS)."""
    return np.array([values(_pinned(each)) for each in solutions])
