"""The gain coefficient from measured cycles, with its uncertainty (GUM, first order)."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from bench.analysis.cycles import Cycle, mean_amplitude, mean_cycle
from bench.analysis.signals import ACCELERATION, DRIFT, LASER_1, LASER_2, U1
from sim.parameters import Parameters, quantity

COVERAGE = 2.0
"""Coverage factor k of every stated uncertainty."""


class SensorAccuracy(Parameters):
    """What the sensors' data sheets and calibrations leave open: standard uncertainties."""

    laser_slope: float = quantity(
        0.003, "1", "relative error of one laser's slope over the motion it sees (linearity)", ge=0, le=0.1
    )
    laser_mismatch: float = quantity(
        0.001, "1", "relative difference between the scales of the two lasers", ge=0, le=0.1
    )
    laser_resolution: float = quantity(5e-5, "m", "smallest step of a laser's output", ge=0, le=0.01)
    laser_timing: float = quantity(
        2.5e-4, "s", "how far a laser's delay wanders because it runs free: one of its measurements", ge=0, le=0.01
    )
    laser_linearity: float = quantity(
        0.0008, "1", "largest linearity error of a laser over its measuring range, as on its data sheet", ge=0, le=0.05
    )
    table_scale: float = quantity(
        0.005, "1", "relative error of the scales of the table's accelerometer and displacement sensor", ge=0, le=0.1
    )


@dataclass(frozen=True)
class SteadyPeak:
    """The drift over measured cycles.

    `drift` [m] is its peak and `scatter` [m] the standard uncertainty of that peak from the cycles themselves; `u1` [m]
    is the first storey's peak; `amplitude` [m/s2] is the table's and `harmonics` the rms of its harmonics over it;
    `laser_1` and `laser_2` [m] are the complex amplitudes of what the lasers see, `cycles` how many were used.
    """

    drift: float
    scatter: float
    u1: float
    amplitude: float
    harmonics: float
    laser_1: complex
    laser_2: complex
    cycles: int


@dataclass(frozen=True)
class Gain:
    """alpha_2 with its expanded uncertainty (k = 2)."""

    alpha_2: float
    uncertainty: float


def steady_peak(cycles: Sequence[Cycle], residual: float = 0.0) -> SteadyPeak:
    """Peak of the mean cycle.

    Its scatter is that of the cycles there, with correlated neighbours counted, M_eff = M (1 - r1) / (1 + r1), and
    `residual`, the relative bound of a transient that may be left, as a rectangular distribution.
    """
    peaks, there, harmonics = mean_cycle(cycles)
    left = residual * float(peaks[DRIFT]) / sqrt(3.0)
    scatter = hypot(_standard_error(there[:, DRIFT]), left)
    return _peak(cycles, float(peaks[DRIFT]), scatter, float(peaks[U1]), float(harmonics[ACCELERATION]))


def modulated_peak(cycles: Sequence[Cycle]) -> SteadyPeak:
    """Largest peak met; the scatter is the spread of the largest peaks of four quarters of the cycles."""
    peaks = np.array([cycle.peak[DRIFT] for cycle in cycles])
    quarters = [quarter.max() for quarter in np.array_split(peaks, 4) if quarter.size]
    scatter = float(np.std(quarters, ddof=1)) if len(quarters) > 1 else float(peaks.max())
    _, _, harmonics = mean_cycle(cycles)
    u1 = float(np.max([cycle.peak[U1] for cycle in cycles]))
    return _peak(cycles, float(peaks.max()), scatter, u1, float(harmonics[ACCELERATION]))


def _peak(cycles: Sequence[Cycle], drift: float, scatter: float, u1: float, harmonics: float) -> SteadyPeak:
    mean = np.mean([cycle.fundamental for cycle in cycles], axis=0)
    return SteadyPeak(
        drift=drift,
        scatter=scatter,
        u1=u1,
        amplitude=mean_amplitude(cycles, ACCELERATION),
        harmonics=harmonics,
        laser_1=complex(mean[LASER_1]),
        laser_2=complex(mean[LASER_2]),
        cycles=len(cycles),
    )


def _standard_error(series: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
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


def gain(coupled: SteadyPeak, bare: SteadyPeak, accuracy: SensorAccuracy) -> Gain:
    """alpha_2 = peak drift coupled / peak drift bare (Eq. 10) at one frequency.

    A common scale of the lasers cancels. What is left of each drift is its scatter, the slope error of each laser over
    all that it sees, the steps of its output, and a difference d between the lasers' scales, which lets
    d (laser_1 + laser_2) / 2 through: each laser sees much more than the drift, the table's motion included.
    The accelerometer's scale error is common to both tests and cancels as far as the response is proportional to
    the amplitude.
    """
    alpha = coupled.drift / bare.drift
    relative = hypot(_relative(coupled, accuracy), _relative(bare, accuracy))
    return Gain(alpha, COVERAGE * alpha * relative)


def _relative(peak: SteadyPeak, accuracy: SensorAccuracy) -> float:
    slope = accuracy.laser_slope * hypot(abs(peak.laser_1), abs(peak.laser_2))
    mismatch = accuracy.laser_mismatch * abs(peak.laser_1 + peak.laser_2) / 2.0
    steps = hypot(*(_rounding(abs(seen), accuracy.laser_resolution) for seen in (peak.laser_1, peak.laser_2)))
    return hypot(peak.scatter, slope, mismatch, steps) / peak.drift


def _rounding(amplitude: float, step: float) -> float:
    """Error of a fitted amplitude from steps: step / sqrt(12), averaged over the 4 A / step roundings of a cycle.

    The roundings of one cycle are those of the next, so more cycles do not average them further.
    """
    if step == 0.0:
        return 0.0
    return step / sqrt(12.0) * min(sqrt(2.0 * step / (4.0 * max(amplitude, step))), 1.0)
