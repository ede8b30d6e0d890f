"""Where the drive goes next, told from wherever it is."""

from collections.abc import Sequence
from dataclasses import dataclass

from sim.excitation import SineProgram, Sweep


@dataclass(frozen=True)
class Leg:
    """In `duration` [s] to a table acceleration of `amplitude` [m/s2] at `omega` [rad/s]."""

    duration: float
    amplitude: float
    omega: float


def sweeps(legs: Sequence[Leg], amplitude: float, omega: float) -> list[Sweep]:
    """The legs as sweeps that begin at `amplitude` and `omega`; from silence a leg begins at its own frequency."""
    found: list[Sweep] = []
    for leg in legs:
        begin = omega if amplitude > 0.0 else leg.omega
        found.append(Sweep(leg.duration, (amplitude, leg.amplitude), (begin, leg.omega)))
        amplitude, omega = leg.amplitude, leg.omega
    return found


def program(legs: Sequence[Leg], phase: float = 0.0) -> SineProgram:
    """The base motion that the legs make from rest."""
    return SineProgram(sweeps(legs, 0.0, legs[0].omega), phase)
