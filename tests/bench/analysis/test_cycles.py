"""Cycle fits against signals whose amplitudes are known."""

import numpy as np
import pytest

from bench.analysis.cycles import CycleAnalyser, fit_cycle, mean_waves
from bench.analysis.signals import SIGNALS


def _signal(t: np.ndarray, omega: float) -> np.ndarray:
    """Mean 0.3, fundamental 2 at a lag of 0.4 rad, third harmonic 0.25."""
    return 0.3 + 2.0 * np.cos(omega * t - 0.4) + 0.25 * np.sin(3.0 * omega * t)


def test_a_fit_recovers_mean_fundamental_and_harmonics() -> None:
    rate, omega = 2000.0, 17.3
    n = int(2.0 * np.pi / omega * rate)
    t = np.arange(n) / rate
    cycle = fit_cycle(0, omega * t, _signal(t, omega)[:, None])
    assert cycle is not None
    assert cycle.coefficients[0, 0] == pytest.approx(0.3, abs=1e-12)
    assert cycle.fundamental[0] == pytest.approx(2.0 * np.exp(0.4j), abs=1e-12)
    assert mean_waves([cycle]).harmonics[0] == pytest.approx(0.125, abs=1e-12)
    assert cycle.noise[0] < 1e-12


def test_the_peak_is_that_of_the_curve_not_of_the_samples() -> None:
    omega = 17.3
    coarse = np.arange(40) / 40 * 2.0 * np.pi / omega + 0.003
    fine = np.linspace(0.0, 2.0 * np.pi / omega, 2_000_001)
    cycle = fit_cycle(0, omega * coarse, _signal(coarse, omega)[:, None])
    assert cycle is not None
    assert cycle.peak[0] == pytest.approx(np.abs(_signal(fine, omega)).max(), rel=2e-6)


def test_noise_does_not_raise_the_peak() -> None:
    rate, omega, sigma = 2000.0, 16.0, 0.02
    noise = np.random.default_rng(5)
    peaks = []
    for _ in range(200):
        t = np.arange(785) / rate
        cycle = fit_cycle(0, omega * t, (np.cos(omega * t) + sigma * noise.standard_normal(t.size))[:, None])
        assert cycle is not None
        peaks.append(cycle.peak[0])
    picked = 1.0 + sigma * np.sqrt(2.0 * np.log(60.0))  # what taking the largest sample would give
    assert np.mean(peaks) == pytest.approx(1.0, abs=0.1 * (picked - 1.0))


def test_cycles_do_not_depend_on_the_size_of_the_blocks() -> None:
    rate, omega = 1000.0, 14.7
    t = np.arange(5000) / rate
    values = _signal(t, omega)[:, None]
    whole = CycleAnalyser(omega, rate, 0).push(values)
    pieces = CycleAnalyser(omega, rate, 0)
    parts = [cycle for chunk in np.array_split(values, 71) for cycle in pieces.push(chunk)]
    assert len(whole) == len(parts) == int(5.0 * omega / (2.0 * np.pi))
    assert all(np.array_equal(a.fundamental, b.fundamental) for a, b in zip(whole, parts, strict=True))


def test_a_cycle_with_few_missing_samples_is_fitted_and_one_with_many_is_left_out() -> None:
    omega = 16.0
    t = np.arange(700) / 2000.0
    values = _signal(t, omega)[:, None]
    values[100:110] = np.nan
    cycle = fit_cycle(0, omega * t, values)
    assert cycle is not None
    assert cycle.fundamental[0] == pytest.approx(2.0 * np.exp(0.4j), abs=1e-10)
    values[100:130] = np.nan
    assert fit_cycle(0, omega * t, values) is None


def test_the_mean_of_noisy_cycles_has_no_bias_where_the_mean_of_their_peaks_has_one() -> None:
    rate, omega, sigma = 2000.0, 20.0, 0.2
    noise = np.random.default_rng(8)
    t = np.arange(628) / rate
    cycles = []
    for k in range(400):
        cycle = fit_cycle(k, omega * t, (np.cos(omega * t) + sigma * noise.standard_normal(t.size))[:, None])
        assert cycle is not None
        cycles.append(cycle)
    waves = mean_waves(cycles)
    peaks, there = waves.peaks, waves.there
    error = there.std() / 20.0
    assert peaks[0] == pytest.approx(1.0, abs=3.0 * error)
    assert there.mean() == pytest.approx(peaks[0], rel=1e-4)
    assert np.mean([cycle.peak[0] for cycle in cycles]) > 1.0 + 3.0 * error


def test_cycles_with_different_numbers_of_harmonics_have_a_mean() -> None:
    """At 15.5 rad/s and 100 samples/s, a cycle has 40 or 41 samples: nine or ten harmonics."""
    omega, rate = 15.5, 100.0
    t = np.arange(round(30 * 2.0 * np.pi / omega * rate)) / rate
    signal = 2.0 * np.sin(omega * t) + 0.3 * np.cos(3.0 * omega * t)
    cycles = CycleAnalyser(omega, rate, 0).push(np.repeat(signal[:, None], len(SIGNALS) + 1, axis=1))
    assert len({each.coefficients.shape for each in cycles}) == 2
    found = mean_waves(cycles)
    expected = mean_waves([each for each in cycles if len(each.coefficients) == 19])
    assert found.waveform.shape == expected.waveform.shape
    np.testing.assert_allclose(found.peaks, expected.peaks, rtol=1e-6)
    np.testing.assert_allclose(found.harmonics, 0.15, rtol=1e-6)


@pytest.mark.parametrize("samples", [0, 1, 4])
def test_too_few_samples_for_one_harmonic_have_no_fit(samples: int) -> None:
    assert fit_cycle(0, np.arange(float(samples)), np.ones((samples, 1))) is None
