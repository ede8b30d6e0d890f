"""Response spectra against closed forms and against scipy's integration."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bench.analysis.response_spectrum import logarithmic_periods, pseudo_acceleration
from sim.errors import InvalidInput


@pytest.mark.parametrize("ratio", [0.3, 0.7, 1.6, 3.0])
def test_half_sine_pulse_without_damping(ratio: float) -> None:
    # Chopra, Dynamics of Structures, sec. 4.8: r = t_d / T; a pulse of 1 m/s2 and length 1 s
    period = 1.0 / ratio
    t = np.linspace(0.0, 1.0, 200_001)
    forced = np.abs((np.sin(np.pi * t) - np.sin(2 * np.pi * ratio * t) / (2 * ratio)) / (1 - 1 / (4 * ratio**2)))
    free = abs((1 / ratio) * np.cos(np.pi * ratio) / (1 / (4 * ratio**2) - 1))
    record = np.sin(np.pi * np.linspace(0.0, 1.0, 2001))
    found = pseudo_acceleration(record, 1.0 / 2000.0, np.array([period]), 0.0)
    assert found[0] == pytest.approx(max(float(forced.max()), free), rel=2e-6)


def test_a_step_overshoots_by_the_closed_form() -> None:
    zeta = 0.05
    found = pseudo_acceleration(np.ones(4001), 0.001, np.array([0.4, 1.1]), zeta)
    assert found == pytest.approx(1.0 + np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=1e-5)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.7])
def test_harmonic_steady_state(ratio: float) -> None:
    # dynamic amplification 1 / sqrt((1 - q^2)^2 + (2 zeta q)^2); eased in so slowly that no transient is left
    period, zeta, dt = 0.5, 0.05, 0.001
    t = dt * np.arange(60_000)
    ease = np.sin(0.5 * np.pi * np.clip(np.minimum(t, 60.0 - t) / 20.0, 0.0, 1.0)) ** 2
    record = ease * np.sin(2 * np.pi * ratio / period * t)
    found = pseudo_acceleration(record, dt, np.array([period]), zeta)
    assert found[0] == pytest.approx(1 / np.hypot(1 - ratio**2, 2 * zeta * ratio), rel=2e-4)


@pytest.mark.parametrize("dt", [0.002, pytest.param(0.01, marks=pytest.mark.soak), 0.02])
def test_any_record_against_integration(dt: float) -> None:
    record = np.convolve(np.random.default_rng(3).standard_normal(150), np.hanning(5), "same")
    periods, zeta = np.array([0.05, 0.2, 1.0]), 0.05
    times = dt * np.arange(record.size)
    found = pseudo_acceleration(record, dt, periods, zeta)
    for period, value in zip(periods, found, strict=True):
        omega = 2 * np.pi / period

        def rates(t: float, y: np.ndarray, omega: float = omega) -> list[float]:
            ground = np.interp(t, times, record, right=0.0)
            return [y[1], -ground - 2 * zeta * omega * y[1] - omega**2 * y[0]]

        end = float(times[-1])
        moved = solve_ivp(rates, (0.0, end), [0.0, 0.0], max_step=dt / 2, rtol=1e-8, atol=1e-12, dense_output=True)
        after = solve_ivp(
            lambda _, y, w=omega: [y[1], -2 * zeta * w * y[1] - w**2 * y[0]],
            (end, end + period),
            moved.y[:, -1],
            rtol=1e-9,
            atol=1e-13,
            dense_output=True,
        )
        fine = np.linspace(0.0, end, 40_000)
        peak = max(np.abs(moved.sol(fine)[0]).max(), np.abs(after.sol(np.linspace(end, end + period, 4000))[0]).max())
        assert value == pytest.approx(omega**2 * peak, rel=3e-5)


def test_a_very_stiff_oscillator_follows_the_ground() -> None:
    record = np.convolve(np.random.default_rng(4).standard_normal(400), np.hanning(41), "same")
    record *= np.hanning(400)
    found = pseudo_acceleration(record, 0.01, np.array([0.002]))
    assert found[0] == pytest.approx(np.abs(record).max(), rel=2e-3)


def test_cutting_a_straight_line_into_more_samples_changes_nothing() -> None:
    record = np.random.default_rng(5).standard_normal(300)
    fine = np.interp(np.arange(299 * 8 + 1) / 8, np.arange(300), record)
    periods = logarithmic_periods(0.1, 3.0)
    assert pseudo_acceleration(record, 0.02, periods) == pytest.approx(
        pseudo_acceleration(fine, 0.0025, periods), rel=3e-5
    )


def test_periods_lie_evenly_over_the_logarithm() -> None:
    periods = logarithmic_periods(0.1, 1.6, per_octave=3)
    assert periods.size == 13
    assert periods[[0, 3, -1]] == pytest.approx([0.1, 0.2, 1.6])


@pytest.mark.parametrize(
    ("record", "dt", "period", "damping"),
    [
        (np.zeros(1), 0.01, 1.0, 0.05),
        (np.array([0.0, np.nan]), 0.01, 1.0, 0.05),
        (np.zeros(9), 0.0, 1.0, 0.05),
        (np.zeros(9), 0.01, 0.0, 0.05),
        (np.zeros(9), 0.01, 1.0, 1.0),
    ],
)
def test_what_makes_no_spectrum_is_refused(record: np.ndarray, dt: float, period: float, damping: float) -> None:
    with pytest.raises(InvalidInput):
        pseudo_acceleration(record, dt, np.array([period]), damping)
