# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
"""scipy's integrators with their own events, one call for each phase and segment of the excitation.

The pyright comment in the first line is needed because scipy's result has no type annotations. The integrator restarts
at each event and breakpoint, across which its error estimate is invalid.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bench.comparators.problem import Problem
from sim.rocking import MOST_IMPACTS, REST_ANGLE, Motion, motion_of

Vector = NDArray[np.float64]
Function = Callable[[float, Vector], float]
DrivenRates = Callable[[Vector, float, Vector, float, Vector, Vector], None]
Method = Literal["RK45", "DOP853", "LSODA", "Radau"]
METHODS: tuple[Method, ...] = ("RK45", "DOP853", "LSODA", "Radau")

WATCHED = (
    (np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])),
    (np.array([-1.0, 1.0, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0, 1.0, 0.0, 0.0])),
    (np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0]), np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])),
)
"""Rows that select u1, u2 - u1 and theta, and their velocities, from the state."""


def dop853(problem: Problem, tolerance: float) -> Motion:
    """Integrate by scipy's DOP853 (Hairer, Norsett and Wanner, 1993) with this relative `tolerance`."""
    return integrate("DOP853", problem, tolerance)


def integrate(method: Method, problem: Problem, tolerance: float, equations: DrivenRates | None = None) -> Motion:
    """Integrate `problem` by the `method` of `scipy.integrate.solve_ivp`; the absolute tolerance is a hundredth of
    `tolerance`.

    The root theta = 0 at the start of a phase is divided out of the impact event. Peaks and samples, which require the
    dense output, cost time only when they are requested. `equations` defaults to the compiled equations.
    """
    from scipy.integrate import solve_ivp

    from bench.comparators.kernel.fixed_step import base, driven_rates
    from sim.kernel import rocking as kernel
    from sim.kernel.equations import COUPLED, GRAVITY, H1, H_B, INERTIA, K_C, MASS, RESTITUTION, B

    driven: DrivenRates = equations or driven_rates
    p, x = problem.parameters, problem.start.copy()
    samples, peaks = np.empty((problem.times.size, 6)), np.zeros(3)
    holding = float(p[B] * p[GRAVITY] * p[MASS])
    sg = float(np.sign(x[4]) if x[4] != 0.0 else np.sign(x[5]))
    known = 1 if x[4] == 0.0 else 0
    status, impacts, steps, filled = kernel.COMPLETED, 0, 0, 0
    begin = now = 0.0

    def moment(row: Vector, t: float, y: Vector) -> float:
        return float(p[H_B] * p[MASS] * base(row, t)[0] - p[K_C] * p[H1] * y[0])

    for row in problem.segments:
        tau, duration = 0.0, float(row[0])
        while duration - tau > 1e-14 * duration and status == kernel.COMPLETED:
            lift = moment(row, tau, x)
            if sg == 0.0 and p[COUPLED] != 0.0 and abs(lift) > holding * (1.0 + 1e-12):
                sg, known = float(np.sign(lift)), 2
            events = _events(problem, row, sg, tau, known, holding, moment)

            def rates(t: float, y: Vector, row: Vector = row, sg: float = sg) -> Vector:
                out = np.empty(6)
                driven(p, sg, row, t, np.ascontiguousarray(y), out)
                return out

            wanted = filled < problem.times.size and problem.times[filled] <= begin + duration + 1e-12
            watching = problem.peaks_from < begin + duration
            solution: Any = solve_ivp(
                rates,
                (tau, duration),
                x,
                method=method,
                rtol=tolerance,
                atol=0.01 * tolerance,
                events=events or None,
                dense_output=wanted or watching,
            )
            steps += solution.t.size - 1
            end = float(solution.t[-1])
            while filled < problem.times.size and problem.times[filled] <= begin + end + 1e-12:
                samples[filled] = solution.sol(problem.times[filled] - begin)
                filled += 1
            if begin + end > problem.peaks_from:
                _raise_peaks(peaks, solution, max(tau, problem.peaks_from - begin))
            x, tau, known = np.array(solution.y[:, -1], dtype=np.float64), end, 0
            if solution.status == -1:
                status = kernel.FAILED
            elif solution.status == 1 and sg == 0.0:
                sg, known = float(np.sign(moment(row, tau, x))), 2
                x[4:] = 0.0
            elif solution.status == 1 and solution.t_events[1].size:
                status = kernel.OVERTURNED_A if sg > 0.0 else kernel.OVERTURNED_B
            elif solution.status == 1:
                impacts, known = impacts + 1, 1
                x[4], x[5] = 0.0, x[5] * p[RESTITUTION]
                spare = 2.0 * (holding - abs(moment(row, tau, x))) / p[INERTIA] * REST_ANGLE
                if x[5] * x[5] < spare:
                    x[5] = 0.0
                sg = float(np.sign(x[5]))
                if impacts >= MOST_IMPACTS:
                    status = kernel.FAILED
            now = begin + tau
        if status != kernel.COMPLETED:
            break
        begin += duration
        now = begin
    report = np.array([status, now, impacts, steps, filled, *peaks])
    return motion_of(report, x, samples if problem.sampled else None, watched=problem.watched)


