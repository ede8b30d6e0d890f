"""What is watched while the laser of storey 2 looks at a block: everything but a drift that it does not show."""

from collections.abc import Callable

import numpy as np
import pytest

from bench.engine.interface import Ending
from bench.engine.steps import Arm, Fallen, OperatorAction, Outcome, Play, Played, RampOut, Step
from bench.guard.limits import Limits
from bench.testing.loopback import LoopbackBench, LoopbackRig
from drivers.rig import OperatorTask
from sim.specimen import Specimen

ALONE = Specimen().coupled(0.0)
BLOCK = OperatorAction(OperatorTask.WATCH_BLOCK, ALONE, "turn laser 2 to the block", 0.3)
STOREYS = OperatorAction(OperatorTask.WATCH_STOREYS, ALONE, "turn laser 2 to storey 2")
RECORDING: tuple[Step, ...] = (Arm(0.5), Play(np.zeros(3000)), RampOut())
LIMITS = Limits(drift=0.03)


def _run(laser_2: Callable[[np.ndarray], np.ndarray], *steps: Step) -> tuple[Ending, list[Outcome]]:
    rig = LoopbackRig()
    rig.response["laser_2"] = laser_2
    bench = LoopbackBench(rig, limits=LIMITS)
    return bench.run_steps(*steps), bench.outcomes


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
