"""Long-term motions on the table, against the integrator of fixed ground and the orbit's own stability."""

from dataclasses import replace
from math import tau

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

from sim.attractor import KEPT, attractor, largest_within, period_of
from sim.excitation import SineProgram, Sweep
from sim.rocking import simulate
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import Orbit, rocking_orbit
from sim.table_orbit import TableOrbit, table_orbit

AMPLITUDE = 1.01 * Specimen().uplift_acceleration
HEAVY = Shaker(moving_mass=1e8, friction=0.0, voltage_limit=1e12, current_limit=1e12)


def orbits(beta: float, omega: float, shaker: Shaker) -> tuple[Orbit, TableOrbit]:
    fixed = rocking_orbit(Specimen().coupled(beta), omega, AMPLITUDE)
    return fixed, table_orbit(fixed, shaker)


def greatest_on_fixed_ground(fixed: Orbit, cycles: int) -> float:
    """Largest drift in the last `KEPT` of the cycles after a disturbance of the orbit, by the located integrator."""
    length = cycles * fixed.period
    sine = SineProgram([Sweep.dwell(length, fixed.amplitude, fixed.omega)], phase=fixed.phase)
    times = length - np.arange(KEPT * 100)[::-1] * (fixed.period / 100)
    start = replace(fixed.start, u1=1.1 * fixed.start.u1)
    motion = simulate(fixed.specimen, sine, state=start, sample_times=times, peaks_from=None)
    assert motion.samples is not None
    assert motion.overturned is None
    return float(np.abs(motion.samples[:, 1] - motion.samples[:, 0]).max())


@pytest.mark.parametrize(("beta", "omega", "repeats"), [(0.97, 15.0, 9), (0.97, 14.7, 0)])
def test_on_a_heavy_table_the_motion_is_that_of_fixed_ground(beta: float, omega: float, repeats: int) -> None:
    fixed, orbit = orbits(beta, omega, HEAVY)
    found = attractor(fixed.specimen, HEAVY, orbit)
    assert found.peaks[:, 1].max() == pytest.approx(greatest_on_fixed_ground(fixed, 1000), rel=0.01)
    assert found.repeats == repeats


def test_beside_a_stable_orbit_the_motion_returns_to_it() -> None:
    fixed, orbit = orbits(0.4, 16.0, Shaker())
    assert orbit.stable
    found = attractor(fixed.specimen, Shaker(), orbit, cycles=300)
    assert found.peaks[-20:, 1] == pytest.approx(orbit.drift, rel=2e-3)


def test_a_fall_ends_the_motion() -> None:
    fixed, orbit = orbits(0.97, 15.0, Shaker())
    found = attractor(fixed.specimen, Shaker(), replace(orbit, drive=4.0 * orbit.drive), cycles=300)
    assert found.fallen is not None
    assert found.fallen < 300
    assert found.peaks.shape == (0, 2)
    assert found.repeats == 0
    assert np.isnan(found.within).all()


def test_a_motion_that_falls_late_is_described_by_the_cycles_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sim.attractor.KEPT", 12)
    fixed, orbit = orbits(0.97, 15.0, Shaker())
    driven = replace(orbit, drive=2.0 * orbit.drive)
    found = attractor(fixed.specimen, Shaker(), driven, cycles=300)
    assert found.fallen is not None
    assert found.fallen > 12
    assert found.within == attractor(fixed.specimen, Shaker(), driven, cycles=found.fallen).within


@pytest.mark.parametrize(("n", "length"), [(1, 1), (7, 7), (20, 7), (21, 7), (100, 1), (838, 419)])
def test_the_largest_value_within_a_window_is_that_of_every_position(n: int, length: int) -> None:
    values = np.random.default_rng(n).standard_normal(n)
    assert np.array_equal(largest_within(values, length), sliding_window_view(values, length).max(axis=1))


@pytest.mark.parametrize("period", [2, 7, 24])
def test_the_period_is_the_least_number_of_cycles_after_which_all_peaks_return(period: int) -> None:
    phases = np.arange(96) * (tau / period)
    both = np.stack((2.0 + np.cos(phases), 3.0 + np.cos(phases + 1.0)), axis=1)
    assert period_of(both) == period
    assert period_of(both[:1] * (1.0 + 1e-12 * np.random.default_rng(2).standard_normal(both.shape))) == 1
    assert period_of(both + 0.2 * np.random.default_rng(1).standard_normal(both.shape)) == 0