def python_rates(p: Vector, sg: float, row: Vector, t: float, x: Vector, out: Vector) -> None:
    """Uncompiled `bench.comparators.kernel.fixed_step.driven_rates`, comparable to most right-hand sides passed to
    scipy.
    """
    from bench.comparators.kernel import fixed_step

    plain_base, plain_rates = _python(fixed_step.base), _python(fixed_step.rates)
    plain_rates(p.tolist(), sg, x.tolist(), plain_base(row.tolist(), t)[0], out)


def _python(function: Any) -> Any:
    """The Python function from which `function` was compiled."""
    return function.py_func


def _events(
    problem: Problem,
    row: Vector,
    sg: float,
    start: float,
    known: int,
    holding: float,
    moment: Callable[[Vector, float, Vector], float],
) -> list[Function]:
    """Events that end the phase: impact and overturning while the block rocks, uplift while it is at rest, none for the
    bare frame.
    """
    from sim.kernel.equations import COUPLED

    limit = problem.overturning_angle

    def impact(t: float, y: Vector) -> float:
        return sg * y[4] / (t - start) ** known if t > start or known == 0 else 1.0

    def overturning(_: float, y: Vector) -> float:
        return limit - sg * y[4]

    def uplift(t: float, y: Vector) -> float:
        return holding - abs(moment(row, t, y))

    events: list[Function] = []
    if sg != 0.0:
        events = [impact, overturning]
    elif problem.parameters[COUPLED] != 0.0:
        events = [uplift]
    for event in events:
        event.terminal = True  # pyright: ignore[reportFunctionMemberAccess]  # scipy's convention
        event.direction = -1.0  # pyright: ignore[reportFunctionMemberAccess]
    return events


def _raise_peaks(peaks: Vector, solution: Any, start: float) -> None:
    """Raise `peaks` to the largest magnitudes of the dense output from `start` [s] on."""
    from scipy.optimize import brentq

    times = np.array([start, *(t for t in solution.t if t > start)])
    states = np.array(solution.sol(times))
    for which, (place, velocity) in enumerate(WATCHED):
        best = float(np.abs(place @ states).max())
        slopes = velocity @ states
        for i, (left, right) in enumerate(pairwise(times)):
            if slopes[i] * slopes[i + 1] < 0.0:

                def slope(t: float, velocity: Vector = velocity) -> float:
                    return float(velocity @ solution.sol(t))

                t = brentq(slope, left, right, xtol=1e-12)
                best = max(best, abs(float(place @ solution.sol(t))))
        peaks[which] = max(peaks[which], best)
