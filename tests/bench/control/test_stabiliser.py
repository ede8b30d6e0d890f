"""The stabiliser holds unstable orbits of the simulated table, whatever the specimen and the table within reason."""

import numpy as np
import pytest

from bench.control.stabiliser import CAPTURED, HoldMonitor, Stabiliser, StabiliserDesign
from sim.cycle_map import CycleMap
from sim.knowledge import SpecimenKnowledge
from sim.specimen import Specimen
from tests.bench.control.rocking_table import RockingTable, assumed_map

AUTHORITY = 0.1
NOISE = 2e-6
"""Noise of a coefficient [m]: 20 um per sample over 400 samples, and as much for the wander of a laser's clock."""


@pytest.fixture(scope="module")
def windows() -> dict[tuple[float, float], CycleMap]:
    """Maps at points where the orbit is unstable on fixed ground."""
    return {(omega, beta): assumed_map(beta, omega) for omega, beta in ((15.0, 0.97), (12.5, 0.64), (14.0, 0.97))}


def drawn(beta: float, seed: int) -> Specimen:
    knowledge = SpecimenKnowledge(stiffness=0.04, damping=0.3, restitution=0.01, spring=0.04)
    return knowledge.draws(Specimen().coupled(beta), 1, np.random.default_rng(seed))[0]


@pytest.mark.parametrize("point", [(15.0, 0.97), (12.5, 0.64), (14.0, 0.97)])
@pytest.mark.parametrize("seed", [6, pytest.param(8, marks=pytest.mark.soak)])
def test_a_specimen_off_by_four_per_cent_is_captured_from_its_free_motion_and_held(
    windows: dict[tuple[float, float], CycleMap], point: tuple[float, float], seed: int
) -> None:
    found = windows[point]
    plant = RockingTable(drawn(point[1], seed), point[0], found.phase)
    for _ in range(120):
        plant.cycle(0.0, 0.0)
    held = plant.hold(Stabiliser(StabiliserDesign.of(found), AUTHORITY), 220, NOISE)
    assert not held.fell
    assert held.deviations[-40:].max() < 0.005
    assert np.sqrt(np.mean(held.controls[-40:] ** 2)) < 2e-4


@pytest.mark.parametrize(
    "answer", [1.25, np.exp(-0.4j), *(pytest.param(other, marks=pytest.mark.soak) for other in (0.8, np.exp(0.4j)))]
)
def test_a_table_that_answers_otherwise_than_calibrated_is_held(
    windows: dict[tuple[float, float], CycleMap], answer: complex
) -> None:
    found = windows[15.0, 0.97]
    plant = RockingTable(Specimen().coupled(0.97), 15.0, found.phase, answer=answer)
    held = plant.hold(Stabiliser(StabiliserDesign.of(found), AUTHORITY), 200, NOISE)
    assert held.deviations[-30:].max() < 0.01


def test_a_motion_that_repeats_receives_no_control(windows: dict[tuple[float, float], CycleMap]) -> None:
    """Not even one that is far from the predicted orbit."""
    found = windows[15.0, 0.97]
    stabiliser = Stabiliser(StabiliserDesign.of(found), AUTHORITY)
    controls = [abs(stabiliser.next(1.3 * found.orbit)) for _ in range(40)]
    assert max(controls) < 1e-12
    assert stabiliser.deviation < 1e-12


def test_control_never_exceeds_the_authority_and_a_lost_cycle_is_bridged(
    windows: dict[tuple[float, float], CycleMap],
) -> None:
    found = windows[15.0, 0.97]
    plant = RockingTable(Specimen().coupled(0.97), 15.0, found.phase)
    stabiliser = Stabiliser(StabiliserDesign.of(found), AUTHORITY)
    for _ in range(120):
        plant.cycle(0.0, 0.0)
    held = plant.hold(stabiliser, 160)
    assert held.controls.max() == pytest.approx(AUTHORITY, rel=1e-9)
    assert held.deviations[-1] < 0.002
    assert stabiliser.next(None) == pytest.approx(0.0, abs=1e-3)


def _monitor() -> HoldMonitor:
    return HoldMonitor(15.0, AUTHORITY, patience=200, largest=0.02, answer=0.9 + 0.1j)


def _quiet(monitor: HoldMonitor, cycles: int, control: float = 1e-4) -> str | None:
    reason = None
    for _ in range(cycles):
        reason = reason or monitor.push(control, 0.01, 1.0, 0.9 + 0.1j)
    return reason


def test_a_motion_is_captured_after_successive_cycles_with_little_control() -> None:
    monitor = _monitor()
    assert _quiet(monitor, 30, control=0.05) is None
    assert _quiet(monitor, CAPTURED - 1) is None
    assert monitor.captured_after is None
    assert _quiet(monitor, 1) is None
    assert monitor.captured_after == 30


@pytest.mark.parametrize(
    ("turn", "said"),
    [
        (0.7, "gain by a factor of 0.70, phase by +0 degrees"),
        (1.3, "gain by a factor of 1.30, phase by +0 degrees"),
        (np.exp(0.75j), "gain by a factor of 1.00, phase by +43 degrees"),
        (np.exp(-0.75j), "gain by a factor of 1.00, phase by -43 degrees, like a delay of 50 ms"),
    ],
)
def test_a_table_that_no_longer_follows_ends_the_hold(turn: complex, said: str) -> None:
    monitor = _monitor()
    assert _quiet(monitor, 30) is None
    assert monitor.push(0.0, 0.01, 1.0, (0.4 + 0.6 * turn) * (0.9 + 0.1j)) is None
    reason = monitor.push(0.0, 0.01, 1.0, turn * (0.9 + 0.1j))
    assert reason == f"the table's response to the drive changed: {said}"


def test_a_single_cycle_with_another_response_is_borne() -> None:
    monitor = _monitor()
    for _ in range(5):
        assert monitor.push(0.0, 0.01, 1.0, 0.5 * (0.9 + 0.1j)) is None
        assert _quiet(monitor, 3) is None


def test_a_control_that_is_limited_captures_nothing() -> None:
    monitor = HoldMonitor(15.0, 0.01, patience=200, largest=0.02, answer=0.9 + 0.1j)
    assert _quiet(monitor, 199, control=0.01) is None
    assert monitor.captured_after is None
    assert "not captured within 200 cycles" in (_quiet(monitor, 1, control=0.01) or "")


def test_other_reasons_to_release() -> None:
    assert "21 mm, but only 20 mm is allowed" in (_monitor().push(0.0, 0.021, 1.0, 0.9 + 0.1j) or "")
    assert "not captured within 200 cycles" in (_quiet(_monitor(), 200, control=0.08) or "")
    captured = _monitor()
    assert _quiet(captured, 30) is None
    assert "grew again" in (_quiet(captured, 6, control=0.08) or "")
    blind = _monitor()
    assert blind.missed() is None
    assert blind.missed() is None
    assert "sensor" in (blind.missed() or "")
