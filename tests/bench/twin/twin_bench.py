"""A virtual bench with its twin, for tests: a plan goes through the engine, and everything that is said is kept."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import SignalMap
from bench.config.model import BenchConfiguration
from bench.config.sections import Simulation, Twin
from bench.engine.engine import Engine
from bench.engine.interface import Ending, EventStream, Requests, Unattended
from bench.engine.steps import Arm, Fallen, OperatorAction, Plan, Play, Publish, RampOut
from bench.events import Acquired, Event, Subscriber, Warned
from bench.guard.guard import Guard
from bench.live_values import TwinEstimate
from bench.twin.live import live_twin
from drivers.rig import OperatorTask
from drivers.simulated import SimulatedRig
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters

RATE = 1000.0
COUPLED = Specimen().coupled(0.25)
MOUNT = OperatorAction(OperatorTask.MOUNT_SPRING, COUPLED, "mount the spring")
REMOVE = OperatorAction(OperatorTask.REMOVE_BLOCK, COUPLED.bare(), "take the block off")


def configuration(truth: Specimen | None = None, **twin: object) -> BenchConfiguration:
    """A bench whose specimen really is `truth`."""
    simulation = Simulation(bench=VirtualBenchParameters(sample_rate=RATE), specimen=truth)
    return BenchConfiguration(simulation=simulation, twin=Twin.model_validate({"enabled": True, **twin}))


def shaken(
    seconds: float, volts: float = 1.3, omega: float = 22.0, handle: OperatorAction = MOUNT, stated: Event | None = None
) -> Plan:
    """Hands at work, then a sine that grows over two seconds and fades over half a second; `stated` before it."""
    yield handle
    yield Arm(0.5)
    if stated is not None:
        yield Publish(stated)
    t = np.arange(round(seconds * RATE)) / RATE
    outcome = yield Play(volts * np.clip(t / 2.0, 0.0, np.clip((t[-1] - t) / 0.5, 0.0, 1.0)) * np.sin(omega * t))
    yield RampOut(fast=isinstance(outcome, Fallen))


def _one_after_the_other(plans: Sequence[Plan]) -> Plan:
    for plan in plans:
        yield from plan


def estimate(**values: object) -> TwinEstimate:
    """What a twin may say; zero what is not given."""
    zeros: dict[str, Any] = {each.name: 0.0 for each in fields(TwinEstimate)}
    return TwinEstimate(**zeros | {"run": 1, "members": 39, "standing": 1.0, "trace": np.zeros((0, 6))} | values)


@dataclass
class Beside:
    """An engine and its twin. `truth` is the table's and the specimen's real motion: columns a, u1, u2, theta."""

    configuration: BenchConfiguration
    patient: bool = True
    block: int = 100
    listeners: list[Subscriber] = field(default_factory=list[Subscriber])
    events: list[Event] = field(default_factory=list[Event])
    truth: list[NDArray[np.float64]] = field(default_factory=list[NDArray[np.float64]])

    def run(self, *plans: Plan) -> Ending:
        simulation = self.configuration.simulation
        specimen = simulation.specimen or self.configuration.specimen
        requests = Requests()
        with SimulatedRig(simulation.bench, specimen, seed=simulation.seed) as rig:
            stream = EventStream(rig.clock, [self.events.append, lambda event: self._look(rig, event), *self.listeners])
            signals = SignalMap(rig.channels, self.configuration.laser_reference)
            guard = Guard(rig, self.configuration.limits, self.configuration.ramps, signals=signals)
            engine = Engine(rig, guard, stream, requests, Unattended(), self.block)
            with live_twin(stream, rig, self.configuration, requests, patient=self.patient):
                return engine.run(_one_after_the_other(plans))

    def _look(self, rig: SimulatedRig, event: Event) -> None:
        if isinstance(event, Acquired):
            truth = rig.bench.truth
            self.truth.append(np.column_stack((truth.a, truth.u1, truth.u2, truth.theta)))

    @property
    def estimates(self) -> list[TwinEstimate]:
        return [event for event in self.events if isinstance(event, TwinEstimate)]

    @property
    def warnings(self) -> list[str]:
        return [event.text for event in self.events if isinstance(event, Warned)]
