"""A scripted bench for the harmonic plan: answers its steps and keeps them."""

from collections.abc import Callable
from functools import cache

import numpy as np

from bench.analysis.cycles import Cycle
from bench.analysis.signals import ACCELERATION, DRIFT, LASER_1, LASER_2, U1
from bench.config.model import BenchConfiguration
from bench.engine.steps import (
    Arm,
    Done,
    Dwell,
    Fallen,
    Measured,
    OperatorAction,
    Outcome,
    Publish,
    Step,
    Sweep,
)
from bench.events import PointFinished
from bench.protocol import Result
from drivers.rig import OperatorTask
from protocols.harmonic.campaign import HarmonicCampaign
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint
from sim.specimen import Specimen
from tests.made_cycles import pure_cycle

OMEGA, BETA = 16.0, 0.4
PARAMETERS = HarmonicParameters(omega=(OMEGA,), beta=(BETA,), starts=3, settle_limit=30.0)
AMPLITUDE = PARAMETERS.amplitude_factor * Specimen().uplift_acceleration


def cycle(index: int, drift: float, u1: float = 0.001, turn: float = 0.0) -> Cycle:
    fundamental = np.zeros(7, dtype=complex)
    fundamental[ACCELERATION], fundamental[6] = AMPLITUDE, 1.0
    fundamental[U1], fundamental[DRIFT], fundamental[LASER_1] = u1, drift * np.exp(1j * turn), u1
    fundamental[LASER_2] = fundamental[U1] + fundamental[DRIFT]
    return pure_cycle(index, fundamental, samples=700)


@cache
def usual() -> HarmonicCampaign:
    """The campaign of `PARAMETERS`, whose starts are planned once; each of its plans begins anew."""
    return HarmonicCampaign(PARAMETERS, BenchConfiguration())


class Script:
    """Answers the steps of a plan and keeps them."""

    def __init__(
        self,
        coupled: Callable[[int, int], Cycle | None],
        bare: float,
        prepared: HarmonicCampaign | None = None,
    ) -> None:
        self._prepared = prepared or usual()
        self._coupled, self._bare = coupled, bare
        self.steps: list[Step] = []
        self.start = 0
        self.cycles = 0
        self.testing = False
        self.mounted = False

    def run(self) -> list[HarmonicPoint]:
        plan = self._prepared.plan()
        points: list[HarmonicPoint] = []
        step = next(plan)
        try:
            while True:
                self.steps.append(step)
                if isinstance(step, Publish) and isinstance(step.event, PointFinished):
                    assert isinstance(step.event.point, HarmonicPoint)
                    points.append(step.event.point)
                step = plan.send(self._answer(step))
        except StopIteration as end:
            result = end.value
        assert isinstance(result, Result)
        assert list(result.points) == points
        return points

    def _answer(self, step: Step) -> Outcome:
        match step:
            case OperatorAction(work=OperatorTask.MOUNT_SPRING):
                self.mounted = True
            case Arm():
                self.cycles = 0
                self.testing = False
            case Sweep(segments=segments) if self.mounted and len(segments) > 1:
                self.testing = True
                self.start += 1
            case Dwell(cycles=n) if self.testing:
                made = [self._coupled(self.start, self.cycles + k) for k in range(n)]
                self.cycles += n
                found = [cycle for cycle in made if cycle is not None]
                return Measured(tuple(found)) if len(found) == n else Fallen()
            case Dwell(cycles=n):
                return Measured(tuple(cycle(k, self._bare) for k in range(n)))
            case _:
                pass
        return Done()

    def works(self) -> list[OperatorTask]:
        return [step.work for step in self.steps if isinstance(step, OperatorAction)]
