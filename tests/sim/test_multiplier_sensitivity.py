"""Sensitivities of multipliers and boundaries, against orbits that are found again with other parameters."""

from collections.abc import Callable
from math import hypot, sin, tau

import numpy as np
import pytest
from scipy.optimize import brentq

from sim.excitation import SineProgram, Sweep
from sim.knowledge import SpecimenKnowledge, scaled
from sim.multiplier_sensitivity import OF_SPECIMEN, fixed_slopes, table_slopes
from sim.rocking import simulate
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import Orbit, rocking_orbit
from sim.table_orbit import table_orbit
from tests.sim.oracle import reference_motion
from tests.sim.runs import A_S

HEAVY = Shaker(moving_mass=1e6, friction=0.0, voltage_limit=1e12, current_limit=1e12)
LIGHT = Shaker(moving_mass=20.0)
UNSTABLE = rocking_orbit(Specimen(beta=0.97), 15.0, A_S)


def moved(orbit: Orbit, name: str, factor: float) -> Orbit:
    specimen = scaled(orbit.specimen, {name: factor}) if name in OF_SPECIMEN else orbit.specimen
    omega, amplitude = (factor if name == each else 1.0 for each in ("omega", "amplitude"))
    return rocking_orbit(specimen, omega * orbit.omega, amplitude * orbit.amplitude, guess=orbit)


def central(modulus: Callable[[float], float], step: float) -> float:
    """d|mu|/d ln p of the modulus as a function of the factor of p, to fourth order."""
    one, two = (modulus(1.0 + k * step) - modulus(1.0 - k * step) for k in (1, 2))
    return (8.0 * one - two) / (12.0 * step)


@pytest.mark.parametrize(("beta", "omega"), [(0.97, 15.0), (0.64, 12.41), (0.25, 18.0)])
def test_on_fixed_ground_against_orbits_solved_again(beta: float, omega: float) -> None:
    orbit = rocking_orbit(Specimen(beta=beta), omega, A_S)
    found = fixed_slopes(orbit)
    assert found.multiplier == pytest.approx(orbit.slowest, abs=1e-8)
    assert set(found.modulus) == {*OF_SPECIMEN, "amplitude", "omega"}
    for name, slope in found.modulus.items():
        expected = central(lambda factor, name=name: moved(orbit, name, factor).multiplier, 1e-3)
        assert slope == pytest.approx(expected, rel=1e-5, abs=3e-6), name


def modulus_by_dop853(orbit: Orbit, wait: float) -> float:
    """Largest modulus of the multipliers of the stroboscopic map, from the paper's equations integrated by DOP853."""
    phase = orbit.phase + orbit.omega * wait
    program = SineProgram([Sweep.dwell(2.0 * orbit.period, orbit.amplitude, orbit.omega)], phase=orbit.phase)
    motion = simulate(orbit.specimen, program, state=orbit.start, sample_times=np.array([wait]), peaks_from=None)
    assert motion.samples is not None
    place = np.array(motion.samples[0])

    def after(x: np.ndarray) -> np.ndarray:
        def base(t: float) -> float:
            return orbit.amplitude * sin(phase + orbit.omega * t)

        return reference_motion(orbit.specimen, base, [0.0, tau / orbit.omega], x, 1 if x[4] > 0.0 else -1)[0]

    assert after(place) == pytest.approx(place, abs=1e-9)
    steps = 1e-5 * np.diag(np.abs(place).max() * np.array([1.0, 1.0, orbit.omega, orbit.omega, 1.0, orbit.omega]))
    columns = [(after(place + step) - after(place - step)) / (2.0 * step.max()) for step in steps]
    return float(np.abs(np.linalg.eigvals(np.stack(columns, axis=1))).max())


def test_on_fixed_ground_against_another_integrator_and_another_section() -> None:
    found, step = fixed_slopes(UNSTABLE).modulus["k1"], 2e-3
    sides = [modulus_by_dop853(moved(UNSTABLE, "k1", 1.0 + side * step), 0.1) for side in (1.0, -1.0)]
    assert found == pytest.approx((sides[0] - sides[1]) / (2.0 * step), rel=1e-3)


def test_on_a_heavy_table_the_sensitivities_are_those_of_fixed_ground() -> None:
    found = table_slopes(table_orbit(UNSTABLE, HEAVY, 1), UNSTABLE, HEAVY)
    expected = fixed_slopes(UNSTABLE).modulus
    assert found.multiplier == pytest.approx(UNSTABLE.slowest, abs=1e-4)
    assert found.modulus["table_mass"] == pytest.approx(0.0, abs=1e-4)
    for name, slope in expected.items():
        assert found.modulus[name] == pytest.approx(slope, rel=1e-4, abs=5e-5), name


def test_on_a_light_table_against_orbits_solved_again() -> None:
    found = table_slopes(table_orbit(UNSTABLE, LIGHT, 2), UNSTABLE, LIGHT)

    def modulus(name: str, factor: float) -> float:
        mass = LIGHT.moving_mass * (factor if name == "table_mass" else 1.0)
        return abs(table_orbit(moved(UNSTABLE, name, factor), Shaker(moving_mass=mass), 2).slowest)

    for name, step in (("k_c", 5e-3), ("restitution_factor", 5e-3), ("table_mass", 0.3)):
        expected = (modulus(name, 1.0 + step) - modulus(name, 1.0 - step)) / (2.0 * step)
        # a multiplier on the table has an error of about 4e-5
        assert found.modulus[name] == pytest.approx(expected, abs=4e-5 / step), name


def boundary(orbit: Orbit) -> float:
    """Frequency near `orbit` at which its modulus is 1 [rad/s]."""

    def excess(omega: float) -> float:
        return rocking_orbit(orbit.specimen, omega, orbit.amplitude, guess=orbit).multiplier - 1.0

    return float(brentq(excess, orbit.omega - 0.05, orbit.omega + 0.05, xtol=1e-9))


def test_a_boundary_moves_as_its_sensitivities_state() -> None:
    orbit = rocking_orbit(Specimen(beta=0.64), 12.41, A_S)
    slopes = fixed_slopes(orbit).boundary
    for name in ("k1", "restitution_factor", "amplitude"):
        sides = [boundary(moved(orbit, name, 1.0 + side * 5e-4)) for side in (1.0, -1.0)]
        assert slopes[name] == pytest.approx((sides[0] - sides[1]) / 1e-3, rel=2e-3), name
    known = SpecimenKnowledge(stiffness=2e-3, damping=0.01, restitution=5e-4, spring=2e-3)
    uncertainty, parts = known.propagated(orbit.specimen, slopes)
    shifts = {
        (boundary(more_or_less(orbit, one)) - boundary(more_or_less(orbit, other))) / 2.0
        for one, other in known.deviations(orbit.specimen)
    }
    assert uncertainty == pytest.approx(hypot(*shifts), rel=5e-3)
    assert next(iter(parts)) == max(parts, key=parts.__getitem__) == "k1"


def more_or_less(orbit: Orbit, specimen: Specimen) -> Orbit:
    return rocking_orbit(specimen, orbit.omega, orbit.amplitude, guess=orbit)
