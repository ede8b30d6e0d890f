"""The oscillator: continuous in phase, amplitude and value; the same in blocks of any size."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.control.calibration import DriveCalibration
from bench.control.legs import Leg, program, sweeps
from bench.control.oscillator import Oscillator

RATE = 1000.0
LEGS = (Leg(2.0, 1.2, 22.0), Leg(3.0, 1.2, 16.0), Leg(0.5, 0.4, 16.0))


def _oscillator() -> Oscillator:
    oscillator = Oscillator(RATE)
    oscillator.use(DriveCalibration((10.0, 30.0), (2.0, 2.0)))
    for sweep in sweeps(LEGS, oscillator.amplitude, oscillator.omega):
        oscillator.follow(sweep)
    return oscillator


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(1, 900), min_size=1, max_size=12))
def test_block_sizes_do_not_matter(sizes: list[int]) -> None:
    whole = _oscillator().next(sum(sizes))
    oscillator = _oscillator()
    pieces = np.concatenate([oscillator.next(size) for size in sizes])
    np.testing.assert_allclose(pieces, whole, rtol=0, atol=1e-12)


def test_the_drive_is_the_base_motion_that_the_model_integrates_over_the_gain() -> None:
    volts = _oscillator().next(5500)
    rows = program(LEGS).packed()
    t = np.arange(1, 5501) / RATE
    edges = np.concatenate(([0.0], np.cumsum(rows[:, 0])))
    segment = np.minimum(np.searchsorted(edges, t, side="left") - 1, len(rows) - 1)
    local = t - edges[segment]
    amplitude = sum(rows[segment, 1 + power] * local**power for power in range(4))
    phase = rows[segment, 5] + rows[segment, 6] * local + 0.5 * rows[segment, 7] * local**2
    np.testing.assert_allclose(volts, amplitude * np.sin(phase) / 2.0, atol=1e-9)


def test_after_the_last_leg_the_sine_is_held() -> None:
    oscillator = _oscillator()
    oscillator.next(5500)
    held = oscillator.next(4000)
    t = np.arange(4000) / RATE
    basis = np.stack((np.cos(16.0 * t), np.sin(16.0 * t)), axis=1)
    fit, residual, *_ = np.linalg.lstsq(basis, held, rcond=None)
    assert np.hypot(*fit) == pytest.approx(0.2, rel=1e-9)
    assert residual[0] < 1e-18


def test_a_trim_changes_the_amplitude_without_a_jump() -> None:
    oscillator = _oscillator()
    before = oscillator.next(6000)
    oscillator.trim(1.1)
    after = oscillator.next(2000)
    steps = np.abs(np.diff(np.concatenate((before[-10:], after))))
    assert steps.max() < 0.22 * 16.0 / RATE * 1.1
    assert np.abs(after[-500:]).max() == pytest.approx(0.22, rel=1e-3)


def test_moving_before_calibration_is_refused() -> None:
    oscillator = Oscillator(RATE)
    oscillator.follow(sweeps((Leg(1.0, 1.0, 16.0),), 0.0, 16.0)[0])
    with pytest.raises(RuntimeError, match="before the drive was calibrated"):
        oscillator.next(10)
