"""Gain coefficient from measured cycles, with its uncertainty (GUM, and Monte Carlo method of GUM Supplement 1)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import hypot, inf, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.column_harmonics import column_harmonics
from bench.analysis.cycles import Cycle, Waves, mean_amplitude, mean_waves
from bench.analysis.draws import Draws
from bench.analysis.error_curve import Checks, Harmonics
from bench.analysis.linearity import LinearFrame
from bench.analysis.peak_readings import PeakReadings, Shapes
from bench.analysis.remaining_transient import remaining_transient
from bench.analysis.rounding import FittedPeak
from bench.analysis.rounding_correction import MODEL, rounding
from bench.analysis.sensor_accuracy import SensorAccuracy as SensorAccuracy
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.series_mean import standard_error
from bench.analysis.signals import ACCELERATION, DRIFT, LASER_1, LASER_2, U1
from bench.analysis.uncertainty import COVERAGE as COVERAGE
from bench.analysis.uncertainty import NOISE, Budget, combined_freedom

SCATTER, TRANSIENT = "scatter of the cycles", "remaining transient"
"""Names of the contributions of the scatter and of a transient to the budgets."""

DRAWS, SEED = 4000, 1
"""Number of Monte Carlo draws of the sensors' errors; with this number, the expanded uncertainty has a statistical
scatter of 1.1 %.
"""

ZERO_PLACES = 32
"""Number of points of a cycle at which a laser's readings are averaged to obtain the zero of the peak."""

CHECK_PLACES = 64
"""Number of points of a cycle at which a laser's readings are evaluated to check its linearity."""

FRAME_SHARE = 0.3
"""Relative standard uncertainty of a harmonic of the bare frame that is computed from the same harmonic of the
table.
"""

PEAK_HARMONICS = 5
"""Highest harmonic used for the peak of a steady drift. An impact acts on the second storey through two springs and two
masses, so higher harmonics change the peak by less than 1e-4.
"""


@dataclass(frozen=True, eq=False)
class SteadyPeak:
    """The drift over measured cycles.

    `drift` [m] is its peak; `scatter` [m], `transient` [m] and `noise` [m] are the standard uncertainties of that peak
    due to the scatter of the cycles, to a remaining transient, and to the noise of the samples around a peak of single
    cycles. `u1` [m] is the first storey's peak, `amplitude` [m/s2] the amplitude of the table's acceleration and
    `harmonics` the relative rms of its harmonics. `readings` are the lasers' readings at the peak, `cycles` is the
    number of cycles, and `checks` holds the harmonics of both lasers' readings in a test of the bare frame. `freedom`
    is the number of degrees of freedom of the scatter. `used` are the cycles of which it is the peak, from which
    `without_rounding` corrects it; none for the peak of single cycles.
    """

    drift: float
    scatter: float
    transient: float
    u1: float
    amplitude: float
    harmonics: float
    readings: PeakReadings
    cycles: int
    checks: Checks | None = None
    freedom: float = inf
    noise: float = 0.0
    used: tuple[Cycle, ...] = ()


@dataclass(frozen=True)
class Gain:
    """alpha_2 with its expanded uncertainty (k = 2), the budget of standard uncertainties, and the linearity errors
    (`shapes`) on which the budget is based.
    """

    alpha_2: float
    budget: Budget
    shapes: Shapes

    @property
    def uncertainty(self) -> float:
        """Expanded uncertainty (k = 2)."""
        return self.budget.expanded


