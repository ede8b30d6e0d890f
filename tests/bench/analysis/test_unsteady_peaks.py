"""Peaks of an unsteady motion: their noise, missing samples, and few samples per cycle."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from bench.analysis.cycles import Cycle, CycleAnalyser, fit_cycle
from bench.analysis.draws import Draws
from bench.analysis.gain import SteadyPeak
from bench.analysis.output_errors import steps as steps_of
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.signals import DRIFT, LASER_1, LASER_2, U1
from bench.analysis.unsteady_peaks import _smoothed, unsteady_peaks  # pyright: ignore[reportPrivateUsage]

Array = NDArray[np.float64]

SAMPLES, CYCLES, STEP = 840, 48, 5e-5
PHASE = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
AMPLITUDE, OFFSET = 0.02, 0.1
PEAK = AMPLITUDE * (1.0 + OFFSET)
WITHOUT_STEPS = SensorAccuracy(laser_resolution=0.0, laser_timing=0.0)


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
    peaks = [unsteady_peaks([noisy(noise, seed)], 15.0, WITHOUT_STEPS).greatest for seed in range(400)]
    errors = np.array([peak.drift - PEAK for peak in peaks])
    stated = np.sqrt(np.mean([peak.noise**2 for peak in peaks]))
    # 400 values: the ratio of honest numbers is within 0.9 to 1.1 with a probability of 99.5 %
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(stated, rel=0.1)
    # the window is placed where the noise is largest
    assert abs(errors.mean()) < 0.5 * stated


@pytest.mark.parametrize("offset", [0.0, OFFSET])
@pytest.mark.parametrize("rise", [0.0, 0.3])
def test_the_noise_of_the_smallest_and_the_largest_of_many_peaks_is_stated(offset: float, rise: float) -> None:
    """Of equal peaks, also on both sides, the largest is too large and the smallest too small."""
    errors: list[list[float]] = []
    # complete cycles, of which the first and the last have their peaks
    time = np.arange(CYCLES * SAMPLES) / SAMPLES
    size = AMPLITUDE * (1.0 + rise * np.floor(time) / CYCLES)
    largest = sliding_window_view(np.abs(size * (np.sin(2.0 * np.pi * time) + offset)), SAMPLES).max(axis=1)
    peaks = largest.min(), largest.mean(), largest.max()
    for seed in range(20):
        values = np.zeros((time.size, 7))
        drift = size * (np.sin(2.0 * np.pi * time) + offset)
        noise = 1e-4 * np.random.default_rng(seed).standard_normal((2, drift.size))
        values[:, LASER_1], values[:, LASER_2] = 0.5 * drift + noise[0], 1.5 * drift + noise[1]
        values[:, DRIFT] = values[:, LASER_2] - values[:, LASER_1]
        found = unsteady_peaks(CycleAnalyser(2.0 * np.pi, SAMPLES, 0).push(values), 15.0, WITHOUT_STEPS)
        seen = found.least, found.mean, found.greatest
        errors.append([(peak.drift - true) / peak.noise for peak, true in zip(seen, peaks, strict=True)])
    # 20 values of honest numbers have an rms below 1.4 with a probability of 99 %
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert (rms < 1.4).all()
    # of two sides, the larger one is too large: the smallest of several is less too small than it is corrected for
    assert (rms > (0.3, 0.4, 0.6)).all()


def rounded_motion(seed: int, changes: float) -> tuple[Array, Array]:
    """Drift whose amplitude changes with two incommensurate periods by this share, and what two lasers with steps and
    noise see of it.
    """
    random = np.random.default_rng(seed)
    time = np.arange(CYCLES * SAMPLES) / SAMPLES
    beats = np.sin(0.71 * time + random.uniform(0.0, 6.0)) + np.sin(0.27 * time + random.uniform(0.0, 6.0))
    drift = AMPLITUDE * (1.0 + 0.5 * changes * beats) * np.sin(2.0 * np.pi * time)
    rest = random.uniform(-1.0, 1.0, (2, 1)) * STEP
    lasers = np.stack((-0.4 * drift, 0.6 * drift)) + rest + 1e-6 * random.standard_normal((2, time.size))
    values = np.zeros((time.size, 7))
    values[:, [LASER_1, LASER_2]] = (STEP * np.round(lasers / STEP) - rest).T
    values[:, DRIFT] = values[:, LASER_2] - values[:, LASER_1]
    return drift, values


@pytest.mark.parametrize("changes", [0.02, 0.3])
@pytest.mark.parametrize("runs", [24, pytest.param(200, marks=pytest.mark.soak)])
def test_errors_of_peaks_due_to_the_steps_of_lasers_are_stated(changes: float, runs: int) -> None:
    draws, errors = Draws(np.random.default_rng(0), 1000), list[list[float]]()
    accuracy = SensorAccuracy(laser_resolution=STEP, laser_timing=0.0)
    for seed in range(runs):
        drift, values = rounded_motion(seed, changes)
        largest = sliding_window_view(np.abs(drift), SAMPLES).max(axis=1)
        found = unsteady_peaks(CycleAnalyser(2.0 * np.pi, SAMPLES, 0).push(values), 2.0 * np.pi, accuracy)
        row = list[float]()
        for peak, true in zip(
            (found.least, found.mean, found.greatest), (largest.min(), largest.mean(), largest.max()), strict=True
        ):
            moving = replace(peak.readings, at_rest=False)
            steps = [float(np.std(steps_of(moving, laser, accuracy, draws))) for laser in (0, 1)]
            row.append((peak.drift - float(true)) / float(np.hypot(np.hypot(*steps), peak.noise)))
        errors.append(row)
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    # of so many honest numbers, the rms is below with a probability of 99 %
    assert (rms < 1.0 + 1.8 / np.sqrt(runs)).all()
    assert (rms > (0.4, 0.2, 0.4)).all()


@pytest.mark.parametrize("phase", [0.0, 0.9, 2.5])
@pytest.mark.parametrize("offset", [0.0, 0.2])
def test_the_mean_of_many_peaks_has_the_mean_error_of_the_lasers(phase: float, offset: float) -> None:
    """Of their linearity, of the zero and of their steps, wherever a cycle begins."""
    time = np.arange(96 * SAMPLES) / SAMPLES
    drift = AMPLITUDE * (offset + np.sin(2.0 * np.pi * time + phase) * (1.0 + 0.3 * np.sin(0.7 * time)))

    def mean(error: np.ndarray, zero: float = 0.0) -> SteadyPeak:
        values = np.zeros((time.size, 7))
        values[:, LASER_1], values[:, LASER_2], values[:, DRIFT] = 0.5 * drift, 1.5 * drift, drift + error + zero
        return unsteady_peaks(CycleAnalyser(2.0 * np.pi, SAMPLES, 0).push(values), 15.0, WITHOUT_STEPS).mean

    exact = mean(0.0 * drift)
    effect = exact.readings.effect(1)
    size = AMPLITUDE * 1e-3
    moved = mean(size * np.sin(70.0 * 1.5 * drift)).drift - exact.drift
    assert moved == pytest.approx(float(effect.weights @ (size * np.sin(70.0 * effect.places))), abs=0.03 * size)
    assert mean(0.0 * drift, size).drift - exact.drift == pytest.approx(exact.readings.sides * size, abs=0.03 * size)


def test_the_smoothed_drift_is_that_of_an_independent_filter() -> None:
    values = np.random.default_rng(1).standard_normal((200, 3))
    smooth, noise, slope = _smoothed(values, 6)
    assert smooth == pytest.approx(savgol_filter(values, 13, 2, axis=0, mode="interp"), abs=1e-12)
    # of white noise with the standard deviation 1
    response = savgol_filter(np.eye(41)[20], 13, 2)
    assert noise == pytest.approx(np.linalg.norm(response), rel=0.2)
    assert slope == pytest.approx(np.linalg.norm(np.diff(response)), rel=0.2)


def test_missing_samples_do_not_move_the_peaks() -> None:
    whole = np.zeros((12 * SAMPLES, 7))
    phase = 2.0 * np.pi / SAMPLES * np.arange(len(whole))
    whole[:, DRIFT] = AMPLITUDE * np.sin(phase)
    whole[:, LASER_1], whole[:, LASER_2] = -0.5 * whole[:, DRIFT], 0.5 * whole[:, DRIFT]
    missing = whole.copy()
    for start in range(100, len(whole), 2 * SAMPLES):
        missing[start : start + 15] = np.nan
    for values in (whole, missing):
        found = unsteady_peaks(CycleAnalyser(2.0 * np.pi, SAMPLES, 0).push(values), 15.0, WITHOUT_STEPS)
        for peak in (found.least, found.mean, found.greatest):
            assert peak.drift == pytest.approx(AMPLITUDE, rel=1e-4)


@pytest.mark.parametrize("samples", [20, 40, 63])
def test_few_samples_per_cycle_are_enough(samples: int) -> None:
    values = np.zeros((12 * samples, 7))
    values[:, DRIFT] = np.sin(2.0 * np.pi / samples * np.arange(len(values)))
    found = unsteady_peaks(CycleAnalyser(2.0 * np.pi, samples, 0).push(values), 15.0, WITHOUT_STEPS)
    assert found.greatest.drift == pytest.approx(1.0, abs=0.02)
    assert found.greatest.noise < 0.02
