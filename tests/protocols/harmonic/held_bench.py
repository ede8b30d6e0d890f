"""A campaign on the simulated bench that is continued from its captured motion, each time with another fault.

Its beginning is simulated once: a repeated campaign reads the same samples until the motion is captured.
"""

from collections import deque
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition, Simulation
from bench.control.stabiliser import CAPTURED, QUIET
from bench.engine.engine import configured_engine
from bench.engine.interface import Ending, EventStream, Requests, Unattended
from bench.events import Event, PointFinished
from drivers.rig import Counts, OperatorTask
from drivers.simulated import SimulatedRig
from protocols.common.sine.holding import HoldCycle
from protocols.harmonic.campaign import HarmonicCampaign
from protocols.harmonic.protocol import HarmonicPoint
from sim.kernel import table
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters
from tests.faults.rig import FaultyRig
from tests.recorded import recorded

CONFIGURATION = BenchConfiguration(
    acquisition=Acquisition(block_duration=0.2),
    simulation=Simulation(bench=VirtualBenchParameters(sample_rate=1000.0)),
)

Array = NDArray[np.float64]


class TapedRig(SimulatedRig):
    """Simulated rig that reads the blocks of `tape`, drive and counts, before those of its own bench.

    `gain` and `late` [samples] are those of a defective amplifier; they act on its own bench only.
    """

    def __init__(self, tape: "Tape | None" = None) -> None:
        lead = CONFIGURATION.lead_samples
        super().__init__(CONFIGURATION.simulation.bench, Specimen(), seed=3, lead=lead)
        self.gain, self.late = 1.0, 0
        self.blocks: list[tuple[Array, Counts]] = []
        self._left = deque(tape.blocks if tape is not None else ())
        if tape is not None:
            self.bench = _copy(tape.bench)

    @property
    def on_tape(self) -> bool:
        return bool(self._left)

    def begin(self) -> None:
        if not self.on_tape:
            super().begin()

    def carry_out(self, work: OperatorTask, amount: float | None) -> None:
        if not self.on_tape:
            super().carry_out(work, amount)

    def respond(self, volts: Array) -> Counts:
        if self._left:
            drive, counts = self._left.popleft()
            assert np.array_equal(drive, volts), "the repeated campaign has another drive"
        else:
            before = self.blocks[-1][0] if self.blocks else np.zeros_like(volts)
            late = np.concatenate((before, volts))[before.size - self.late :][: volts.size]
            counts = super().respond(self.gain * late)
        self.blocks.append((volts, counts))
        return counts


@dataclass(frozen=True)
class Tape:
    """A campaign up to its captured motion: drive and counts of every block, and the bench after the last one."""

    campaign: HarmonicCampaign
    blocks: list[tuple[Array, Counts]]
    bench: VirtualBench
    cycles: int
    """Number of cycles of the hold."""


def captured(campaign: HarmonicCampaign) -> Tape:
    """Carry out the first hold of a campaign until its motion is captured."""
    rig, requests, controls, found = TapedRig(), Requests(), list[float](), list[VirtualBench]()

    def watch(event: Event) -> None:
        if isinstance(event, HoldCycle):
            controls.append(event.control)
            if len(controls) >= CAPTURED and max(controls[-CAPTURED:]) <= QUIET and not found:
                found.append(_copy(rig.bench))
                requests.halt()

    stream = EventStream(rig.clock, [watch])
    ending = configured_engine(rig, CONFIGURATION, stream, requests, Unattended()).run(campaign.plan())
    assert found, ending
    return Tape(campaign, rig.blocks, found[0], len(controls))


@dataclass(frozen=True)
class Story:
    """A continued campaign: its rig, ending, points and events."""

    rig: FaultyRig
    ending: Ending
    points: list[HarmonicPoint]
    events: list[Event]

    @property
    def cycles(self) -> list[HoldCycle]:
        """All cycles of the hold."""
        return [event for event in self.events if isinstance(event, HoldCycle)]


Begin = Callable[[FaultyRig, TapedRig], None]


def continued(tape: Tape, begin: Begin, path: Path) -> Story:
    """Carry out the campaign with its file at `path`; `begin` brings about a fault when the motion is captured."""
    own = TapedRig(tape)
    rig, points, events, begun = FaultyRig(own), list[HarmonicPoint](), list[Event](), list[bool]()

    def look() -> None:
        if not own.on_tape and not begun:
            begun.append(True)
            begin(rig, own)

    def watch(event: Event) -> None:
        events.append(event)
        if isinstance(event, PointFinished) and isinstance(event.point, HarmonicPoint):
            points.append(event.point)

    rig.before_read = look
    plan = tape.campaign.plan()
    ending = recorded(path, plan, rig, CONFIGURATION, HarmonicPoint, subscribers=[watch], events=(HoldCycle,))
    assert begun
    return Story(rig, ending, points, events)


def _copy(bench: VirtualBench) -> VirtualBench:
    return deepcopy(bench, {id(table): table})
