"""Errors of the lasers from cycles of a common motion.

During a slow sine of the table with displacement x and velocity v, a laser reads

    r = x + e(r) - d v + c omega^2 x

where e is the laser's position-dependent error, d its delay, and c the compliance of the clamps, which accelerate the
storeys; passes at two frequencies separate c from a scale error. All three are fitted by least squares to the mean
cycles of the passes, at equal steps of the phase; e is a sum of Chebyshev polynomials of the reading. The motion need
not be a pure sine, since the laser and the table's sensor measure the same motion.

The displacement is that of the table's sensor, corrected for its linearity error
(`protocols.laser_calibration.reference`). `protocols.laser_calibration.polynomial` chooses the order of the polynomial.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle, mean_waves
from bench.analysis.laser_calibration import ORDERS
from bench.analysis.signals import ACCELERATION, DISPLACEMENT, LASER_1, LASER_2
from protocols.laser_calibration.polynomial import fit_polynomial, scatter, values

Array = NDArray[np.float64]

HIGHEST = ORDERS
"""Highest order of the fit, sufficient for an error with six periods over the measuring range if the passes cover half
of it.
"""

HARMONICS = HIGHEST + 1
"""Number of harmonics fitted to the cycles: the order k of an error shows in the harmonics up to about k."""


@dataclass(frozen=True, eq=False)
class Pass:
    """Mean cycle of a pass at `omega` [rad/s]: displacement [m] and velocity [m/s] of the table, and readings of both
    lasers relative to rest [m], shape (k,) each.
    """

    omega: float
    displacement: Array
    speed: Array
    lasers: tuple[Array, Array]
    integrated: Array
    """Displacement [m] computed from the acceleration, without its mean, shape (k,)."""
    harmonics: int = HARMONICS
    """Number of harmonics fitted to the cycles, fewer with a low sample rate."""

    @property
    def ratio(self) -> float:
        """Ratio of the span of the table's displacement to that computed from its acceleration. Since the lasers are
        compared with the displacement over almost the same span, the linearity error of its sensor largely cancels in
        the scale of the accelerometer.
        """
        return float(np.ptp(self.displacement) / np.ptp(self.integrated))

    @property
    def highest(self) -> int:
        """Highest order of a polynomial that the harmonics determine."""
        return max(min(HIGHEST, self.harmonics - 1), 1)


@dataclass(frozen=True, eq=False)
class ErrorCurve:
    """Error curve of one laser relative to the measured table displacement: Chebyshev coefficients `error` [m] over the
    readings from `low` to `high` [m], and `delay` [s].

    `scores` [m], shape (orders,), are the rms prediction errors of the orders from 1 on. `residual` [m] is the rms
    contribution of higher orders, or of the highest one if this is chosen, without their scatter. `without` [m], shape
    (passes, READINGS), are the curves, and `delays` [s], shape (passes,), the delays, fitted without each pass in turn;
    `finest` [m], shape (passes, orders + 1), are the coefficients of such curves of the highest order.
    """

    low: float
    high: float
    error: Array
    delay: float
    scores: Array
    residual: float
    without: Array
    finest: Array
    delays: Array

    @property
    def uncertainty(self) -> float:
        """Standard uncertainty of the curve at one reading [m], excluding the mean error."""
        return hypot(scatter(self.without), self.residual)

    @property
    def slope(self) -> float:
        """Change of the error from `low` to `high`, relative to the span of the readings."""
        ends = chebyshev.chebval(np.array([-1.0, 1.0]), self.error)
        return float(ends[1] - ends[0]) / (self.high - self.low)

    @property
    def slopes(self) -> Array:
        """Slopes of the curves of the highest order fitted without each pass in turn, shape (passes,)."""
        # polynomials of even order are equal at both ends
        return 2.0 * self.finest[:, 1::2].sum(axis=1) / (self.high - self.low)


def mean_pass(cycles: Sequence[Cycle], omega: float) -> Pass:
    """A pass at `omega` [rad/s], computed from its cycles, whose signals are relative to the values at rest."""
    waves = mean_waves(cycles)
    return Pass(
        omega=omega,
        displacement=waves.waveform[:, DISPLACEMENT],
        speed=omega * waves.rates[:, DISPLACEMENT],
        lasers=(waves.waveform[:, LASER_1], waves.waveform[:, LASER_2]),
        integrated=_integrated_twice(waves.waveform[:, ACCELERATION], omega),
        harmonics=min(cycle.fitted for cycle in cycles),
    )


def _integrated_twice(acceleration: Array, omega: float) -> Array:
    """Displacement [m] for one period of an `acceleration` [m/s2] at `omega` [rad/s], shape (k,) each, without mean."""
    spectrum = np.fft.rfft(acceleration)
    orders = np.arange(1, spectrum.size)
    spectrum[0] = 0.0
    spectrum[1:] /= -((orders * omega) ** 2)
    return np.fft.irfft(spectrum, acceleration.size)


def fit_curve(passes: Sequence[Pass], laser: int, rest: float) -> ErrorCurve:
    """Error curve of laser 0 or 1, whose reading at rest is `rest` [m]; the passes must include two frequencies."""
    readings = [rest + each.lasers[laser] for each in passes]
    # the range that all passes cover
    low, high = max(float(r.min()) for r in readings), min(float(r.max()) for r in readings)
    highest = min(each.highest for each in passes)
    fit = fit_polynomial([_rows(r, each, low, high, highest) for r, each in zip(readings, passes, strict=True)])
    return ErrorCurve(
        low=low,
        high=high,
        error=fit.whole[:-2],
        delay=float(fit.whole[-2]),
        scores=fit.scores,
        residual=fit.residual,
        without=np.array([values(each[:-2]) for each in fit.without]),
        finest=fit.finest[:, :-2],
        delays=fit.without[:, -2],
    )


def _rows(readings: Array, each: Pass, low: float, high: float, highest: int) -> Array:
    """Equations of the fit, shape (k, highest + 4): Chebyshev polynomials up to the order `highest`, delay, compliance
    of the clamps, and the error.
    """
    place = (2.0 * readings - high - low) / (high - low)
    terms = (chebyshev.chebvander(place, highest), -each.speed, each.omega**2 * each.displacement)
    return np.column_stack((*terms, readings - each.displacement)).astype(np.float64)
