"""The target of a replication: in the band, at rest at both ends, its integrals consistent."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from bench.control.target import band_window
from tests.bench.control.virtual_table import RATE, earthquake, target_of

BAND = (1.0, 12.0)


def test_a_sine_passes_with_the_gain_of_the_filters() -> None:
    # Butterworth of order 4 forwards and backwards: 1 / (1 + (f_c / f)^8) at either end, no phase
    dt = 0.001
    t = dt * np.arange(40_000)
    for f, within in ((0.9, 1.0), (4.0, 1.0), (14.0, 1.0), (0.45, 0.0), (25.0, 0.0)):
        target = target_of(np.sin(2 * np.pi * f * t), dt, BAND)
        middle = slice(target.acceleration.size // 2 - 8_000, target.acceleration.size // 2 + 8_000)
        s = np.arange(target.acceleration.size)[middle] - target.rest
        gain = within / (1 + (BAND[0] / f) ** 8) / (1 + (f / BAND[1]) ** 8)
        expected = gain * np.sin(2 * np.pi * f * s / RATE)
        np.testing.assert_allclose(target.acceleration[middle], expected, rtol=0.0, atol=2e-3)


def test_velocity_and_displacement_end_where_they_began() -> None:
    record, dt = earthquake(4)
    target = target_of(record, dt, BAND)
    a = target.acceleration
    assert np.abs(a[:100]).max() < 1e-3 * np.abs(a).max()
    assert np.abs(a[-100:]).max() < 1e-3 * np.abs(a).max()
    velocity = cumulative_trapezoid(a, dx=1 / RATE, initial=0.0)
    displacement = cumulative_trapezoid(velocity, dx=1 / RATE, initial=0.0)
    peaks = target.peaks
    assert peaks["velocity"] == pytest.approx(np.abs(velocity).max(), rel=5e-3)
    # the filters ring on for ever: a trace of velocity at the first sample, summed over the whole record
    assert peaks["displacement"] == pytest.approx(np.abs(displacement).max(), abs=1e-4)
    assert abs(velocity[-1]) < 1e-3 * peaks["velocity"]
    # the record itself would go far beyond the stroke for its peak
    drift = cumulative_trapezoid(cumulative_trapezoid(record, dx=dt, initial=0.0), dx=dt)
    assert np.abs(drift).max() > 20.0 * peaks["displacement"]


def test_nothing_is_asked_for_outside_the_support() -> None:
    record, dt = earthquake(4)
    target = target_of(record, dt, BAND)
    spectrum, f = np.abs(np.fft.rfft(target.acceleration)), target.frequency
    low, high = target.support
    assert (low, high) == (0.5, 24.0)
    assert spectrum[(f <= low) | (f >= high)].max() < 1e-9 * spectrum.max()
    assert band_window(np.array([0.5, 0.63, 1.0, 12.0, 19.1, 24.0]), BAND) == pytest.approx([0, 1, 1, 1, 1, 0])


def test_scaled() -> None:
    record, dt = earthquake(4)
    target = target_of(record, dt, BAND)
    assert target.scaled(3.0).peaks["displacement"] == pytest.approx(3.0 * target.peaks["displacement"])
