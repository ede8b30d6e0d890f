"""What is watched while the laser of storey 2 looks at a block: everything but a drift that it does not show."""

from collections.abc import Callable

import numpy as np
import pytest

from bench.analysis.signals import SignalMap
from bench.engine.ending import Ending
from bench.engine.engine import Engine
from bench.engine.operator import Unattended
from bench.engine.requests import Requests
from bench.engine.steps import Arm, Fallen, Handle, Outcome, Plan, Play, Played, RampOut, Step
from bench.engine.stream import Stream
from bench.guard.guard import Guard
from bench.guard.limits import Limits, Ramps
from drivers.rig import Handwork
from sim.specimen import Specimen
from tests.loopback import LoopbackRig

ALONE = Specimen().coupled(0.0)
BLOCK = Handle(Handwork.WATCH_BLOCK, ALONE, "turn laser 2 to the block", 0.3)
STOREYS = Handle(Handwork.WATCH_STOREYS, ALONE, "turn laser 2 to storey 2")
RECORDING: tuple[Step, ...] = (Arm(0.5), Play(np.zeros(3000)), RampOut())
LIMITS = Limits(drift=0.03)


def _run(laser_2: Callable[[np.ndarray], np.ndarray], *steps: Step) -> tuple[Ending, list[Outcome]]:
    rig, outcomes, requests = LoopbackRig(), list[Outcome](), Requests()
    rig.response["laser_2"] = laser_2

    def plan() -> Plan:
        for step in steps:
            outcomes.append((yield step))

    guard = Guard(rig, LIMITS, Ramps(stop=1.0, abort=0.2), signals=SignalMap(rig.channels, "table"))
    stream = Stream(rig.clock, [])
    engine = Engine(rig, guard, stream, requests, Unattended(), block=100)
    return engine.run(plan()), outcomes


def _moves(by: float) -> Callable[[np.ndarray], np.ndarray]:
    """At zero for a second after arming, then at `by` [m] for good."""
    seen = 0

    def show(volts: np.ndarray) -> np.ndarray:
        nonlocal seen
        seen += volts.size
        return np.full(volts.size, by if seen > 1000 else 0.0)

    return show


def test_a_block_that_rocks_is_no_drift_and_has_not_fallen() -> None:
    ending, outcomes = _run(_moves(0.05), BLOCK, *RECORDING)
    assert ending.status == "completed"
    assert not any(isinstance(outcome, Fallen) for outcome in outcomes)
    (played,) = (outcome for outcome in outcomes if isinstance(outcome, Played))
    assert not played.drive.any()


@pytest.mark.parametrize("steps", [RECORDING, (BLOCK, STOREYS, *RECORDING)])
def test_the_drift_is_watched_as_long_as_the_laser_sees_the_storey(steps: tuple[Step, ...]) -> None:
    ending, _ = _run(_moves(0.05), *steps)
    assert ending.status == "aborted"
    assert ending.reason.startswith("drift")


@pytest.mark.parametrize(("where", "says"), [(32.6, "share of the laser's range"), (np.nan, "without a valid sample")])
def test_a_laser_that_loses_the_block_ends_the_run(where: float, says: str) -> None:
    ending, _ = _run(_moves(where), BLOCK, *RECORDING)
    assert ending.status == "aborted"
    assert says in ending.reason
