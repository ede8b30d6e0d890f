"""Faults while a motion is being held: the hold is released or the run ended, and the reason stated."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.engine.interface import Ending
from bench.events import Acquired, Event, LimitExceeded, PointFinished
from drivers.rig import Counts
from drivers.simulated import SimulatedRig
from protocols.common.sine.holding import HoldCycle
from protocols.harmonic.campaign import HarmonicCampaign
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, PointStatus
from sim.specimen import Specimen
from tests.recorded import recorded

pytestmark = pytest.mark.usefixtures("shared_results")

Array = NDArray[np.float64]

PARAMETERS = HarmonicParameters(
    omega=(15.0,), beta=(0.97,), starts=1, settle_limit=12.0, ramp_time=4.0, harmonics=3, measured_cycles=12
)
BEGINS = 5
"""Cycle of the hold in which the fault begins."""


@pytest.fixture(scope="module")
def campaign() -> HarmonicCampaign:
    return HarmonicCampaign(PARAMETERS, BenchConfiguration())


class FaultyRig(SimulatedRig):
    """Simulated rig with a defect from the moment at which `broken` is set."""

    def __init__(self, gain: float, late: float, blind: bool) -> None:
        bench = BenchConfiguration().simulation.bench
        super().__init__(bench, Specimen(), seed=3)
        self._gain, self._late, self._blind = gain, round(late * self.sample_rate), blind
        self._past = np.zeros(self._late)
        self.broken = False

    def respond(self, volts: Array) -> Counts:
        queue = np.concatenate((self._past, volts))
        self._past = queue[queue.size - self._late :]
        counts = super().respond(self._gain * queue[: volts.size] if self.broken else volts)
        if self.broken and self._blind:
            counts[:, 2] = self.bench.parameters.converter.codes[1]
        return counts


@dataclass
class Run:
    """A run with a fault: its ending, points and events."""

    ending: Ending
    points: list[HarmonicPoint]
    events: list[Event]

    @property
    def last_drive(self) -> float:
        return float(next(event.drive[-1] for event in reversed(self.events) if isinstance(event, Acquired)))


Faulty = Callable[[float, float, bool], Run]


@pytest.fixture
def faulty(campaign: HarmonicCampaign, tmp_path: Path) -> Faulty:
    """Carry out the campaign; arguments: gain of the drive, its delay [s], whether a laser loses its target."""

    def run(gain: float, late: float, blind: bool) -> Run:
        rig, events, points = FaultyRig(gain, late, blind), list[Event](), list[HarmonicPoint]()

        def watch(event: Event) -> None:
            events.append(event)
            if isinstance(event, HoldCycle) and event.cycle == BEGINS:
                rig.broken = True
            if isinstance(event, PointFinished) and isinstance(event.point, HarmonicPoint):
                points.append(event.point)

        configuration = BenchConfiguration()
        path, plan = tmp_path / "run.h5", campaign.plan()
        ending = recorded(path, plan, rig, configuration, HarmonicPoint, subscribers=[watch], events=(HoldCycle,))
        return Run(ending, points, events)

    return run


@pytest.mark.parametrize(
    ("gain", "late"),
    [(0.7, 0.0), pytest.param(1.3, 0.0, marks=pytest.mark.soak), (1.0, np.radians(40.0) / 15.0)],
)
def test_a_table_that_changes_its_gain_or_phase_releases_the_hold(faulty: Faulty, gain: float, late: float) -> None:
    run = faulty(gain, late, False)
    assert run.ending.status == "completed"
    (point,) = run.points
    assert point.status is PointStatus.MODULATED
    assert "released after" in point.reason
    assert "the table's response changed by a factor of" in point.reason
    assert not [event for event in run.events if isinstance(event, LimitExceeded)]
    last = max(event.cycle for event in run.events if isinstance(event, HoldCycle))
    assert last <= BEGINS + 4
    assert run.last_drive == 0.0


def test_a_lost_laser_ends_the_run_at_zero(faulty: Faulty) -> None:
    run = faulty(1.0, 0.0, True)
    assert run.ending.status == "aborted"
    assert "storey_1" in run.ending.reason or "laser" in run.ending.reason
    assert run.last_drive == 0.0
