"""What the sensors leave open of the measured gains: drawn for both tests at once, because they share the sensors.

A laser's linearity error is a smooth curve over its range R, with a few waves and at most `laser_linearity` R high: a
sine of unknown phase stands for it. What a storey saw between rest and peak is off by the difference of two of its
values. So the slope over small motions may be off by more than over large ones, and two tests with like motions are
off alike: in their ratio most of it cancels.
"""

from math import pi, sqrt

import numpy as np
from numpy.random import SeedSequence
from numpy.typing import NDArray

from bench.analysis.gain import SensorAccuracy
from protocols.earthquake.observed import PeakSeen

Array = NDArray[np.float64]

WAVES = (0.5, 2.0)
"""How many waves a linearity error may have within the range."""


def drift_errors(
    peaks: tuple[PeakSeen, PeakSeen],
    accuracy: SensorAccuracy,
    ranges: tuple[float, float],
    n: int,
    seed: int | SeedSequence,
) -> tuple[Array, Array]:
    """Relative errors of the drift's peaks, bare and coupled, each drawn `n` times: by noise, and by the lasers.

    Shapes (2, n). Linearity, and the difference between the lasers' scales, are the same in both tests. How late a
    laser is, and how its steps fall, is another matter each time.
    """
    random = np.random.default_rng(seed)
    noise = np.array([_noise(peak, random, n) for peak in peaks])
    lasers = np.zeros((2, n))
    for k, sign in enumerate((-1.0, 1.0)):
        seen = np.array([peak.peak.sign * peak.lasers[k] for peak in peaks])
        sides = np.array([[peak.peak.sign] for peak in peaks])
        lasers += sign * sides * _linearity(seen, accuracy.laser_linearity, ranges[k], random, n)
    mismatch = accuracy.laser_mismatch * random.standard_normal(n)
    lasers += np.outer([0.5 * sum(peak.lasers) for peak in peaks], mismatch)
    for row, peak in zip(lasers, peaks, strict=True):
        for k in range(2):
            row += peak.speeds[k] * _late(accuracy, random, n) + _steps(peak, k, accuracy, random, n)
    return noise, lasers / np.array([[peak.peak.value] for peak in peaks])


def u1_errors(
    peaks: tuple[PeakSeen, PeakSeen],
    accuracy: SensorAccuracy,
    ranges: tuple[float, float],
    grounded: bool,
    n: int,
    seed: int | SeedSequence,
) -> Array:
    """Relative errors of the peaks of u1, shape (2, n); a laser on the ground needs the displacement sensor too."""
    random = np.random.default_rng(seed)
    seen = np.array([peak.peak.sign * peak.lasers[0] for peak in peaks])
    sides = np.array([[peak.peak.sign] for peak in peaks])
    errors = sides * _linearity(seen, accuracy.laser_linearity, ranges[0], random, n)
    if grounded:
        errors += np.outer([peak.table for peak in peaks], accuracy.table_scale * random.standard_normal(n))
    for row, peak in zip(errors, peaks, strict=True):
        row += peak.speeds[0] * _late(accuracy, random, n) + _steps(peak, 0, accuracy, random, n)
    errors /= np.array([[peak.peak.value] for peak in peaks])
    return errors + np.array([_noise(peak, random, n) for peak in peaks])


def _noise(seen: PeakSeen, random: np.random.Generator, n: int) -> Array:
    peak = seen.peak
    return (peak.uncertainty * random.standard_normal(n) + peak.bias * random.uniform(-1.0, 1.0, n)) / peak.value


def _linearity(seen: Array, share: float, whole: float, random: np.random.Generator, n: int) -> Array:
    """Errors [m] of motions `seen` [m] of one laser with the range `whole` [m], shape (2, n)."""
    waves, phase = random.uniform(*WAVES, n), random.uniform(0.0, 2.0 * pi, n)
    turn = np.outer(seen, 2.0 * pi * waves / whole)
    return share * whole * (np.sin(turn + phase) - np.sin(phase))


def _late(accuracy: SensorAccuracy, random: np.random.Generator, n: int) -> Array:
    """How late a free-running laser is [s]: somewhere within one of its measurements."""
    return accuracy.laser_timing * random.uniform(-0.5, 0.5, n)


def _steps(seen: PeakSeen, k: int, accuracy: SensorAccuracy, random: np.random.Generator, n: int) -> Array:
    """Error from a laser's steps [m]: of the fit, the rounding of one step, averaged over those within the window; and
    of the zero, which was taken at rest, where nothing averages it.
    """
    step = accuracy.laser_resolution
    passed = 1.0 + 2.0 * seen.swings[k] / step if step > 0.0 else 1.0
    return step * (random.standard_normal(n) / sqrt(12.0 * passed) + random.uniform(-0.5, 0.5, n))
