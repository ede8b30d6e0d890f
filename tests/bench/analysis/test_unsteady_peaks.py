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
from bench.analysis.output_errors import late, steps
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.signals import DRIFT, LASER_1, LASER_2, U1
from bench.analysis.smoothed_peaks import SmoothedPeaks
from bench.analysis.unsteady_peaks import (
    UnsteadyPeaks,
    _smoothed,  # pyright: ignore[reportPrivateUsage]
    unsteady_peaks,
)
from tests.made_cycles import WITHOUT_STEPS

Array = NDArray[np.float64]

SAMPLES, CYCLES, STEP = 840, 48, 5e-5
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
    # of two equal sides, the larger one is too large: the smallest of several is less too small than is corrected for
    assert (rms > (0.4 if offset or rise else 0.3, 0.4, 0.6)).all()


def beating(seed: int, changes: float) -> Array:
    """Drift whose amplitude changes with two incommensurate periods by a share."""
    random, time = np.random.default_rng(seed), np.arange(CYCLES * SAMPLES) / SAMPLES
    beats = np.sin(0.71 * time + random.uniform(0.0, 6.0)) + np.sin(0.27 * time + random.uniform(0.0, 6.0))
    return AMPLITUDE * (1.0 + 0.5 * changes * beats) * np.sin(2.0 * np.pi * time)


def peaks_of(lasers: Array, omega: float, accuracy: SensorAccuracy) -> UnsteadyPeaks:
    """Peaks seen by two lasers, shape (2, n)."""
    values = np.zeros((lasers.shape[1], 7))
    values[:, [LASER_1, LASER_2]], values[:, DRIFT] = lasers.T, lasers[1] - lasers[0]
    return unsteady_peaks(CycleAnalyser(2.0 * np.pi, SAMPLES, 0).push(values), omega, accuracy)


def errors_of(found: UnsteadyPeaks, drift: Array, accuracy: SensorAccuracy) -> list[float]:
    """Errors of the least, the mean and the greatest peak of a drift in stated standard uncertainties."""
    draws, errors = Draws(np.random.default_rng(0), 1000), list[float]()
    largest = sliding_window_view(np.abs(drift), SAMPLES).max(axis=1)
    true = largest.min(), largest.mean(), largest.max()
    for peak, expected in zip((found.least, found.mean, found.greatest), true, strict=True):
        moving = replace(peak.readings, at_rest=False)
        parts = [np.std(error(moving, laser, accuracy, draws)) for laser in (0, 1) for error in (steps, late)]
        errors.append((peak.drift - float(expected)) / float(np.linalg.norm([*parts, peak.noise])))
    return errors


@pytest.mark.parametrize("changes", [0.02, 0.3])
@pytest.mark.parametrize("runs", [20, pytest.param(200, marks=pytest.mark.soak)])
def test_errors_of_peaks_due_to_the_steps_of_lasers_are_stated(changes: float, runs: int) -> None:
    accuracy, errors = SensorAccuracy(laser_resolution=STEP, laser_timing=0.0), list[list[float]]()
    for seed in range(runs):
        random, drift = np.random.default_rng([seed, 1]), beating(seed, changes)
        rest = random.uniform(-1.0, 1.0, (2, 1)) * STEP
        lasers = np.stack((-0.4 * drift, 0.6 * drift)) + rest + 1e-6 * random.standard_normal((2, drift.size))
        found = peaks_of(STEP * np.round(lasers / STEP) - rest, 2.0 * np.pi, accuracy)
        errors.append(errors_of(found, drift, accuracy))
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    # of so many honest numbers, the rms is below with a probability of 99 %
    assert (rms < 1.0 + 1.8 / np.sqrt(runs)).all()
    assert (rms > (0.4, 0.2, 0.4)).all()


@pytest.mark.parametrize("runs", [20, pytest.param(200, marks=pytest.mark.soak)])
def test_errors_of_peaks_due_to_the_delays_of_lasers_are_stated(runs: int) -> None:
    """The storeys move together at the peaks of the drift, with other delays in each cycle."""
    accuracy, omega, errors = SensorAccuracy(laser_resolution=0.0), 15.0, list[list[float]]()
    time, raw = np.arange(CYCLES * SAMPLES) / SAMPLES, list[float]()
    for seed in range(runs):
        random, drift = np.random.default_rng([seed, 2]), beating(seed, 0.02)
        ages = random.uniform(-0.5, 0.5, (2, CYCLES)) * accuracy.laser_timing
        storey, speed = 3.0 * AMPLITUDE * np.cos(2.0 * np.pi * time), -3.0 * AMPLITUDE * np.sin(2.0 * np.pi * time)
        # between two peaks of the drift the delay changes smoothly
        every = np.array([np.interp(time, np.arange(CYCLES) + 0.5, each) for each in ages])
        lasers = np.stack((storey, storey + drift)) - omega * speed * every
        found = peaks_of(lasers, omega, accuracy)
        errors.append(errors_of(found, drift, accuracy))
        raw.append(max(float(cycle.extreme[DRIFT]) for cycle in found.used) / np.abs(drift).max() - 1.0)
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert (rms < 1.0 + 1.8 / np.sqrt(runs)).all()
    assert rms[2] > 0.4
    # by a standard uncertainty and more, without the correction
    assert abs(np.mean(errors, axis=0)[2]) < 0.6
    assert np.mean(raw) > 2e-3


def test_errors_of_several_peaks_due_to_steps_are_correlated_as_those_of_rounded_readings() -> None:
    """Of peaks on both sides, for any position of the steps."""
    random = np.random.default_rng(3)
    weights = np.full(9, 1.0 / 9.0)
    sides, turning = np.array([1.0, 1.0, -1.0, -1.0]), 3e-5 * np.linspace(-1.0, 1.0, 9) ** 2
    tops = np.array([[2.00e-3, 2.01e-3, -2.02e-3, -1.98e-3], [9.00e-3, 9.03e-3, -9.01e-3, -9.02e-3]])
    readings = tops[:, :, None] - sides[:, None] * turning
    rest = STEP * random.uniform(-0.5, 0.5, (20_000, 2, 1, 1))
    errors = STEP * np.round((readings + rest) / STEP) - readings - rest
    parts = sides * np.diff(errors @ weights, axis=1)[:, 0]
    peaks = SmoothedPeaks(readings, weights, sides)
    stated = peaks.covariance(STEP)
    # further terms of the sawtooth have about a tenth of the variance of such peaks
    assert stated == pytest.approx(np.cov(parts.T), abs=0.12 * float(stated.max()))
    assert stated.sum() == pytest.approx(sum(peaks.variances(STEP)))
    assert np.abs(stated - np.diag(np.diag(stated))).max() > 0.3 * float(stated.max())


def test_a_missing_cycle_leaves_stretches_of_different_lengths() -> None:
    """With 831.7 samples per cycle, a single cycle has another number of samples than most."""
    phase = 2.0 * np.pi / 831.7 * np.arange(round(20 * 831.7))
    values = np.zeros((phase.size, 7))
    values[:, DRIFT] = values[:, LASER_2] = AMPLITUDE * np.sin(phase)
    cycles = CycleAnalyser(2.0 * np.pi, 831.7, 0).push(values)
    assert {cycle.samples for cycle in cycles} == {831, 832}
    for last in range(3, 19):
        kept = [cycle for cycle in cycles if cycle.index != last]
        found = unsteady_peaks(kept, 15.0, SensorAccuracy())
        assert found.least.drift <= found.mean.drift <= found.greatest.drift
        assert found.greatest.drift == pytest.approx(AMPLITUDE, rel=1e-3)


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
