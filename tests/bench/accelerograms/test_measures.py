"""Measures against closed forms of pulses, and against quadrature on a fine grid."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson

from bench.accelerograms.accelerogram import Accelerogram
from bench.accelerograms.measures import husid, measures

G = 9.80665


def record(acceleration: np.ndarray, dt: float) -> Accelerogram:
    return Accelerogram("a", acceleration, dt, "", "", "m/s2", "", {})


@pytest.mark.parametrize(("amplitude", "period"), [(3.0, 0.5), (0.2, 2.0)])
def test_a_full_sine(amplitude: float, period: float) -> None:
    # a = A sin wt over one period: v = A / w (1 - cos wt), d = A / w (t - sin wt / w)
    t = np.linspace(0.0, period, 4001)
    w = 2.0 * pi / period
    found = measures(record(amplitude * np.sin(w * t), period / 4000.0))
    assert found.pga == pytest.approx(amplitude, rel=1e-6)
    assert found.pgv == pytest.approx(2.0 * amplitude / w, rel=1e-6)
    assert found.pgd == pytest.approx(amplitude * period / w, rel=1e-6)
    assert found.final_velocity == pytest.approx(0.0, abs=1e-12)
    assert found.final_displacement == pytest.approx(amplitude * period / w, rel=1e-6)
    assert not found.drifts
    assert found.arias == pytest.approx(pi / (2.0 * G) * amplitude**2 * period / 2.0, rel=2e-6)


def test_a_half_sine_ends_with_its_velocity() -> None:
    t = np.linspace(0.0, 1.0, 2001)
    found = measures(record(np.sin(pi * t), 1.0 / 2000.0))
    assert found.final_velocity == pytest.approx(2.0 / pi, rel=1e-6)
    assert found.final_displacement == pytest.approx(1.0 / pi, rel=1e-6)
    assert found.drifts


def test_significant_duration_of_a_steady_sine() -> None:
    # whole periods of a steady sine gain energy evenly but for a ripple sin(2 w t) / (2 w)
    t = np.linspace(0.0, 100.0, 200_001)
    found = measures(record(np.sin(2.0 * pi * 10.0 * t), 100.0 / 200_000))
    ripple = 2.0 / (2.0 * 2.0 * pi * 10.0)
    assert found.significant_5_75 == pytest.approx(70.0, abs=ripple)
    assert found.significant_5_95 == pytest.approx(90.0, abs=ripple)


def test_significant_duration_of_a_decaying_sine() -> None:
    # energy 1 - exp(-2 c t): times of 5, 75, 95 per cent are ln(1 / 0.95), ln 4, ln 20 over 2 c
    c, t = 0.1, np.linspace(0.0, 100.0, 200_001)
    found = measures(record(np.exp(-c * t) * np.sin(2.0 * pi * 20.0 * t), 100.0 / 200_000))
    assert found.significant_5_75 == pytest.approx(np.log(4.0 * 0.95) / (2.0 * c), abs=0.02)
    assert found.significant_5_95 == pytest.approx(np.log(20.0 * 0.95) / (2.0 * c), abs=0.02)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=40).filter(lambda values: max(map(abs, values)) > 0.1),
    st.sampled_from([0.005, 0.02]),
)
def test_peaks_between_samples_and_energy(values: list[float], dt: float) -> None:
    # the straight lines on a grid 64 times as fine; a parabola through three points of it is exact for v, d and a^2
    a, parts = np.array(values), 64
    fine = np.interp(np.arange((a.size - 1) * parts + 1) / parts, np.arange(a.size), a)
    step = dt / parts
    velocity = np.concatenate(([0.0], np.cumsum(0.5 * step * (fine[1:] + fine[:-1]))))
    displacement = cumulative_simpson(velocity, dx=step, initial=0.0)
    found = measures(record(a, dt))
    scale = float(np.abs(a).max())
    assert found.pga == scale
    for peak, curve, slope in ((found.pgv, velocity, scale), (found.pgd, displacement, float(np.abs(velocity).max()))):
        top = float(np.abs(curve).max())
        assert top - 1e-9 * scale <= peak <= top + slope * step
    intensity = pi / (2.0 * G) * cumulative_simpson(fine**2, dx=step, initial=0.0)[::parts]
    assert husid(a, dt) == pytest.approx(intensity, rel=1e-3, abs=1e-3 * intensity[-1])
    assert found.arias == pytest.approx(intensity[-1], rel=1e-9)
    assert 0.0 <= found.significant_5_75 <= found.significant_5_95 <= dt * (a.size - 1)
