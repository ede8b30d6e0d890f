"""Orbits on a table that moves with the block, against fixed ground and against long runs of the simulated bench."""

from math import tau

import numpy as np
import pytest
from numpy.typing import NDArray

from sim.arrangement import plant_of
from sim.kernel import table
from sim.kernel.plant import ROCK_A, ROCK_B
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import Orbit, rocking_orbit
from sim.table_orbit import SUBSTEPS, TICKS, NoOrbit, TableOrbit, TablePeriod, corner, table_orbit

AMPLITUDE = 1.01 * Specimen().uplift_acceleration
WINDOW = 100
UNLIMITED = {"voltage_limit": 1e12, "current_limit": 1e12}


def fixed(beta: float, omega: float) -> Orbit:
    return rocking_orbit(Specimen().coupled(beta), omega, AMPLITUDE)


@pytest.mark.parametrize(("beta", "omega"), [(0.64, 12.5), (0.97, 15.0), (0.4, 16.0)])
def test_on_a_heavy_table_the_multipliers_are_those_of_fixed_ground(beta: float, omega: float) -> None:
    """Another integrator, other variables and another section come to the same pair of multipliers."""
    ground = fixed(beta, omega)
    found = table_orbit(ground, Shaker(moving_mass=1e8, friction=0.0, **UNLIMITED))
    expected = ground.multipliers[int(np.argmax(np.abs(ground.multipliers)))]
    # the heavy table itself comes to rest too slowly to count
    assert float(np.abs(found.multipliers - expected).min()) < 1e-4
    assert found.drift == pytest.approx(ground.peaks.drift, rel=1e-3)


def change_per_cycle(orbit: TableOrbit, specimen: Specimen, shaker: Shaker) -> float:
    """Growth or decay of a small disturbance, from runs of the simulator with finer steps over hundreds of cycles."""
    phase = (np.arange(TICKS) + 0.5) * (tau / TICKS)
    orders = np.arange(1, orbit.drive.size + 1)
    period = np.ascontiguousarray((np.exp(1j * np.outer(phase, orders)) @ orbit.drive).real)
    plant, tick = plant_of(specimen, shaker, np.pi / 2), tau / orbit.omega / TICKS
    ends = list[NDArray[np.float64]]()
    for disturbance in (-1e-4, 1e-4):
        y = orbit.start.copy()
        y[6] *= 1.0 + disturbance
        mode, carried, rows = ROCK_A if y[6] > 0.0 else ROCK_B, np.zeros(2), np.empty((TICKS, 9))
        found = list[NDArray[np.float64]]()
        for _ in range(3 * WINDOW):
            mode = table.stream(plant, tick, 2 * SUBSTEPS, period, np.zeros(TICKS), mode, y, carried, rows)
            found.append(y[2:6].copy())
        ends.append(np.array(found))
    # the faster modes have gone in the first window; in a window a spiral turns many times
    size = np.linalg.norm((ends[1] - ends[0]).reshape(3, WINDOW, 4) / np.ptp(ends[0], axis=0), axis=(1, 2))
    return float((size[2] / size[1]) ** (1.0 / WINDOW))


@pytest.mark.parametrize(("mass", "beta", "omega"), [(50.0, 0.64, 12.5), (20.0, 0.64, 13.0)])
def test_a_disturbance_grows_or_decays_by_the_multiplier(mass: float, beta: float, omega: float) -> None:
    ground, shaker = fixed(beta, omega), Shaker(moving_mass=mass)
    orbit = table_orbit(ground, shaker)
    assert abs(orbit.slowest) == pytest.approx(change_per_cycle(orbit, ground.specimen, shaker), abs=3e-4)


@pytest.mark.parametrize(("mass", "stable"), [(20.0, False), (50.0, True), (200.0, True)])
def test_an_orbit_that_is_unstable_on_fixed_ground_may_be_stable_on_a_table(mass: float, stable: bool) -> None:
    ground = fixed(0.64, 12.5)
    assert not ground.stable
    assert table_orbit(ground, Shaker(moving_mass=mass), harmonics=10).stable is stable


def test_a_lag_of_the_amplifier_does_not_change_the_multipliers() -> None:
    """Between two commands the plant is the same; the commands of a lagging amplifier are only played later."""
    ground = fixed(0.64, 12.5)
    prompt, lagging = (table_orbit(ground, Shaker(amplifier_lag=lag), 10) for lag in (0.0, 0.02))
    assert abs(lagging.slowest - prompt.slowest) < 2e-4
    assert lagging.drift == pytest.approx(prompt.drift, rel=1e-4)


@pytest.mark.parametrize("lag", [0.0, 0.005, 0.02])
def test_the_orbit_is_a_period_of_the_plant_whose_amplifier_lags(lag: float) -> None:
    ground, shaker = fixed(0.4, 16.0), Shaker(amplifier_lag=lag)
    found = table_orbit(ground, shaker)
    period = TablePeriod(ground.specimen, shaker, ground.omega)
    y, commands = found.start.copy(), period.commands(found.drive)
    mode, carried = corner(y), np.array([period.output(commands), 0.0])
    for _ in range(2):
        mode, _rows = period.advance(mode, y, carried, commands)
        np.testing.assert_allclose(y / period.scales(found.start), found.start / period.scales(found.start), atol=1e-7)


def test_the_tables_motion_is_a_sine_and_the_gain_that_of_fixed_ground() -> None:
    ground = fixed(0.4, 16.0)
    found = table_orbit(ground, Shaker())
    assert found.drift == pytest.approx(ground.peaks.drift, rel=1e-3)
    assert np.abs(found.drive[1:]).max() > 1e-3 * abs(found.drive[0]), "the block disturbs the table"


def test_a_shaker_that_cannot_follow_has_no_orbit() -> None:
    with pytest.raises(NoOrbit, match=r"omega = 16 rad/s"):
        table_orbit(fixed(0.4, 16.0), Shaker(voltage_limit=0.5))
