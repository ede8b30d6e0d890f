"""The emulated enable chain: the amplifier listens while everything is closed, and never else."""

import threading
from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from drivers.emulation import safety_chain
from drivers.emulation.safety_chain import INPUTS, SafetyChain
from drivers.errors import RigError

HALF_STROKE = 0.075
TIMEOUT = 1.5


class Clock:
    """Time as the test says."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now


class Bench:
    """What the chain knows of a bench; whenever it is enabled it moves on first, as the real one does."""

    half_stroke = HALF_STROKE

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.enabled = False
        self.place = 0.0
        self.told: Callable[[NDArray[np.float64]], None] = lambda _: None

    def watch(self, told: Callable[[NDArray[np.float64]], None]) -> None:
        self.told = told

    def move(self) -> None:
        self.told(np.array([0.0, self.place]))

    def enable(self, closed: bool) -> None:
        self.move()
        self.enabled = closed


class Chain:
    def __init__(self) -> None:
        self.bench, self.clock = Bench(), Clock()
        self.safety = SafetyChain(cast(Any, self.bench), TIMEOUT)

    def passes(self, seconds: float) -> None:
        self.clock.now += seconds
        self.bench.move()

    def beat(self) -> None:
        self.safety.heartbeat_line(False)
        self.safety.heartbeat_line(True)

    def enable(self) -> None:
        self.safety.enable_line(True)
        self.beat()


@pytest.fixture
def chain(monkeypatch: pytest.MonkeyPatch) -> Chain:
    chain = Chain()
    monkeypatch.setattr(safety_chain, "time", chain.clock)
    return chain


def levels(chain: Chain) -> dict[str, bool]:
    return {name: level() for name, level in chain.safety.inputs.items()}


def test_the_amplifier_is_ready_a_moment_after_it_is_enabled(chain: Chain) -> None:
    assert levels(chain) == dict.fromkeys(INPUTS, True) | {"amplifier_ready": False}
    chain.enable()
    assert chain.bench.enabled
    assert not levels(chain)["amplifier_ready"]
    chain.passes(0.06)
    assert all(levels(chain).values())
    chain.safety.enable_line(False)
    assert not chain.bench.enabled
    assert not levels(chain)["amplifier_ready"]


@pytest.mark.parametrize(
    ("fault", "arguments", "shown"),
    [
        ("press_emergency_stop", (), "emergency_stop"),
        ("trip_over_travel", (), "over_travel"),
        ("trip_over_travel", (2,), "over_travel_2"),
        ("trip_amplifier", (), "amplifier_ready"),
    ],
)
def test_each_fault_opens_the_chain_shows_itself_and_can_be_undone(
    chain: Chain, fault: str, arguments: tuple[int, ...], shown: str
) -> None:
    chain.enable()
    chain.passes(0.06)
    getattr(chain.safety, fault)(*arguments)
    assert not chain.bench.enabled
    assert {name for name, level in levels(chain).items() if not level} == {shown, "amplifier_ready"}
    undone = {"press_emergency_stop": "release_emergency_stop"}.get(fault, fault.replace("trip", "reset"))
    getattr(chain.safety, undone)()
    assert chain.bench.enabled


@pytest.mark.parametrize(("side", "shown"), [(1.0, "over_travel"), (-1.0, "over_travel_2")])
def test_the_table_opens_the_switch_of_its_end_and_holds_it_open(chain: Chain, side: float, shown: str) -> None:
    chain.enable()
    chain.bench.place = side * 0.94 * HALF_STROKE
    chain.passes(0.1)
    assert chain.bench.enabled
    chain.bench.place = side * 0.96 * HALF_STROKE
    chain.passes(0.1)
    assert not chain.bench.enabled
    chain.bench.place = 0.0
    chain.passes(0.9)
    assert not levels(chain)[shown]
    assert not chain.bench.enabled
    chain.passes(0.2)
    assert levels(chain)[shown]


def test_a_table_that_is_at_its_end_is_not_enabled(chain: Chain) -> None:
    chain.bench.place = HALF_STROKE
    chain.enable()
    assert not chain.bench.enabled


@pytest.mark.parametrize("level", [True, False])
def test_a_heartbeat_that_stands_still_opens_the_chain(chain: Chain, level: bool) -> None:
    chain.enable()
    for _ in range(5):
        chain.passes(0.9 * TIMEOUT)
        chain.beat()
        assert chain.bench.enabled
    chain.safety.heartbeat_line(level)
    chain.passes(0.9 * TIMEOUT)
    assert chain.bench.enabled
    chain.safety.heartbeat_line(level)
    chain.passes(0.2 * TIMEOUT)
    assert not chain.bench.enabled


@pytest.mark.parametrize("name", INPUTS)
def test_a_broken_wire_reads_low_and_opens_nothing(chain: Chain, name: str) -> None:
    chain.enable()
    chain.passes(0.06)
    chain.safety.break_wire(name)
    assert levels(chain) == dict.fromkeys(INPUTS, True) | {name: False}
    assert chain.bench.enabled
    chain.safety.mend_wire(name)
    assert all(levels(chain).values())


def test_a_broken_heartbeat_wire_opens_the_relay(chain: Chain) -> None:
    chain.enable()
    chain.safety.break_wire("heartbeat")
    chain.passes(0.9 * TIMEOUT)
    chain.beat()
    chain.passes(0.2 * TIMEOUT)
    assert not chain.safety.contacts["heartbeat relay"]
    assert not chain.bench.enabled


def test_what_does_not_exist_is_refused(chain: Chain) -> None:
    with pytest.raises(RigError, match="over-travel at end 3"):
        chain.safety.trip_over_travel(3)
    with pytest.raises(RigError, match="wire 'fire' is refused: the wires are emergency_stop"):
        chain.safety.break_wire("fire")


ACTS: tuple[Callable[[Chain], object], ...] = (
    lambda chain: chain.safety.enable_line(True),
    lambda chain: chain.safety.enable_line(False),
    lambda chain: chain.beat(),
    lambda chain: chain.passes(0.4),
    lambda chain: chain.passes(2.0),
    lambda chain: chain.safety.press_emergency_stop(),
    lambda chain: chain.safety.release_emergency_stop(),
    lambda chain: chain.safety.trip_over_travel(2),
    lambda chain: chain.safety.reset_over_travel(),
    lambda chain: chain.safety.trip_amplifier(),
    lambda chain: chain.safety.reset_amplifier(),
    lambda chain: setattr(chain.bench, "place", HALF_STROKE),
    lambda chain: setattr(chain.bench, "place", 0.0),
)


@settings(max_examples=200, deadline=None)
@given(acts=st.lists(st.sampled_from(ACTS), max_size=25))
def test_the_drive_moves_the_table_only_while_every_contact_is_closed(acts: list[Callable[[Chain], object]]) -> None:
    with pytest.MonkeyPatch.context() as patch:
        chain = Chain()
        patch.setattr(safety_chain, "time", chain.clock)
        for act in acts:
            act(chain)
            chain.passes(0.02)
            shown = chain.safety.contacts
            ready = shown.pop("amplifier ready")
            if chain.bench.enabled:
                assert all(shown.values())
            assert not ready or chain.bench.enabled