def steady_peak(
    cycles: Sequence[Cycle],
    omega: float,
    residual: float = 0.0,
    before: Sequence[Cycle] = (),
    frame: LinearFrame | None = None,
) -> SteadyPeak:
    """Peak of the mean cycle at `omega` [rad/s], relative to the mean over the cycle.

    Over a period of a steady motion the second storey gains no momentum, so the force k2 times drift, which alone
    drives it, has zero mean for any motion of the block. The mean is therefore a better zero of the sensors than a
    reading at rest before the test, in which the rounding error of each laser would enlarge the peak on one side. The
    scatter is that of the cycles at the peak (`bench.analysis.series_mean`). A remaining transient is estimated from
    `cycles` and those `before` them at the same drive; `residual`, the relative bound of a further systematic effect,
    is treated as a rectangular distribution. The harmonics of the readings of a linear `frame` check the linearity of
    the lasers.
    """
    waves = mean_waves(cycles, {DRIFT: PEAK_HARMONICS})
    every = mean_waves([*before, *cycles], {DRIFT: PEAK_HARMONICS}) if before else waves
    drift = float(waves.peaks[DRIFT])
    scatter, freedom = standard_error(waves.there[:, DRIFT])
    transient = hypot(remaining_transient(every.there[:, DRIFT], len(cycles)), residual * drift / sqrt(3.0))
    return SteadyPeak(
        drift=drift,
        scatter=scatter,
        transient=transient,
        u1=float(waves.peaks[U1]),
        amplitude=mean_amplitude(cycles, ACCELERATION),
        harmonics=float(waves.harmonics[ACCELERATION]),
        readings=_readings(cycles, waves, omega, drift),
        cycles=len(cycles),
        checks=None if frame is None else _checks(cycles, waves, omega, frame),
        freedom=freedom,
        used=tuple(cycles),
    )


@lru_cache(maxsize=64)
def without_rounding(peak: SteadyPeak, omega: float, step: float) -> SteadyPeak:
    """A peak at `omega` [rad/s], without the rounding errors of the lasers' outputs with steps of `step` [m], for each
    laser whose errors can be estimated. This takes up to a second: not while the table is driven.
    """
    readings, fitted = peak.readings, peak.readings.fitted
    if not isinstance(fitted, FittedPeak) or not peak.used:
        return peak
    errors, remaining = [0.0, 0.0], list(fitted.variances(step))
    for laser, column in enumerate((LASER_1, LASER_2)):
        found = rounding(peak.used, omega, column, fitted.phase, fitted.orders, step)
        if found is not None:
            errors[laser] = found.error
            remaining[laser] = found.variance + MODEL**2 * remaining[laser]
    first, second = errors
    drift = peak.drift - readings.sign * (second - first)
    lasers = readings.lasers[0] - first, readings.lasers[1] - second
    fitted = replace(fitted, remaining=(remaining[0], remaining[1]))
    return replace(peak, drift=drift, readings=replace(readings, drift=drift, lasers=lasers, fitted=fitted))


