"""What the sensors leave open of the measured gains: drawn for both tests at once, because they share the sensors."""

import numpy as np
from numpy.random import SeedSequence
from numpy.typing import NDArray

from bench.analysis.sensor_accuracy import SensorDoubt, Sighting
from protocols.earthquake.observed import PeakSeen

Array = NDArray[np.float64]

NOISE = "noise of the peaks"
"""The contribution that is not the sensors' but each test's own."""


def drift_errors(
    peaks: tuple[PeakSeen, PeakSeen], sensors: SensorDoubt, n: int, seed: int | SeedSequence
) -> dict[str, Array]:
    """Relative errors of the drift's peaks, bare and coupled, each drawn `n` times, by contribution; shapes (2, n)."""
    random = np.random.default_rng(seed)
    noise = np.array([_noise(peak, random, n) for peak in peaks])
    drifts = np.array([[peak.peak.value] for peak in peaks])
    errors = sensors.drift_errors([_sighting(peak) for peak in peaks], random, n)
    return {NOISE: noise} | {name: each / drifts for name, each in errors.items()}


def u1_errors(
    peaks: tuple[PeakSeen, PeakSeen], sensors: SensorDoubt, grounded: bool, n: int, seed: int | SeedSequence
) -> Array:
    """Relative errors of the peaks of u1, shape (2, n); a laser on the ground needs the displacement sensor too."""
    random = np.random.default_rng(seed)
    seen = [_sighting(peak) for peak in peaks]
    sides = np.array([[each.sign] for each in seen])
    errors = sides * sensors.linearity(0, seen, random, n)
    if grounded:
        errors += np.outer([peak.table for peak in peaks], sensors.table_scale * random.standard_normal(n))
    for row, each in zip(errors, seen, strict=True):
        row += sensors.late(each, 0, random, n) + sensors.steps(each, 0, random, n)
    errors /= np.array([[peak.peak.value] for peak in peaks])
    return errors + np.array([_noise(peak, random, n) for peak in peaks])


def _noise(seen: PeakSeen, random: np.random.Generator, n: int) -> Array:
    peak = seen.peak
    return (peak.uncertainty * random.standard_normal(n) + peak.bias * random.uniform(-1.0, 1.0, n)) / peak.value


def _sighting(seen: PeakSeen) -> Sighting:
    """A peak that is counted from the rest."""
    sign = float(seen.peak.sign)
    return Sighting(
        drift=seen.peak.value,
        sign=sign,
        lasers=(sign * seen.lasers[0], sign * seen.lasers[1]),
        speeds=seen.speeds,
        zero=np.zeros((2, 1)),
        swings=seen.swings,
        terms=1.0,
        at_rest=True,
    )
