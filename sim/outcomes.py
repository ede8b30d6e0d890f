"""Outcome of a given start-up: one of the two steady motions, another motion, or overturning.

Several motions can coexist, and the transients that lead to them are chaotic, so that only integration shows which one
a test reaches.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from math import ceil, log, tau
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput
from sim.excitation import SineProgram, Sweep
from sim.maps import BranchMap, GainMap
from sim.rocking import Mode, Motion, Peaks, Status, simulate
from sim.specimen import Specimen
from sim.steady import NoOrbit, check_steady, resting_state, rocking_orbit
from sim.sweep import Done, sweep

START_DURATION = 120.0
"""Duration [s] of the default start-up."""

WITHIN = 0.02
"""Largest relative difference between peaks and those of a steady motion at which this motion counts as reached."""

WINDOW = 20
"""Number of drive periods over which the peaks are taken."""

LEFT = 1e-3
"""Fraction to which a disturbance of the stable orbit would decay while an undecided motion is continued."""

FEWEST_ROUNDS, MOST_ROUNDS = 10, 100
"""Minimum and maximum number of rounds, of WINDOW periods each, for which an undecided motion is continued; the minimum
applies without a stable rocking orbit.
"""

StartProgram = Callable[[float, float], SineProgram]
"""Function of the final frequency [rad/s] and amplitude [m/s2] that returns the base excitation of a start-up."""


class Outcome(StrEnum):
    """Outcome of a start-up. OTHER: neither steady motion, but a motion that is modulated or of another period."""

    ROCKING = "rocking"
    RESTING = "resting"
    OTHER = "other"
    TOPPLED = "toppled"
    FAILED = "failed"


@dataclass(frozen=True)
class Reached:
    """Outcome of a start-up.

    `time` [s], from the beginning of the start-up, is the time at which the block overturned or the outcome was
    decided. `side` is the corner about which it overturned. `peaks` are those of the last 20 periods of the drive; None
    if the block toppled or the run failed.
    """

    outcome: Outcome
    time: float
    side: Literal["A", "B"] | None
    peaks: Peaks | None


class Steady(NamedTuple):
    """Peaks of the stable steady motions at a point, None where there is none, and multiplier of the rocking motion."""

    rocking: Peaks | None
    resting: Peaks | None
    multiplier: float


@dataclass(frozen=True, eq=False)
class OutcomeMap:
    """Outcomes over the grid of a gain map, n stiffnesses by m frequencies, each array of shape (n, m).

    `outcome` contains values of `Outcome`. `time` [s] and `side` ("A", "B" or empty) are those of `Reached`. `drift` is
    the greatest |u2 - u1| [m] over the last 20 periods; NaN if the block toppled or the run failed.
    """

    outcome: NDArray[np.str_]
    time: NDArray[np.float64]
    side: NDArray[np.str_]
    drift: NDArray[np.float64]

    def count(self, outcome: Outcome) -> int:
        """Number of cells with this outcome."""
        return int((self.outcome == str(outcome)).sum())


def switched_on(omega: float, amplitude: float) -> SineProgram:
    """Program with a sine of constant amplitude from t = 0 to START_DURATION."""
    return SineProgram([Sweep.dwell(START_DURATION, amplitude, omega)])


def reached(
    specimen: Specimen,
    omega: float,
    amplitude: float,
    start: StartProgram = switched_on,
    steady: Steady | None = None,
) -> Reached:
    """Outcome of a start-up from rest that ends with a sine of `omega` [rad/s] and `amplitude` [m/s2].

    The program that `start` returns must end with a dwell of at least WINDOW periods at these values. If the motion
    has then reached neither steady motion, it is continued. `steady` are the steady motions, if already known.

    Raises InvalidInput for a bare frame, values outside their ranges, or a program with a different end.
    """
    check_steady(specimen, omega, amplitude)
    program, window = start(omega, amplitude), WINDOW * tau / omega
    last = program.sweeps[-1]
    if last.omega != (omega, omega) or last.amplitude != (amplitude, amplitude) or last.duration < window:
        allowed = f"it must end with a dwell of at least {window:g} s at {omega:g} rad/s and {amplitude:g} m/s2"
        span = f"{last.omega[0]:g} to {last.omega[1]:g} rad/s, {last.amplitude[0]:g} to {last.amplitude[1]:g} m/s2"
        raise InvalidInput("end of a start-up", f"{last.duration:g} s, {span}", allowed)
    steady = steady or _steady(specimen, omega, amplitude)
    phase = program.phase + sum(float(part.phase_at(np.array(part.duration))) for part in program.sweeps)
    # whole periods, so that each round begins at the phase with which the previous one ended
    more = SineProgram([Sweep.dwell(window, amplitude, omega)], phase % tau)
    motion = simulate(specimen, program, peaks_from=program.duration - window)
    time, rounds = motion.end_time, 0
    while (outcome := _judged(motion, steady)) is Outcome.OTHER and rounds < _most_rounds(steady):
        if specimen.beta and abs(motion.end.u1) >= specimen.d:
            # the spring has no length, so that the motion cannot be continued
            outcome = Outcome.FAILED
            break
        motion = simulate(specimen, more, state=motion.end)
        time, rounds = time + motion.end_time, rounds + 1
    return Reached(outcome, time, motion.overturned, motion.peaks if motion.status is Status.COMPLETED else None)


def outcome_map(
    gain_map: GainMap, start: StartProgram = switched_on, scheduler: str | None = None, done: Done | None = None
) -> OutcomeMap:
    """Outcomes of the start-up `start` in all cells of a gain map. Raises InvalidInput as `reached` does.

    `scheduler` is that of `sim.sweep.sweep`. With a scheduler, `start` must be picklable: a module-level function.
    """
    n, m = len(gain_map.betas), len(gain_map.omegas)
    cells = [
        _Cell(
            gain_map.specimen.coupled(float(gain_map.betas[i])),
            float(gain_map.omegas[j]),
            gain_map.amplitude,
            start,
            Steady(
                _cell_peaks(gain_map.rocking, i, j),
                _cell_peaks(gain_map.resting, i, j),
                float(gain_map.rocking.multiplier[i, j]),
            ),
        )
        for i in range(n)
        for j in range(m)
    ]
    results = sweep(_reached_in, cells, scheduler, batch=m, done=done)
    return OutcomeMap(
        outcome=np.array([str(result.outcome) for result in results]).reshape(n, m),
        time=np.array([result.time for result in results]).reshape(n, m),
        side=np.array([result.side or "" for result in results]).reshape(n, m),
        drift=np.array([result.peaks.drift if result.peaks else np.nan for result in results]).reshape(n, m),
    )


class _Cell(NamedTuple):
    specimen: Specimen
    omega: float
    amplitude: float
    start: StartProgram
    steady: Steady


def _reached_in(cell: _Cell) -> Reached:
    return reached(*cell)


def _cell_peaks(branch: BranchMap, i: int, j: int) -> Peaks | None:
    return Peaks(*(float(peak) for peak in branch.peaks[i, j])) if branch.stable[i, j] else None


def _steady(specimen: Specimen, omega: float, amplitude: float) -> Steady:
    resting = resting_state(specimen, omega, amplitude)
    try:
        rocking = rocking_orbit(specimen, omega, amplitude)
    except NoOrbit:
        rocking = None
    if rocking is None or not rocking.stable:
        return Steady(None, resting.peaks if resting else None, np.nan)
    return Steady(rocking.peaks, resting.peaks if resting else None, rocking.multiplier)


def _most_rounds(steady: Steady) -> int:
    """Number of rounds, of WINDOW periods each, for which an undecided motion is continued."""
    if steady.rocking is None:
        return FEWEST_ROUNDS
    return min(MOST_ROUNDS, max(FEWEST_ROUNDS, ceil(log(LEFT) / (WINDOW * log(steady.multiplier)))))


def _judged(motion: Motion, steady: Steady) -> Outcome:
    if motion.overturned:
        return Outcome.TOPPLED
    if motion.status is not Status.COMPLETED:
        return Outcome.FAILED
    if motion.end.mode is Mode.REST and motion.peaks.theta == 0.0:
        if steady.resting is not None and _is_near(motion.peaks, steady.resting):
            return Outcome.RESTING
    elif steady.rocking is not None and _is_near(motion.peaks, steady.rocking):
        return Outcome.ROCKING
    return Outcome.OTHER


def _is_near(peaks: Peaks, orbit: Peaks) -> bool:
    pairs = ((peaks.u1, orbit.u1), (peaks.drift, orbit.drift), (peaks.theta, orbit.theta))
    return all(abs(peak - steady) <= WITHIN * steady for peak, steady in pairs)