def _readings(cycles: Sequence[Cycle], waves: Waves, omega: float, drift: float) -> PeakReadings:
    """Lasers' readings at the peak of the mean cycle."""
    lasers = waves.waveform[:, [LASER_1, LASER_2]].T
    peak = waves.at[DRIFT]
    speeds = omega * waves.rates[peak, [LASER_1, LASER_2]]
    at = lasers[:, peak]
    swings = np.ptp(lasers, axis=1)
    step = max(lasers.shape[1] // ZERO_PLACES, 1)
    places: NDArray[np.float64] = np.arange(0.0, lasers.shape[1], step)
    angles = (places - peak) * (tau / lasers.shape[1])
    orders = np.arange(1, PEAK_HARMONICS + 1)
    harmonics = np.array(
        [
            [np.append(each.coefficients[0, column], -1j * each.harmonics(column)) for each in cycles]
            for column in (LASER_1, LASER_2)
        ]
    )
    return PeakReadings(
        drift=drift,
        sign=float(np.sign(waves.waveform[peak, DRIFT])),
        lasers=(float(at[0]), float(at[1])),
        speeds=(float(speeds[0]), float(speeds[1])),
        zero=lasers[:, ::step],
        swings=(float(swings[0]), float(swings[1])),
        at_rest=False,
        weights=(2.0 / angles.size) * np.cos(np.outer(angles, orders)).sum(axis=1),
        fitted=FittedPeak(harmonics, float(peak) * tau / lasers.shape[1], PEAK_HARMONICS),
    )


def _checks(cycles: Sequence[Cycle], waves: Waves, omega: float, frame: LinearFrame) -> Checks | None:
    """Harmonics of both lasers' readings, without those due to the table; None if only the fundamental was fitted."""
    fitted = min(cycle.fitted for cycle in cycles)
    if fitted < 2:
        return None
    table = np.array([cycle.harmonics(ACCELERATION)[1:fitted] for cycle in cycles]).mean(axis=0)
    orders = range(2, table.size + 2)
    moved = np.array([frame.readings(k * omega, complex(z)) for k, z in zip(orders, table, strict=True)]).reshape(-1, 2)
    bent = column_harmonics(frame.specimen.frame, omega, waves.waveform[:, [U1, DRIFT]].T, orders)
    found = list[Harmonics]()
    for column, real, columns in zip((LASER_1, LASER_2), moved.T, bent, strict=True):
        each = np.array([cycle.harmonics(column)[1:fitted] for cycle in cycles])
        scatter = np.sqrt(0.5 * np.mean(np.abs(each - each.mean(axis=0)) ** 2, axis=0) / max(len(cycles) - 1, 1))
        readings = waves.waveform[:, column]
        step = max(readings.size // CHECK_PLACES, 1)
        # Im(z exp(i k phase)) is Re(c exp(-i k phase)) with c = i z*
        error = 1j * (each.mean(axis=0) - real).conj()
        noise = np.hypot(scatter, FRAME_SHARE * np.abs(real))
        found.append(Harmonics(readings[::step], error, noise, columns=columns))
    return found[0], found[1]


def gain(
    coupled: SteadyPeak,
    bare: SteadyPeak,
    sensors: SensorUncertainty,
    amplitude_slope: float = 0.0,
    shared: Draws | None = None,
    shapes: Shapes | None = None,
) -> Gain:
    """alpha_2 = peak drift coupled / peak drift bare (Eq. 10) at one frequency.

    The lasers are the same in both tests, so their common errors cancel, including nearly all of a scale error: see
    `SensorUncertainty.drift_errors`. Since only the force k2 times drift acts on the second storey, the reading of a
    laser on the ground is the same multiple of the drift in both tests, except for damping and harmonics, and so is the
    effect of a scale error.

    `amplitude_slope` is d ln alpha_2 / d ln amplitude: the effect of a scale error of the table's acceleration on the
    gain at the stated amplitude; it cancels for a proportional response. The bare test checks the linearity of the
    lasers, unless `sensors` has checks already, from several tests.

    With `shared` draws (`bench.analysis.running_gain`) the uncertainty differs by at most 1e-9 (relative), and its
    calculation takes a fraction of the time. `shapes` are linearity errors of nearly the same motions, used in place of
    those of the two peaks.
    """
    alpha = coupled.drift / bare.drift
    draws = Draws(np.random.default_rng(SEED), DRAWS) if shared is None else shared
    sensors = sensors.checked_by(bare.checks)
    seen = (bare.readings, coupled.readings)
    found = sensors.shapes(seen) if shapes is None else shapes
    errors = sensors.drift_errors(seen, draws, found)
    parts = {name: float(np.std(each[1] / coupled.drift - each[0] / bare.drift)) for name, each in errors.items()}
    scatter = coupled.scatter / coupled.drift, bare.scatter / bare.drift
    parts |= {
        SCATTER: hypot(*scatter),
        TRANSIENT: hypot(coupled.transient / coupled.drift, bare.transient / bare.drift),
        "amplitude of the table": abs(amplitude_slope) * sensors.table_scale,
    }
    if coupled.noise or bare.noise:
        parts[NOISE] = hypot(coupled.noise / coupled.drift, bare.noise / bare.drift)
    freedom = {SCATTER: combined_freedom(zip(scatter, (coupled.freedom, bare.freedom), strict=True))}
    # a running gain, which has shared draws, omits the correlations
    correlations = {name: _correlation(each) for name, each in errors.items()} if shared is None else {}
    return Gain(alpha, Budget({name: alpha * value for name, value in parts.items()}, freedom, correlations), found)


def _correlation(errors: NDArray[np.float64]) -> float:
    """Correlation coefficient of the `errors` in the two tests, shape (2, n); 0 if there are none."""
    centred = errors - errors.mean(axis=1, keepdims=True)
    size = float(np.linalg.norm(centred[0]) * np.linalg.norm(centred[1]))
    return float(centred[0] @ centred[1]) / size if size > 0.0 else 0.0
