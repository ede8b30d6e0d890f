"""How far the specimen moves along a programme of sines: what the lasers see of it, and its drift."""

from dataclasses import dataclass
from math import tau
from typing import Literal

import numpy as np

from bench.preflight.load import envelope
from sim.excitation import SineProgram
from sim.rocking import simulate
from sim.specimen import Specimen

PER_CYCLE = 32
"""Samples in a cycle of the highest frequency: a peak between two is missed by 0.5 % at most."""

TOLERANCE = 1e-7
"""Of the simulations."""


@dataclass(frozen=True)
class Travel:
    """Greatest magnitudes [m]: of what either laser sees, and of the drift."""

    storey_1: float
    storey_2: float
    drift: float


def travel(
    specimen: Specimen,
    program: SineProgram,
    begin: float,
    reference: Literal["ground", "table"],
    catch_angle: float,
) -> Travel:
    """Simulated from rest; the motion from `begin` [s] on counts, up to where the block falls if it does.

    `reference` is where the lasers stand; `catch_angle` [rad] counts as fallen.
    """
    highest = max(max(sweep.omega) for sweep in program.sweeps)
    times = np.arange(begin, program.duration, tau / highest / PER_CYCLE)
    motion = simulate(
        specimen, program, sample_times=times, peaks_from=None, tolerance=TOLERANCE, overturning_angle=catch_angle
    )
    moved = np.zeros((0, 6)) if motion.samples is None else motion.samples
    if not len(moved):
        return Travel(0.0, 0.0, 0.0)
    u1, u2 = moved[:, 0], moved[:, 1]
    amplitude, omega, phase = envelope(program, times[: len(moved)])
    table = -amplitude / omega**2 * np.sin(phase) if reference == "ground" else np.zeros(len(moved))
    return Travel(*(float(np.abs(each).max()) for each in (u1 + table, u2 + table, u2 - u1)))
