"""The linear map from cycle to cycle against Floquet multipliers of other integrators and sections."""

import numpy as np
import pytest

from sim.cycle_map import CycleMap, cycle_map
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import rocking_orbit
from sim.table_orbit import table_orbit

AMPLITUDE = 1.01 * Specimen().uplift_acceleration
GROUND = rocking_orbit(Specimen().coupled(0.97), 15.0, AMPLITUDE)


@pytest.fixture(scope="module")
def rigid() -> CycleMap:
    return cycle_map(GROUND, None, 3)


def test_on_a_rigid_table_the_multipliers_are_those_of_the_return_map(rigid: CycleMap) -> None:
    assert rigid.transition.shape == (6, 6)
    assert rigid.slowest == pytest.approx(GROUND.slowest, abs=1e-3)


def test_on_a_table_the_multipliers_are_those_of_its_orbit() -> None:
    found = cycle_map(GROUND, Shaker(), 3)
    assert found.transition.shape == (8, 8)
    assert found.slowest == pytest.approx(table_orbit(GROUND, Shaker(), 3).slowest, abs=1e-4)


def test_a_constant_control_moves_the_orbit_as_the_solver_does(rigid: CycleMap) -> None:
    """y* + (C (1 - M)^-1 (B1 + B0) + D1 + D0) c is the orbit at another amplitude, by continuation."""
    share = 1e-3
    (b1, b0), (d1, d0) = rigid.inputs, rigid.feedthrough
    state = np.linalg.solve(np.eye(6) - rigid.transition, b1 + b0)
    expected = (rigid.outputs @ state + d1 + d0)[:, 0]
    orders = np.arange(1, 4)

    def coefficients(amplitude: float) -> np.ndarray:
        phase, u1, u2, _ = rocking_orbit(GROUND.specimen, 15.0, amplitude).samples(600).T
        fourier = 2j / phase.size * np.exp(-1j * np.outer(orders, phase))
        both = np.concatenate((fourier @ u1, fourier @ (u2 - u1)))
        return np.concatenate((both.real, both.imag))

    np.testing.assert_allclose(rigid.orbit, coefficients(AMPLITUDE), atol=2e-3 * np.abs(rigid.orbit).max())
    changed = (coefficients((1 + share) * AMPLITUDE) - coefficients((1 - share) * AMPLITUDE)) / (2 * share)
    np.testing.assert_allclose(expected, changed, atol=1e-2 * np.abs(changed).max())
