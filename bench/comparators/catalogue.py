"""The solvers by name, the one call that runs any of them, and the gain of a long run by one of them.

All share the equations of `sim.kernel.equations`; they differ in how they go through time and find events.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import pi, tau
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.comparators.problem import Problem
from bench.comparators.scipy_events import dop853
from sim.errors import InvalidInput
from sim.excitation import Excitation, SineProgram, Sweep
from sim.linear import steady_peaks
from sim.rocking import MOST_IMPACTS, REST_ANGLE, TOLERANCE, Motion, State, motion_of, simulate
from sim.specimen import Specimen

PAPER_STEP = 1e-3
"""Time step [s] of the paper, section 3.3."""

SEISMIC_PARTS = 10
"""Into how many parts a step with an impact is divided under a record. The paper says "a further subdivision" only."""


def paper(problem: Problem, step: float) -> Motion:
    """Section 3.3 literally. Under a sampled record the step with an impact is repeated in SEISMIC_PARTS parts."""
    from bench.comparators.kernel.fixed_step import run_paper

    x, samples, report = _outputs(problem)
    # a record has straight lines and no sines
    seismic = not problem.segments[:, 1:5].any()
    run_paper(
        problem.parameters,
        problem.segments,
        x,
        problem.times,
        samples,
        step,
        SEISMIC_PARTS if seismic else 1,
        problem.overturning_angle,
        problem.peaks_from,
        report,
    )
    return motion_of(report, x, samples if problem.sampled else None, watched=problem.watched)


def rk4_located(problem: Problem, step: float) -> Motion:
    """Steps of at most `step` that end at events, found by steps of other lengths: order 4 through impacts."""
    from bench.comparators.kernel.located_step import run_located

    x, samples, report = _outputs(problem)
    run_located(
        problem.parameters,
        problem.segments,
        x,
        problem.times,
        samples,
        step,
        problem.overturning_angle,
        REST_ANGLE,
        problem.peaks_from,
        MOST_IMPACTS,
        report,
    )
    return motion_of(report, x, samples if problem.sampled else None, watched=problem.watched)


def _outputs(problem: Problem) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    from sim.kernel.rocking import REPORT

    return problem.start.copy(), np.empty((problem.times.size, 6)), np.empty(REPORT)


@dataclass(frozen=True)
class Solver:
    """A way to integrate. `knob` is what sets its accuracy, `default` and `limits` are of that.

    `run` is None for the engine itself, `sim.rocking.simulate`.
    """

    name: str
    summary: str
    knob: Literal["tolerance", "step"]
    default: float
    limits: tuple[float, float]
    run: Callable[[Problem, float], Motion] | None


SOLVERS: Mapping[str, Solver] = MappingProxyType(
    {
        solver.name: solver
        for solver in (
            Solver(
                "taylor", "Taylor series with events on the polynomials", "tolerance", TOLERANCE, (1e-15, 1e-3), None
            ),
            Solver("paper", "RK4 at 1 ms with a sign test, as section 3.3", "step", PAPER_STEP, (1e-6, 0.1), paper),
            Solver("rk4-located", "RK4 with events located by stepping", "step", PAPER_STEP, (1e-6, 0.1), rk4_located),
            Solver("dop853", "scipy's DOP853 with its events", "tolerance", TOLERANCE, (1e-13, 1e-3), dop853),
        )
    }
)
"""By name; the first is the one to use, the others are for comparison."""


def solve(
    name: str,
    specimen: Specimen,
    excitation: Excitation,
    *,
    state: State | None = None,
    sample_times: ArrayLike | None = None,
    peaks_from: float | None = 0.0,
    tolerance: float | None = None,
    step: float | None = None,
    overturning_angle: float = pi / 2,
) -> Motion:
    """`sim.rocking.simulate` by the solver `name`; its knob, `tolerance` or `step` [s], has a default.

    `paper` never lets the block come back to rest, takes impacts at ends of steps and peaks among steps. The others
    agree with `taylor` within their order.
    Raises InvalidInput for an unknown name, the other solver's knob, and values outside their meaning.
    """
    solver = SOLVERS.get(name)
    if solver is None:
        raise InvalidInput("solver", name, f"it must be one of {', '.join(SOLVERS)}")
    given = {"tolerance": tolerance, "step": step}
    for knob, number in given.items():
        if knob != solver.knob and number is not None:
            raise InvalidInput(knob, number, f"the solver {name} takes {solver.knob} instead")
    chosen = given[solver.knob]
    value = solver.default if chosen is None else chosen
    least, most = solver.limits
    if not least <= value <= most:
        raise InvalidInput(solver.knob, value, f"for the solver {name} it must be between {least:g} and {most:g}")
    if solver.run is None:
        return simulate(
            specimen,
            excitation,
            state=state,
            sample_times=sample_times,
            peaks_from=peaks_from,
            tolerance=value,
            overturning_angle=overturning_angle,
        )
    return solver.run(Problem.checked(specimen, excitation, state, sample_times, peaks_from, overturning_angle), value)


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
    bare frame's peaks are exact. Raises as `bench.comparators.catalogue.solve` and `sim.steady.rocking_orbit` do, and
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
