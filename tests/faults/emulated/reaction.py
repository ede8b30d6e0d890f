"""How fast the guard reacts through the real drivers, in real time: told by the emulated bench, not by the program."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.guard.guard import Guard
from bench.guard.limits import Ramps
from drivers.emulation.laboratory import Laboratory
from drivers.errors import DeviceTimeout, DriveUnderflow, RigError
from drivers.hardware.rig import HardwareRig
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.faults.emulated.local import without_network
from tests.faults.emulated.witness import Witness
from tests.faults.reaction import LIMITS, OMEGA, RATE, VOLTS, Reaction

_ATTEMPTS = 4


def react_in_real_time(block: int, lead: int, phase: float) -> Reaction:
    """As `tests.faults.reaction.react`; output and motion are those at the terminals of the emulated device."""
    (reaction,) = reactions_in_real_time(block, lead, [phase])
    if isinstance(reaction, RigError):
        raise reaction
    return reaction


def reactions_in_real_time(
    block: int, lead: int, phases: Sequence[float], *, local: bool = False
) -> Iterator[Reaction | RigError]:
    """One after the other, each on a bench of its own, whose table and over-travel switches are at rest; an error where
    the machine was too late for real time. `local`: the device is called without a network, as on this computer."""
    parameters = VirtualBenchParameters(sample_rate=RATE)
    for phase in phases:
        with Laboratory(parameters, Specimen(), seed=1, connection="analogue") as laboratory, ExitStack() as opened:
            witness = Witness(laboratory.bench)
            if local:
                opened.enter_context(without_network(laboratory.daq))
            rig = opened.enter_context(HardwareRig(laboratory.hardware, lead=lead))
            try:
                found = _reaction(rig, witness, laboratory, block, lead, phase)
            except (DriveUnderflow, DeviceTimeout) as error:
                found = error
        yield found


def _reaction(
    rig: HardwareRig, witness: Witness, laboratory: Laboratory, block: int, lead: int, phase: float
) -> Reaction:
    witness.forget()
    guard = Guard(rig, LIMITS, Ramps())
    guard.arm()
    column = [channel.name for channel in rig.channels].index("table_displacement")
    measured: list[NDArray[np.float64]] = []
    asked: list[NDArray[np.float64]] = [np.zeros(lead)]
    while not guard.at_zero:
        t = (np.arange(len(measured) * block, (len(measured) + 1) * block) - round(phase * block)) / RATE
        asked.append(np.where(t > 0.0, VOLTS * np.sin(OMEGA * t), 0.0))
        measured.append(guard.exchange(asked[-1]).values[:, column])
    hidden: Any = laboratory.daq
    start: int = hidden._driver.first_tick
    guard.disarm()
    truth = witness.told()
    n, begin = len(measured) * block, start - truth.first
    output, moved = truth.output[begin : begin + n], truth.x[begin : begin + n]
    changed = np.flatnonzero(output != np.concatenate(asked)[:n])[0]
    beyond = [np.flatnonzero(np.abs(of) > LIMITS.displacement)[0] for of in (np.concatenate(measured), moved)]
    return Reaction(block, lead, int(changed - beyond[0]), int(changed - beyond[1]))


def patient(block: int, lead: int, phase: float) -> Reaction:
    """The same; a machine that was too late for real time gets another chance."""
    for _ in range(_ATTEMPTS - 1):
        with suppress(RigError):
            return react_in_real_time(block, lead, phase)
    return react_in_real_time(block, lead, phase)
