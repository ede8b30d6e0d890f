"""Peaks of an unsteady motion: their noise, missing samples, and few samples per cycle."""

import numpy as np
import pytest
from scipy.signal import savgol_filter

from bench.analysis.cycles import Cycle, CycleAnalyser, fit_cycle
from bench.analysis.signals import DRIFT, LASER_1, LASER_2, U1
from bench.analysis.unsteady_peaks import _smoothed, unsteady_peaks  # pyright: ignore[reportPrivateUsage]

SAMPLES, CYCLES = 840, 48
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


@pytest.mark.parametrize("noise", [pytest.param(2e-5, marks=pytest.mark.soak), 1e-4])
def test_the_noise_of_a_peak_is_stated(noise: float) -> None:
    peaks = [unsteady_peaks([noisy(noise, seed)], 15.0).greatest for seed in range(400)]
    errors = np.array([peak.drift - PEAK for peak in peaks])
    stated = np.sqrt(np.mean([peak.noise**2 for peak in peaks]))
    # 400 values: the ratio of honest numbers is within 0.9 to 1.1 with a probability of 99.5 %
    assert np.std(errors) == pytest.approx(stated, rel=0.1)
    # the window is placed where the noise is largest
    assert abs(errors.mean()) < 0.5 * stated


def test_the_noise_of_the_smallest_and_the_largest_of_many_peaks_is_stated() -> None:
    """Of equal peaks the largest is too large and the smallest too small."""
    errors: list[list[float]] = []
    for seed in range(20):
        values = np.zeros((CYCLES * SAMPLES, 7))
        drift = AMPLITUDE * (np.sin(2.0 * np.pi / SAMPLES * np.arange(len(values)) + seed) + OFFSET)
        noise = 1e-4 * np.random.default_rng(seed).standard_normal((2, drift.size))
        values[:, LASER_1], values[:, LASER_2] = 0.5 * drift + noise[0], 1.5 * drift + noise[1]
        values[:, DRIFT] = values[:, LASER_2] - values[:, LASER_1]
        found = unsteady_peaks(CycleAnalyser(2.0 * np.pi, SAMPLES, 0).push(values), 15.0)
        errors.append([(peak.drift - PEAK) / peak.noise for peak in (found.least, found.mean, found.greatest)])
    assert (np.sqrt(np.mean(np.square(errors), axis=0)) < 1.5).all()


def test_the_smoothed_drift_is_that_of_an_independent_filter() -> None:
    values = np.random.default_rng(1).standard_normal((200, 3))
    smooth, _ = _smoothed(values, 6)
    assert smooth == pytest.approx(savgol_filter(values, 13, 2, axis=0, mode="interp"), abs=1e-12)


def test_missing_samples_do_not_move_the_peaks() -> None:
    whole = np.zeros((12 * SAMPLES, 7))
    phase = 2.0 * np.pi / SAMPLES * np.arange(len(whole))
    whole[:, DRIFT] = AMPLITUDE * np.sin(phase)
    whole[:, LASER_1], whole[:, LASER_2] = -0.5 * whole[:, DRIFT], 0.5 * whole[:, DRIFT]
    missing = whole.copy()
    for start in range(100, len(whole), 2 * SAMPLES):
        missing[start : start + 15] = np.nan
    for values in (whole, missing):
        found = unsteady_peaks(CycleAnalyser(2.0 * np.pi, SAMPLES, 0).push(values), 15.0)
        for peak in (found.least, found.mean, found.greatest):
            assert peak.drift == pytest.approx(AMPLITUDE, rel=1e-4)


@pytest.mark.parametrize("samples", [20, 40, 63])
def test_few_samples_per_cycle_are_enough(samples: int) -> None:
    values = np.zeros((12 * samples, 7))
    values[:, DRIFT] = np.sin(2.0 * np.pi / samples * np.arange(len(values)))
    found = unsteady_peaks(CycleAnalyser(2.0 * np.pi, samples, 0).push(values), 15.0)
    assert found.greatest.drift == pytest.approx(1.0, abs=0.02)
    assert found.greatest.noise < 0.02
