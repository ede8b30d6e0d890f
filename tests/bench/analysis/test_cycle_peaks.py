"""Peaks of single cycles: their noise, and the gains made of them."""

import numpy as np
import pytest

from bench.analysis.cycle_peaks import cycle_peaks
from bench.analysis.cycles import Cycle, fit_cycle
from bench.analysis.signals import DRIFT, LASER_1, LASER_2, U1

SAMPLES = 840
PHASE = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
AMPLITUDE, OFFSET = 0.02, 0.1
PEAK = AMPLITUDE * (1.0 + OFFSET)


def noisy(noise: float, seed: int) -> Cycle:
    """A sine of the drift at a random phase, seen by two lasers with white noise."""
    random = np.random.default_rng(seed)
    # one side is larger, so that there is one peak per period
    drift = AMPLITUDE * (np.sin(PHASE + random.uniform(0.0, 2.0 * np.pi)) + OFFSET)
    both = np.stack((0.5 * drift, 1.5 * drift)) + noise * random.standard_normal((2, SAMPLES))
    values = np.zeros((SAMPLES, 7))
    values[:, LASER_1], values[:, LASER_2] = both
    values[:, U1], values[:, DRIFT] = both[0], both[1] - both[0]
    cycle = fit_cycle(0, PHASE, values)
    assert cycle is not None
    return cycle


@pytest.mark.parametrize("noise", [2e-5, 1e-4])
def test_the_noise_of_a_peak_is_stated(noise: float) -> None:
    peaks = [cycle_peaks([noisy(noise, seed)], 15.0).greatest for seed in range(400)]
    errors = np.array([peak.drift - PEAK for peak in peaks])
    stated = np.sqrt(np.mean([peak.noise**2 for peak in peaks]))
    # 400 values: the ratio of honest numbers is within 0.9 to 1.1 with a probability of 99.5 %
    assert np.std(errors) == pytest.approx(stated, rel=0.1)
    # the window is placed where the noise is largest
    assert abs(errors.mean()) < 0.5 * stated


def test_the_mean_of_many_peaks_has_less_noise() -> None:
    cycles = [noisy(1e-4, seed) for seed in range(64)]
    found = cycle_peaks(cycles, 15.0)
    assert found.mean.noise == pytest.approx(found.greatest.noise / 8.0, rel=0.3)
    assert found.mean.cycles == found.greatest.cycles == 64
