"""Standards of length of a laser calibration: the lasers, and the accelerometer with the scale of its data sheet.

Data sheets of lasers state the largest linearity error, not its shape. Its effect on the scale over a span depends on
the number of waves within the measuring range: the errors at the two ends of half the range are opposite for about one
wave and equal for two. The difference between the two measured curves, in which the error of the table's displacement
sensor cancels, gives each pair of numbers of waves a weight, as in `bench.analysis.error_curve`. Over short spans,
where linearity errors are large, the accelerometer has most of the weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from bench.analysis.error_curve import LEAST, WAVES, likelihoods, prior
from bench.analysis.sensor_accuracy import SensorAccuracy
from protocols.laser_calibration.curves import ErrorCurve

Array = NDArray[np.float64]

LEAST_WAVES = 0.5
"""Smallest number of waves of a linearity error, which is the deviation from a straight line over the whole range:
fewer waves are mostly an error of scale.
"""

COMPARED = 10
"""Highest Chebyshev order of the curves that are compared; six waves over a range have theirs up to about 9 over half
of it.
"""

NODES = 33
"""Number of readings from which Chebyshev coefficients are computed."""

IMPLAUSIBLE = 3.0
"""Ratio of a difference between scales to its standard uncertainty above which an error of a sensor is likely."""


@dataclass(frozen=True)
class Standards:
    """Relative standard uncertainties of the standards: `lasers`, of the mean span of both, and `table`, of the scale
    of the accelerometer according to its data sheet.
    """

    lasers: float
    table: float

    @property
    def apart(self) -> float:
        """Relative standard uncertainty of the difference between the spans of the two lasers."""
        return 2.0 * self.lasers

    @property
    def bound(self) -> float:
        """Relative difference from the lasers above which the scale of a table sensor is not plausible."""
        return IMPLAUSIBLE * hypot(self.lasers, self.table)

    def combined(self, acceleration: float, scatter: float = 0.0) -> tuple[float, float]:
        """The weighted mean of the standards, for a ratio `acceleration` of the displacement that the lasers measured
        to that computed from the accelerometer, with the standard uncertainty `scatter` due to repetition.

        Returns the ratio of the true displacement to that measured by the lasers, and its uncertainty without the
        scatter. An accelerometer that is not plausible is no standard.
        """
        both = hypot(self.lasers, self.table, scatter)
        if both == 0.0 or not abs(acceleration - 1.0) <= self.bound:
            return 1.0, self.lasers
        share = (self.lasers / both) ** 2
        return 1.0 + share * (1.0 / acceleration - 1.0), sqrt(1.0 - share) * self.lasers


def standards(
    curves: tuple[ErrorCurve, ErrorCurve], accuracy: SensorAccuracy, ranges: tuple[float, float]
) -> Standards:
    """The standards of a calibration with the error `curves` of lasers with the measuring `ranges` [m]."""
    limits = [accuracy.laser_linearity * whole for whole in ranges]
    slopes = _mean_square_of_slopes(curves, limits, ranges) if max(limits) > 0.0 else 0.0
    # the sum of two independent scales has the variance of their difference
    return Standards(lasers=0.5 * sqrt(slopes + accuracy.laser_mismatch**2), table=accuracy.table_scale)


def _mean_square_of_slopes(
    curves: tuple[ErrorCurve, ErrorCurve], limits: Sequence[float], ranges: Sequence[float]
) -> float:
    """Variance of the sum of the slopes of both linearity errors over the covered spans, the mean over the numbers of
    waves.

    The posterior of the slopes is not used: it would depend on the exact shape. For drawn sines its intervals were too
    narrow by a factor of 1.25.
    """
    # above the lower order, the error of the reference sensor does not cancel
    orders = min(COMPARED, *(curve.error.size - 1 for curve in curves))
    bent = slice(2, orders + 1)
    first, second = (
        _moments(curve, limit, whole)[:, :orders, :orders]
        for curve, limit, whole in zip(curves, limits, ranges, strict=True)
    )
    apart = curves[1].error[bent] - curves[0].error[bent]
    # the uncertainty at one reading is an upper limit of that of each coefficient
    noise = sum(each.uncertainty**2 for each in curves) + (LEAST * max(limits)) ** 2
    covariance = first[:, None, 1:, 1:] + second[None, :, 1:, 1:] + noise * np.eye(apart.size)
    factors = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factors, np.broadcast_to(apart[:, None], (*covariance.shape[:3], 1)))[..., 0]
    likely = likelihoods(factors, white)
    slopes = first[:, None, 0, 0] + second[None, :, 0, 0]
    return float((likely * slopes).sum() / likely.sum())


def _moments(curve: ErrorCurve, limit: float, whole: float) -> Array:
    """Covariances of the slope over the span of a curve [1] and its Chebyshev coefficients from order 2 on [m], shape
    (candidates, COMPARED, COMPARED), for each irregular curve and sine with at least `LEAST_WAVES`.
    """
    angles = np.pi * (np.arange(NODES) + 0.5) / NODES
    middle, half = 0.5 * (curve.high + curve.low), 0.5 * (curve.high - curve.low)
    functions = np.zeros((COMPARED, NODES + 2))
    functions[0, -2:] = -0.5 / half, 0.5 / half
    functions[1:, :-2] = 2.0 / NODES * np.cos(np.outer(np.arange(2, COMPARED + 1), angles))
    places = np.append(middle + half * np.cos(angles), [curve.low, curve.high])
    return prior(places, functions, places, functions, limit, whole)[np.tile(WAVES, 2) >= LEAST_WAVES]
