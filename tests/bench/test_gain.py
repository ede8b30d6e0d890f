"""alpha_2 and its uncertainty from cycles."""

import numpy as np
import pytest

from bench.analysis.cycles import Cycle
from bench.analysis.gain import SensorAccuracy, SteadyPeak, gain, modulated_peak, steady_peak
from bench.analysis.signals import ACCELERATION, DRIFT
from tests.made_cycles import pure_cycle

EXACT = SensorAccuracy(laser_slope=0.0, laser_mismatch=0.0, laser_resolution=0.0)


def _cycles(drifts: np.ndarray) -> list[Cycle]:
    made = []
    for k, drift in enumerate(drifts):
        amplitudes = np.zeros(7, dtype=complex)
        amplitudes[ACCELERATION], amplitudes[DRIFT] = 1.2j, drift
        made.append(pure_cycle(k, amplitudes))
    return made


def _peak(drift: float, scatter: float = 0.0, seen: complex = 0.0) -> SteadyPeak:
    return SteadyPeak(drift, scatter, 0.001, 1.2, 0.0, seen, seen + drift, 24)


def test_the_gain_is_the_ratio_of_the_drifts() -> None:
    found = gain(_peak(0.008), _peak(0.04), EXACT)
    assert found.alpha_2 == pytest.approx(0.2)
    assert found.uncertainty == 0.0


def test_independent_contributions_add_in_squares_and_are_doubled() -> None:
    accuracy = SensorAccuracy(laser_slope=0.003, laser_mismatch=0.001, laser_resolution=0.0)
    found = gain(_peak(0.010, 1e-5, 0.008j), _peak(0.050, 1e-4, -0.020), accuracy)
    sees = 0.008**2 + (0.008**2 + 0.010**2)  # |0.008i|^2 + |0.010 + 0.008i|^2
    coupled = (1e-5**2 + 0.003**2 * sees + 0.001**2 * (0.008**2 + 0.005**2)) / 0.010**2
    bare = (1e-4**2 + 0.003**2 * (0.020**2 + 0.030**2) + 0.001**2 * 0.005**2) / 0.050**2
    assert found.uncertainty == pytest.approx(2.0 * 0.2 * np.sqrt(coupled + bare))


def test_the_scatter_of_independent_cycles_is_the_standard_error() -> None:
    draw = np.random.default_rng(1)
    errors = [steady_peak(_cycles(1.0 + 0.01 * draw.standard_normal(50))).scatter for _ in range(100)]
    assert np.mean(errors) == pytest.approx(0.01 / np.sqrt(50), rel=0.25)


def test_correlated_cycles_count_less() -> None:
    draw = np.random.default_rng(2)
    covered = 0
    for _ in range(300):
        series = np.empty(60)
        series[0] = draw.standard_normal()
        for k in range(1, 60):
            series[k] = 0.7 * series[k - 1] + np.sqrt(1.0 - 0.49) * draw.standard_normal()
        peak = steady_peak(_cycles(10.0 + series))
        covered += abs(peak.drift - 10.0) <= 2.0 * peak.scatter
    assert covered / 300 > 0.85  # two standard errors of independent samples would cover about 60 %


def test_a_modulated_motion_counts_with_its_largest_peak() -> None:
    drifts = 1.0 + 0.3 * np.sin(np.arange(40))
    assert modulated_peak(_cycles(drifts)).drift == drifts.max()


def test_a_transient_that_may_be_left_counts_as_a_rectangular_distribution() -> None:
    peak = steady_peak(_cycles(np.full(24, 0.01)), residual=0.0024)
    assert peak.scatter == pytest.approx(0.01 * 0.0024 / np.sqrt(3.0))


@pytest.mark.parametrize(("amplitude", "step"), [(4e-4, 5e-5), (1e-3, 5e-5), (1e-2, 5e-5)])
def test_the_steps_of_a_laser_move_a_fitted_amplitude_about_as_far_as_stated(amplitude: float, step: float) -> None:
    """Against sines of many offsets, rounded to the step and fitted: no code of the bench makes the errors."""
    t = np.arange(2000) * (2.0 * np.pi / 2000)
    errors = []
    for offset in np.linspace(0.0, 1.0, 101):
        rounded = np.round((amplitude * np.sin(t) + offset * step) / step) * step
        errors.append(2.0 * np.mean(rounded * np.sin(t)) - amplitude)
    accuracy = SensorAccuracy(laser_slope=0.0, laser_mismatch=0.0, laser_resolution=step)
    alone = SteadyPeak(amplitude, 0.0, 0.0, 1.2, 0.0, amplitude, 1e9, 24)
    stated = gain(alone, _peak(1.0, seen=1e9), accuracy).uncertainty / 2.0
    assert 0.3 * stated < np.hypot(np.std(errors), np.mean(errors)) < 1.5 * stated
