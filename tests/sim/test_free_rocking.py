"""The closed form of free rocking, against the integrator, quadrature, and Housner's formulas."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

from sim.excitation import SampledRecord
from sim.free_rocking import FreeRocking, critical_angle, frequency_parameter, theoretical_restitution
from sim.rocking import State, simulate
from sim.specimen import Block, Specimen

BLOCK = Block(restitution_factor=0.992)
ALPHA, P = critical_angle(BLOCK), frequency_parameter(BLOCK, 9.81)


def test_the_constants_are_those_of_a_uniform_rectangle() -> None:
    radius = float(np.hypot(0.025, 0.2))
    assert critical_angle(BLOCK) == pytest.approx(np.arctan(1 / 8), rel=1e-15)
    assert frequency_parameter(BLOCK, 9.81) == pytest.approx(np.sqrt(3 * 9.81 / (4 * radius)), rel=1e-14)
    assert theoretical_restitution(BLOCK) == pytest.approx(1 - 1.5 * np.sin(ALPHA) ** 2, rel=1e-14)


@pytest.mark.parametrize("share", [0.3, -0.6, 0.95])
def test_it_is_what_the_integrator_makes_of_the_block(share: float) -> None:
    motion = FreeRocking(ALPHA, P, BLOCK.restitution, share * ALPHA)
    times = np.linspace(0.0, 7.0, 3001)
    run = simulate(
        Specimen(beta=0.0, block=BLOCK),
        SampledRecord(np.zeros(150), 0.05),
        state=State(theta=share * ALPHA),
        sample_times=times,
        tolerance=1e-14,
    )
    assert run.samples is not None
    # near the unstable upper rest an error grows by exp(p t)
    np.testing.assert_allclose(motion.angle(times), run.samples[:, 4], atol=2e-12)


@settings(max_examples=12, deadline=None)
@given(share=st.floats(0.02, 0.98), alpha=st.floats(0.05, 0.4))
def test_a_quarter_is_the_integral_of_the_velocity_that_energy_leaves(share: float, alpha: float) -> None:
    """theta' = p sqrt(2 (cos(alpha - theta_0) - cos(alpha - theta))); theta = theta_0 (1 - x^2) leaves no pole."""
    tilt = share * alpha

    def slowness(x: float) -> float:
        fallen = 2.0 * np.sin(alpha - tilt + 0.5 * tilt * x * x) * np.sin(0.5 * tilt * x * x)
        if x == 0.0:
            return 2.0 * np.sqrt(tilt / (2.0 * np.sin(alpha - tilt)))
        return 2.0 * tilt * x / np.sqrt(2.0 * fallen)

    quarter, _ = quad(slowness, 0.0, 1.0, epsabs=0, epsrel=1e-12)
    assert FreeRocking(alpha, 1.0, 0.9, tilt).quarters[0] == pytest.approx(quarter, rel=1e-10)


def test_amplitudes_follow_the_energy_that_impacts_leave_and_times_add_up() -> None:
    motion = FreeRocking(ALPHA, P, 0.95, -0.05, start=2.0)
    for n in (1, 5, 20):
        left = 0.95 ** (2 * n) * (np.cos(ALPHA - 0.05) - np.cos(ALPHA))
        known = brentq(lambda theta, left=left: np.cos(ALPHA - theta) - np.cos(ALPHA) - left, 0.0, 0.05, xtol=1e-16)
        assert motion.amplitudes[n] == pytest.approx(known, rel=1e-10)
    np.testing.assert_allclose(np.diff(motion.turns), motion.quarters[:-1] + motion.quarters[1:], rtol=1e-9)
    angle = motion.angle(motion.turns[:10])
    np.testing.assert_allclose(angle, -motion.amplitudes[:10] * (-1.0) ** np.arange(10), rtol=1e-9)
    np.testing.assert_allclose(motion.angle(motion.impacts[:10]), 0.0, atol=1e-12)
    assert motion.angle(np.array([0.0, 2.0])) == pytest.approx(-0.05, rel=1e-12)


def test_small_tilts_rock_to_rest_in_the_time_of_the_linear_formula() -> None:
    """T = (1/p) [atanh(b) + 2 sum atanh(r^n b)], b^2 = 1 - (1 - theta_0 / alpha)^2, of the slender block."""
    alpha, p, r, share = 1e-4, 6.0, 0.9, 0.4
    b = np.sqrt(1 - (1 - share) ** 2)
    motion = FreeRocking(alpha, p, r, share * alpha)
    number = np.arange(1, motion.energies.size)
    known = (np.arctanh(b) + 2.0 * np.arctanh(r**number * b).sum()) / p
    assert motion.rest_time == pytest.approx(known, rel=1e-6)
    # what is left out, the rest of the sum, is less than a thousandth of it
    rest = 2.0 * r**motion.energies.size * b / (p * (1 - r))
    assert rest < 1e-3 * known


def test_a_trend_changes_r_with_the_speed_of_the_impact() -> None:
    motion = FreeRocking(ALPHA, P, 0.95, 0.06, trend=0.02, trend_at=0.5)
    speed = np.sqrt(motion.energies)
    np.testing.assert_allclose(speed[1:6] / speed[:5], 0.95 + 0.02 * (speed[:5] - 0.5), rtol=1e-12)
