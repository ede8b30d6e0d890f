"""Fixed points of the return map: rows of points that are not found, and multipliers of very unstable orbits."""

from math import cos, sin, tau
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sim import return_map
from sim.specimen import Specimen
from sim.steady import NoOrbit, Orbit, rocking_branch, rocking_orbit

ORBIT = rocking_orbit(Specimen().coupled(0.4), 16.0, 1.01 * Specimen().uplift_acceleration)


def test_a_point_without_a_finite_jacobian_is_not_found_and_its_row_is_nan(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = return_map.jacobians

    def one_lost(q: np.ndarray, x: np.ndarray, accuracy: return_map.Accuracy) -> np.ndarray:
        found = exact(q, x, accuracy)
        found[0, 3, 3] = np.nan
        return found

    of_one = return_map.parameters(ORBIT.specimen, ORBIT.omega, ORBIT.amplitude)
    q, x = np.repeat(of_one, 2, axis=0), np.repeat(ORBIT.section[None], 2, axis=0)
    known = exact(q, x, 4)
    monkeypatch.setattr(return_map, "jacobians", one_lost)
    solutions = return_map.newton(q, x, known)
    assert solutions.found.tolist() == [False, True]
    for each in (solutions.section, solutions.jacobian, solutions.peaks):
        assert np.isnan(each[0]).all()
        assert np.isfinite(each[1]).all()


def multiplier_of_the_block(orbit: Orbit) -> float:
    """Dominant multiplier of a block without a spring, from the variational equations of DOP853.

    At an impact, (r, 0) and ((theta''+ - r theta''-) / omega-, r) are the rows of the saltation matrix.
    """
    k, g, r = orbit.specimen.block, orbit.specimen.g, orbit.specimen.block.restitution

    def rates(t: float, y: np.ndarray, sg: float) -> np.ndarray:
        s, c, a = sin(y[0]), cos(y[0]), orbit.amplitude * sin(orbit.phase + orbit.omega * t)
        torque = g * (k.h_b * s - sg * k.b * c) + a * (k.h_b * c + sg * k.b * s)
        slope = g * (k.h_b * c + sg * k.b * s) - a * (k.h_b * s - sg * k.b * c)
        return np.concatenate(([y[1], k.mass / k.inertia * torque], y[4:6], k.mass / k.inertia * slope * y[2:4]))

    def ground(t: float, y: np.ndarray, sg: float) -> float:
        return sg * y[0] if t > begin + 1e-3 else 1.0

    event: Any = ground
    event.terminal = True
    begin, y, sg = 0.0, np.array([0.0, orbit.start.omega, 1.0, 0.0, 0.0, 1.0]), 1.0
    for _ in range(2):
        run: Any = solve_ivp(
            rates, (begin, 1.5 * tau / orbit.omega), y, "DOP853", events=event, args=(sg,), rtol=1e-13, atol=1e-15
        )
        begin, y = float(run.t[-1]), run.y[:, -1].copy()
        before, y[0], sg = rates(begin, y, sg)[1], 0.0, -sg
        saltation = np.array([[r, 0.0], [(rates(begin, y, sg)[1] - r * before) / y[1], r]])
        y[1], y[2:] = r * y[1], (saltation @ y[2:].reshape(2, 2)).ravel()
    assert begin == pytest.approx(tau / orbit.omega, abs=1e-5)
    return float(np.abs(np.linalg.eigvals(y[2:].reshape(2, 2))).max())


BLOCK, STRONG = Specimen().coupled(0.0), 2.0 * 9.81 / 8.0
"""A block without a spring, and a sine whose amplitude is twice that which lifts it."""


def test_multipliers_up_to_tens_of_thousands_are_those_of_the_variational_equations() -> None:
    """The slower the sine, the more closely the block approaches its overturning twice in a period."""
    near = [20.0, 14.0, 10.0, 8.0, 7.0, 6.0, 5.5, 5.0, 4.5, 4.25]
    branch = rocking_branch(BLOCK, [*near, *np.arange(4.0, 3.34, -0.05)], STRONG)
    found = {round(orbit.omega, 2): (orbit.multiplier, multiplier_of_the_block(orbit)) for orbit in branch[7:]}
    assert found[4.0][1] > 3e3
    assert found[3.35][1] > 1e4
    for multiplier, expected in found.values():
        assert multiplier == pytest.approx(expected, rel=3e-8)


def test_an_orbit_that_is_lost_because_of_its_instability_is_refused_with_this_reason() -> None:
    near = rocking_branch(BLOCK, [20.0, 14.0, 10.0, 8.0, 7.0, 6.0, 5.0, 4.0], STRONG)[-1]
    with pytest.raises(NoOrbit, match=r"multiplies disturbances by up to 7\.\de\+03 per period"):
        rocking_orbit(BLOCK, 3.0, STRONG, near)
