"""Catalogue of solvers with a common call, and the steady-state gain computed by any of them.

All use the equations of `sim.kernel.equations`; they differ in time integration and event location.
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
"""Time step [s] used in section 3.3 of the paper."""

SEISMIC_PARTS = 10
"""Number of parts into which a step with an impact is divided when the excitation is a record. The paper states only "a
further subdivision".
"""


def paper(problem: Problem, step: float) -> Motion:
    """Integrate by the procedure of section 3.3 of the paper, unchanged: RK4 with the fixed `step` [s], where an impact
    is a change of the sign of theta from one step to the next.

    If the excitation is a sampled record, a step with an impact is repeated in SEISMIC_PARTS parts.
    """
    from bench.comparators.kernel.fixed_step import run_paper

    x, samples, report = _outputs(problem)
    # only sampled records consist of segments without a sine
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
    """RK4 with steps of at most `step` [s] that end at events. An event is located by trial steps of other lengths,
    which preserves order 4 across impacts.
    """
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
    from sim.kernel.steps import REPORT

    return problem.start.copy(), np.empty((problem.times.size, 6)), np.empty(REPORT)


@dataclass(frozen=True)
class Solver:
    """An integration method.

    `knob` names its accuracy parameter, with `default` and `limits`. `run` is None for `sim.rocking.simulate` itself.
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
                "taylor",
                "Taylor series with events located on the polynomials",
                "tolerance",
                TOLERANCE,
                (1e-15, 1e-3),
                None,
            ),
            Solver("paper", "RK4 with a sign test, as in the paper", "step", PAPER_STEP, (1e-6, 0.1), paper),
            Solver("rk4-located", "RK4, events located by trial steps", "step", PAPER_STEP, (1e-6, 0.1), rk4_located),
            Solver("dop853", "DOP853 and events of scipy", "tolerance", TOLERANCE, (1e-13, 1e-3), dop853),
        )
    }
)
"""Solvers by name. The first is recommended; the others are for comparison."""


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
    """Same as `sim.rocking.simulate`, but by the solver `name`. Its accuracy parameter, `tolerance` or `step` [s], has
    a default.

    With `paper` the block never returns to rest, impacts occur at ends of steps and peaks are sampled at steps. The
    other solvers converge to `taylor` at their order. Raises InvalidInput for an unknown name, the accuracy parameter
    of another solver, or a value out of range.
    """
    solver = SOLVERS.get(name)
    if solver is None:
        raise InvalidInput("solver", name, f"it must be one of {', '.join(SOLVERS)}")
    given = {"tolerance": tolerance, "step": step}
    for knob, number in given.items():
        if knob != solver.knob and number is not None:
            raise InvalidInput(knob, number, f"use {solver.knob} with the solver {name}")
    chosen = given[solver.knob]
    value = solver.default if chosen is None else chosen
    least, most = solver.limits
    if not least <= value <= most:
        raise InvalidInput(solver.knob, value, f"it must be between {least:g} and {most:g} for the solver {name}")
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
"""Number of drive periods at the end of a run in which its peaks are determined.

The motion of a solver that does not locate impacts fluctuates about its steady state. A short window misses the
extremes, so the result depends on the window (docs/benchmarks.md states the spread). A solver that locates impacts
gives the same result for any window.
"""


@dataclass(frozen=True, eq=False)
class TimedGain:
    """alpha_1 and alpha_2 over the last periods of `motion`; they are meaningless if the run ended early."""

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
    """Gain coefficients over the last LAST_PERIODS periods of a run of `duration` [s] by the solver `name`.

    Without `state` the run starts on the exact rocking orbit, at its phase [rad] of the base's sine, and settles on the
    solver's steady state; from rest, the outcome would depend on a chaotic transient. The peaks of the bare frame are
    computed exactly. Raises the errors of `bench.comparators.catalogue.solve` and `sim.steady.rocking_orbit`, and
    InvalidInput for a run shorter than LAST_PERIODS periods. Source: Eq. (10).
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
