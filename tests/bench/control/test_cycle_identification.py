"""Unstable orbits of the simulated table are held with a map identified from their cycles, if it is the right one."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.control import cycle_identification
from bench.control.cycle_identification import EXCITATION, EXCITED, SECTION, IdentifyingStabiliser, identified_map
from sim.cycle_map import CycleMap
from tests.bench.control.rocking_table import Held, RockingTable
from tests.bench.control.test_stabiliser import AUTHORITY, NOISE, drawn

SEEDS = {(15.0, 0.97): 6, (12.5, 0.64): 2}
"""Specimens whose orbits are unstable on the table."""


def plant(point: tuple[float, float]) -> RockingTable:
    return RockingTable(drawn(point[1], SEEDS[point]), point[0], SECTION)


def held(table: RockingTable, omega: float, cycles: int = 140) -> tuple[Held, IdentifyingStabiliser]:
    """Cycles from a motion that has diverged from the orbit for twelve cycles."""
    for _ in range(12):
        table.cycle(0.0, 0.0)
    stabiliser = IdentifyingStabiliser(omega, AUTHORITY)
    return table.hold(stabiliser, cycles, NOISE), stabiliser


@pytest.mark.parametrize("point", list(SEEDS))
def test_an_unstable_orbit_is_held_without_a_model(point: tuple[float, float]) -> None:
    table = plant(point)
    assert abs(table.orbit.slowest) > 1.01
    found, stabiliser = held(table, point[0])
    assert not found.fell
    assert found.deviations[-30:].max() < 0.01
    # a control is in effect two cycles after the measured one
    assert found.controls[2:EXCITED] == pytest.approx(np.full(EXCITED - 2, EXCITATION), abs=1e-9)
    assert found.controls.max() <= AUTHORITY * (1.0 + 1e-9)
    assert np.sqrt(np.mean(found.controls[-30:] ** 2)) < 2e-3
    # against the multipliers of the table's orbit, from finite differences of its equations
    assert stabiliser.cycle_map is not None
    slowest = stabiliser.cycle_map.slowest
    assert abs(slowest) == pytest.approx(abs(table.orbit.slowest), abs=0.03)
    assert np.angle(slowest) == pytest.approx(np.angle(table.orbit.slowest), abs=0.07)


def wrong(change: Callable[[CycleMap], CycleMap], monkeypatch: pytest.MonkeyPatch) -> None:
    """Change every identified map."""

    def changed(measured: NDArray[np.float64], controls: NDArray[np.float64], omega: float) -> CycleMap:
        return change(identified_map(measured, controls, omega))

    monkeypatch.setattr(cycle_identification, "identified_map", changed)


@pytest.mark.parametrize("factor", [0.0, -1.0])
def test_a_map_with_the_wrong_effect_of_the_control_does_not_hold(
    monkeypatch: pytest.MonkeyPatch, factor: float
) -> None:
    def changed(found: CycleMap) -> CycleMap:
        before, now = found.inputs
        return replace(found, inputs=(factor * before, factor * now))

    wrong(changed, monkeypatch)
    found, stabiliser = held(plant((15.0, 0.97)), 15.0)
    assert found.fell or found.deviations[-30:].max() > 1.0
    if factor == 0.0:
        assert stabiliser.cycle_map is None


def test_a_linear_map_is_identified_exactly_and_lost_cycles_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """A system with four states, whose fixed point is never reached; without regularisation."""
    monkeypatch.setattr(cycle_identification, "RIDGE", 1e-14)
    random = np.random.default_rng(2)
    a = np.zeros((4, 4))
    a[:2, :2] = 1.03 * np.array([[np.cos(2.9), -np.sin(2.9)], [np.sin(2.9), np.cos(2.9)]])
    a[2:, 2:] = 0.9 * np.array([[np.cos(2.2), -np.sin(2.2)], [np.sin(2.2), np.cos(2.2)]])
    b1, b0, c, d0 = (random.standard_normal(shape) for shape in ((4, 2), (4, 2), (12, 4), (12, 2)))
    orbit = 50.0 * random.standard_normal(12)
    controls = np.concatenate((np.zeros((1, 2)), 0.03 * random.standard_normal((60, 2))))
    state, rows = 0.2 * random.standard_normal(4), list[NDArray[np.float64]]()
    # the feedthrough of a map with four components has to be in their plane
    d0 = c @ np.linalg.pinv(c) @ d0
    for n in range(1, len(controls)):
        rows.append(orbit + c @ state + d0 @ controls[n])
        state = a @ state + b1 @ controls[n - 1] + b0 @ controls[n]
    measured = np.array(rows)
    measured[[20, 41]] = np.nan
    found = identified_map(measured, controls[1:], 15.0)
    assert abs(found.slowest) == pytest.approx(1.03, abs=1e-6)
    assert np.angle(found.slowest) == pytest.approx(2.9, abs=1e-6)
    assert np.linalg.norm(found.orbit - orbit) < 1e-6 * np.linalg.norm(orbit)
    # the effect of a control on the coefficients of its cycle and of the next one does not depend on the state's basis
    (before, now), (_, direct) = found.inputs, found.feedthrough
    assert direct == pytest.approx(d0, abs=1e-6 * np.abs(d0).max())
    assert found.outputs @ now == pytest.approx(c @ b0, abs=1e-6 * np.abs(c @ b0).max())
    assert found.outputs @ before == pytest.approx(c @ b1, abs=1e-6 * np.abs(c @ b1).max())


def test_too_few_cycles_determine_no_map() -> None:
    with pytest.raises(np.linalg.LinAlgError, match="too few cycles"):
        identified_map(np.ones((10, 12)), np.ones((10, 2)), 15.0)
