"""How long it takes from the first sample beyond a limit to the first sample of the output that is changed by it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.guard.guard import Guard
from bench.guard.limits import Debounce, Limits, Ramps
from drivers.simulated import SimulatedRig
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters

RATE = 2000.0
DEBOUNCE = 0.003
LIMITS = Limits(displacement=0.008, debounce=Debounce(displacement=DEBOUNCE))
OMEGA, VOLTS = 15.0, 4.0
"""A sine [rad/s], amplitude [V], that takes the table far beyond the limit, and for long against the debounce."""


@dataclass(frozen=True)
class Reaction:
    """Samples from the first one beyond the limit, as measured and in truth, to the first changed output sample."""

    block: int
    lead: int
    measured: int
    truth: int

    @property
    def promised(self) -> int:
        """One block, and the lead; a limit that must be exceeded for a while may be seen a block later."""
        return self.block + self.lead + round(DEBOUNCE * RATE)


def react(block: int, lead: int, phase: float) -> Reaction:
    """Drive the virtual bench past a limit of its displacement.

    The sine begins `phase` blocks late, 0 to 1, so the limit is passed at another place in a block.
    """
    rig = SimulatedRig(VirtualBenchParameters(sample_rate=RATE), Specimen(), seed=1, lead=lead)
    guard = Guard(rig, LIMITS, Ramps())
    guard.arm()
    column = [channel.name for channel in rig.channels].index("table_displacement")
    measured: list[NDArray[np.float64]] = []
    truth: list[NDArray[np.float64]] = []
    played: list[NDArray[np.float64]] = []
    asked: list[NDArray[np.float64]] = [np.zeros(lead)]
    while not guard.at_zero:
        t = (np.arange(len(played) * block, (len(played) + 1) * block) - round(phase * block)) / RATE
        asked.append(np.where(t > 0.0, VOLTS * np.sin(OMEGA * t), 0.0))
        exchange = guard.exchange(asked[-1])
        measured.append(exchange.values[:, column])
        truth.append(rig.bench.truth.x)
        played.append(exchange.drive)
    rig.close()
    drive = np.concatenate(played)
    changed = np.flatnonzero(drive != np.concatenate(asked)[: drive.size])[0]
    beyond = [np.flatnonzero(np.abs(np.concatenate(of)) > LIMITS.displacement)[0] for of in (measured, truth)]
    return Reaction(block, lead, int(changed - beyond[0]), int(changed - beyond[1]))
