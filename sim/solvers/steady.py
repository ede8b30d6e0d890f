"""Gain coefficients from a long run, as the paper computes them: the way to judge a solver by what it is used for."""

from dataclasses import dataclass
from math import tau

from sim.errors import InvalidInput
from sim.excitation import SineProgram, Sweep
from sim.linear import steady_peaks
from sim.rocking import Motion, State
from sim.solvers.catalogue import solve
from sim.specimen import Specimen

LAST_PERIODS = 60
"""Periods of the drive at the end of a run over which its peaks are taken.

A solver that does not locate impacts wanders about its steady state: a short window misses its excursions, and what it
gives depends on the window (docs/benchmarks.md has the spread). One that locates them gives the same over any.
"""


@dataclass(frozen=True, eq=False)
class TimedGain:
    """alpha_1 and alpha_2 over the last periods of `motion`; of a run that ended early they mean nothing."""

    alpha_1: float
    alpha_2: float
    motion: Motion


def steady_gain_by_time(
    name: str,
    specimen: Specimen,
    omega: float,
    amplitude: float,
    duration: float = 120.0,
    *,
    state: State | None = None,
    phase: float = 0.0,
    tolerance: float | None = None,
    step: float | None = None,
) -> TimedGain:
    """Gain coefficients of the last LAST_PERIODS periods of a run of `duration` [s] by the solver `name`.

    Without `state` the run starts on the exact rocking orbit, at the phase [rad] of the base's sine that belongs to it,
    and settles on what the solver takes for the steady state: from rest the transient decides, which is chaotic. The
    bare frame's peaks are exact. Raises as `sim.solvers.catalogue.solve` and `sim.steady.rocking_orbit` do, and
    InvalidInput for a run shorter than those periods. Source: Eq. (10).
    """
    from sim.steady import rocking_orbit

    window = LAST_PERIODS * tau / omega
    if not duration > window:
        raise InvalidInput("duration", duration, f"it must be longer than {LAST_PERIODS} periods, {window:g} s")
    if state is None:
        orbit = rocking_orbit(specimen, omega, amplitude)
        state, phase = orbit.start, orbit.phase
    drive = SineProgram([Sweep.dwell(duration, amplitude, omega)], phase=phase)
    motion = solve(name, specimen, drive, state=state, peaks_from=duration - window, tolerance=tolerance, step=step)
    bare = steady_peaks(specimen, omega, amplitude)
    return TimedGain(motion.peaks.u1 / bare.u1, motion.peaks.drift / bare.drift, motion)
