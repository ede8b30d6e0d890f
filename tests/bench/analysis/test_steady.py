"""The steady-state detector on cycles whose transients are known."""

import numpy as np
import pytest

from bench.analysis.steady import SPREAD, WINDOW, SteadyDetector
from tests.made_cycles import pure_cycle


def _cycles_until_steady(multiplier: complex, tolerance: float) -> int:
    detector = SteadyDetector(tolerance)
    for k in range(2000):
        detector.push(pure_cycle(k, np.array([1.0 + 0.2 * multiplier**k, 3.0 + 0j])))
        if detector.judge().steady:
            return k
    return -1


@pytest.mark.parametrize("angle", [0.0, 1.0, 2.7, np.pi])
@pytest.mark.parametrize("modulus", [0.8, 0.95, 0.98])
def test_what_is_left_of_the_transient_moves_the_mean_by_about_the_tolerance_at_most(
    modulus: float, angle: float
) -> None:
    tolerance = 0.002
    multiplier = modulus * np.exp(1j * angle)
    k = _cycles_until_steady(multiplier, tolerance)
    assert k > 0
    following = 1.0 + 0.2 * multiplier ** np.arange(k + 1, k + 25)
    assert abs(np.mean(np.abs(following)) - 1.0) < 1.7 * tolerance
    assert 0.2 * modulus**k < 1.7 * SPREAD * tolerance


def test_one_window_is_never_enough() -> None:
    detector = SteadyDetector(0.01)
    for k in range(2 * WINDOW - 1):
        detector.push(pure_cycle(k, np.array([1.0 + 0j])))
        assert not detector.judge().steady
    detector.push(pure_cycle(99, np.array([1.0 + 0j])))
    assert detector.judge().steady


@pytest.mark.parametrize("period", [2, 3, 5])
def test_a_subharmonic_is_named(period: int) -> None:
    detector = SteadyDetector(0.002)
    for k in range(60):
        detector.push(pure_cycle(k, np.array([1.0 + 0.1 * np.cos(2.0 * np.pi * k / period)], dtype=complex)))
    found = detector.judge()
    assert not found.steady
    assert found.repeats == period


def test_a_motion_that_does_not_repeat_is_not_given_a_period() -> None:
    detector = SteadyDetector(0.002)
    for k in range(60):
        detector.push(pure_cycle(k, np.array([1.0 + 0.1 * np.cos(2.4 * k)], dtype=complex)))
    assert detector.judge().repeats == 0


def test_noise_of_the_stated_size_is_no_reason_to_wait() -> None:
    draw = np.random.default_rng(3)
    sigma = 0.05
    spread = sigma * np.sqrt(2.0 / 600)
    detector = SteadyDetector(0.0005)
    for k in range(2 * WINDOW):
        jitter = spread * (draw.standard_normal(1) + 1j * draw.standard_normal(1))
        detector.push(pure_cycle(k, 1.0 + jitter, sigma))
    assert detector.judge().steady


@pytest.mark.parametrize(("kin", "steady"), [((), False), ((0, 1), True)])
def test_a_storey_that_stands_almost_still_is_judged_on_its_kin(kin: tuple[int, ...], steady: bool) -> None:
    detector = SteadyDetector(0.002, kin=kin)
    for k in range(2 * WINDOW):
        detector.push(pure_cycle(k, np.array([0.01 * (1.0 + 0.04 * np.cos(2.4 * k)), 1.0], dtype=complex)))
    assert detector.judge().steady is steady


@pytest.mark.parametrize(("jitter", "steady"), [(0.0, False), (0.004, True)])
def test_a_phase_that_wanders_with_a_sensors_clock_is_no_transient(jitter: float, steady: bool) -> None:
    detector = SteadyDetector(0.002, jitter=jitter)
    for k in range(2 * WINDOW):
        detector.push(pure_cycle(k, np.array([np.exp(0.004j * (k >= WINDOW))])))
    assert detector.judge().steady is steady
