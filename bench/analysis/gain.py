"""The gain coefficient from measured cycles, with its uncertainty (GUM, and Monte Carlo of its Supplement 1)."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from bench.analysis.budget import COVERAGE as COVERAGE
from bench.analysis.budget import Budget
from bench.analysis.cycles import Cycle, Waves, mean_amplitude, mean_waves
from bench.analysis.sensor_accuracy import SensorAccuracy as SensorAccuracy
from bench.analysis.sensor_accuracy import SensorDoubt, Sighting
from bench.analysis.signals import ACCELERATION, DRIFT, LASER_1, LASER_2, U1

DRAWS, SEED = 4000, 1
"""Draws of what the sensors leave open: an expanded uncertainty from so many scatters by 1.1 %."""

ZERO_PLACES = 32
"""Places of a cycle that stand for its mean."""

PEAK_HARMONICS = 5
"""Highest harmonic that counts for the peak of a steady drift. The force of an impact reaches the second storey through
two springs and as many masses: what is above moves the peak by less than 1e-4, and the steps of the lasers more.
"""

PEAK_ROUNDINGS = 0.6 * (((PEAK_HARMONICS + 1) // 2) ** 2 + (PEAK_HARMONICS // 2) ** 2)
"""Mean square of the error of a steady peak by the steps of a laser, over that of the roundings of a cycle, averaged.

A sine of amplitude A, rounded to steps q, has in harmonic k the errors 2 q / (pi m) J_k(2 pi m A / q), m = 1, 2, ...,
times the sine (k odd) or cosine (k even) of where the steps lie. Their mean square, J_k^2 being 1 / (pi z) in the mean,
sums up to zeta(3) q^3 / (pi^4 A); the roundings of 4 A / q steps, each q^2 / 12, averaged, would be q^3 / (48 A). At
the turning point the errors of all odd harmonics have one sign, and so have those of all even ones: they add up there.
"""


@dataclass(frozen=True, eq=False)
class SteadyPeak:
    """The drift over measured cycles.

    `drift` [m] is its peak, `scatter` [m] the standard uncertainty of that peak from the cycles themselves, and `left`
    [m] that from a transient that may be left; `u1` [m] is the first storey's peak; `amplitude` [m/s2] is the table's
    and `harmonics` the rms of its harmonics over it; `seen` is what the lasers showed there, `cycles` how many were
    used.
    """

    drift: float
    scatter: float
    left: float
    u1: float
    amplitude: float
    harmonics: float
    seen: Sighting
    cycles: int


@dataclass(frozen=True)
class Gain:
    """alpha_2 with its expanded uncertainty (k = 2) and the budget of standard uncertainties that makes it."""

    alpha_2: float
    budget: Budget

    @property
    def uncertainty(self) -> float:
        """Expanded uncertainty (k = 2)."""
        return self.budget.expanded


def steady_peak(cycles: Sequence[Cycle], omega: float, residual: float = 0.0) -> SteadyPeak:
    """Peak of the mean cycle at `omega` [rad/s], counted from the mean over the cycle.

    Over a period of a steady motion the second storey gains no momentum, so the force k2 drift that alone drives it has
    the mean zero, whatever the block does: the mean shows the zero of the sensors better than a rest before the test,
    where one rounding of each laser stays. Picking the largest of both sides counts no such error as motion.

    The scatter is that of the cycles there, with correlated neighbours counted, M_eff = M (1 - r1) / (1 + r1).
    `residual`, the relative bound of a transient that may be left, counts as a rectangular distribution.
    """
    waves = mean_waves(cycles, {DRIFT: PEAK_HARMONICS})
    drift = float(waves.peaks[DRIFT])
    scatter, left = _standard_error(waves.there[:, DRIFT]), residual * drift / sqrt(3.0)
    seen = _sighting(waves, omega, drift, at_rest=False)
    return _peak(cycles, waves, seen, scatter, left, float(waves.peaks[U1]))


def modulated_peak(cycles: Sequence[Cycle], omega: float) -> SteadyPeak:
    """Largest peak met; the scatter is the spread of the largest peaks of four quarters of the cycles."""
    peaks = np.array([cycle.peak[DRIFT] for cycle in cycles])
    quarters = [quarter.max() for quarter in np.array_split(peaks, 4) if quarter.size]
    scatter = float(np.std(quarters, ddof=1)) if len(quarters) > 1 else float(peaks.max())
    u1 = float(np.max([cycle.peak[U1] for cycle in cycles]))
    waves = mean_waves(cycles)
    seen = _sighting(waves, omega, float(peaks.max()), at_rest=True)
    return _peak(cycles, waves, seen, scatter, 0.0, u1)


def _peak(cycles: Sequence[Cycle], waves: Waves, seen: Sighting, scatter: float, left: float, u1: float) -> SteadyPeak:
    return SteadyPeak(
        drift=seen.drift,
        scatter=scatter,
        left=left,
        u1=u1,
        amplitude=mean_amplitude(cycles, ACCELERATION),
        harmonics=float(waves.harmonics[ACCELERATION]),
        seen=seen,
        cycles=len(cycles),
    )


def _sighting(waves: Waves, omega: float, drift: float, *, at_rest: bool) -> Sighting:
    """What the lasers showed at the peak of the mean cycle."""
    lasers = waves.waveform[:, [LASER_1, LASER_2]].T
    speeds = omega * waves.rates[waves.at[DRIFT], [LASER_1, LASER_2]]
    at = lasers[:, waves.at[DRIFT]]
    swings = np.ptp(lasers, axis=1)
    return Sighting(
        drift=drift,
        sign=float(np.sign(waves.waveform[waves.at[DRIFT], DRIFT])),
        lasers=(float(at[0]), float(at[1])),
        speeds=(float(speeds[0]), float(speeds[1])),
        zero=np.zeros((2, 1)) if at_rest else lasers[:, :: max(lasers.shape[1] // ZERO_PLACES, 1)],
        swings=(float(swings[0]), float(swings[1])),
        terms=PEAK_ROUNDINGS,
        at_rest=at_rest,
    )


def _standard_error(series: NDArray[np.float64]) -> float:
    if series.size < 3:
        return float(np.ptp(series))
    deviation = series - series.mean()
    variance = float(deviation @ deviation) / (series.size - 1)
    if variance == 0.0:
        return 0.0
    r1 = float(deviation[1:] @ deviation[:-1]) / ((series.size - 1) * variance)
    r1 = min(max(r1, 0.0), 0.95)
    effective = max(series.size * (1.0 - r1) / (1.0 + r1), 1.0)
    return sqrt(variance / effective)


def gain(coupled: SteadyPeak, bare: SteadyPeak, sensors: SensorDoubt, amplitude_slope: float = 0.0) -> Gain:
    """alpha_2 = peak drift coupled / peak drift bare (Eq. 10) at one frequency.

    The lasers are the same in both tests, so what is off alike in both cancels: see `SensorDoubt.drift_errors`. That is
    nearly all of a scale. As the second storey is driven by k2 drift alone, what a laser on the ground sees of a storey
    is the same multiple of the drift in both tests, but for damping and harmonics, and so is what scales make of it.

    `amplitude_slope` is d ln alpha_2 / d ln amplitude: how far a common error of the scale of the table's acceleration,
    which cancels where the response is proportional, moves the gain that belongs to the stated amplitude.
    """
    alpha = coupled.drift / bare.drift
    errors = sensors.drift_errors((bare.seen, coupled.seen), np.random.default_rng(SEED), DRAWS)
    parts = {name: float(np.std(each[1] / coupled.drift - each[0] / bare.drift)) for name, each in errors.items()}
    parts |= {
        "scatter of the cycles": hypot(coupled.scatter / coupled.drift, bare.scatter / bare.drift),
        "transient that may be left": hypot(coupled.left / coupled.drift, bare.left / bare.drift),
        "amplitude of the table": abs(amplitude_slope) * sensors.table_scale,
    }
    return Gain(alpha, Budget({name: alpha * value for name, value in parts.items()}))
