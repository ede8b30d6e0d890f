"""What is asked of every run, whatever the scene: an explicit end, finite numbers, no ground passed, no event missed.

The audit reads the integrator's dense output only at times of its own choosing: many in one phase between two
impacts, then many more around the lowest point of that phase.
"""

from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.kernel import rocking as kernel
from sim.rocking import REST_ANGLE, TOLERANCE, Motion, Status, series_order, simulate
from tests.benchmarks.stress_cases import Case
from tests.sim.runs import kernel_run

DEPTH = 1e-12
"""Angle [rad] of the wrong sign that counts as the ground passed."""

LOOKS = 48
"""Times at which a phase is looked at, twice."""


def audit(case: Case, choice: float) -> tuple[Motion, list[str]]:
    """The run of `case` and what is wrong with it; `choice` in [0, 1) picks the phase that is looked into."""
    segments = case.excitation.packed()
    duration = float(segments[:, 0].sum())
    times = np.unique(np.clip([*np.linspace(0.0, duration, 24), *case.watch], 0.0, duration))
    motion = simulate(case.specimen, case.excitation, state=case.state, sample_times=times)
    assert motion.samples is not None
    faults: list[str] = []
    numbers = [motion.end.as_array(), motion.samples.ravel(), [motion.end_time], list(vars(motion.peaks).values())]
    if not np.isfinite(np.concatenate(numbers)).all():
        faults.append("not a number")
    if motion.status is Status.COMPLETED:
        if abs(motion.end_time - duration) > 1e-12 * duration or len(motion.samples) != times.size:
            faults.append("ended early")
        if motion.peaks.theta > 0.5 * pi * (1.0 + 1e-12):
            faults.append("overturning missed")
    elif motion.overturned and abs(abs(motion.end.theta) - 0.5 * pi) > 1e-9:
        faults.append("overturned elsewhere")
    faults += _resting(case, segments, times[: len(motion.samples)], motion.samples)
    faults += _phase(case, segments, motion, choice)
    return motion, faults


def _resting(
    case: Case, segments: NDArray[np.float64], times: NDArray[np.float64], samples: NDArray[np.float64]
) -> list[str]:
    """Whether the block rests where the moment lifts it (Eq. 9 and A.3)."""
    # a scene may start at rest under a moment that lifts the block at once
    rests = (samples[:, 4] == 0.0) & (samples[:, 5] == 0.0) & (times > 1e-11)
    if not rests.any():
        return []
    at, u1 = times[rests], samples[rests, 0]
    shape = case.specimen.block
    spring = case.specimen.k_c * case.specimen.frame.h1 * u1
    excess = np.full(at.size, np.inf)
    for earlier in (0.0, 4e-12):  # samples may lie a rounding past the event or the end of a segment
        push = shape.h_b * shape.mass * _acceleration(segments, at - earlier)
        bound = shape.b * case.specimen.g * shape.mass + 1e-9 * (np.abs(push) + np.abs(spring))
        excess = np.minimum(excess, np.abs(push - spring) / bound - 1.0)
    return ["uplift missed"] if (excess > 1e-9).any() else []


def _phase(case: Case, segments: NDArray[np.float64], motion: Motion, choice: float) -> list[str]:
    """Whether theta keeps its sign between two impacts, looked at closely."""
    duration = float(segments[:, 0].sum())
    options: dict[str, Any] = {
        "order": series_order(TOLERANCE, float(np.median(segments[:, 0]))),
        "tolerance": TOLERANCE,
        "rest_angle": REST_ANGLE,
    }
    start = case.state.as_array()

    def until(impact: int) -> tuple[float, float]:
        """Time of an impact and the sign of the motion after it; the start and the end of the run count as such."""
        if impact == 0:
            return 0.0, float(np.sign(start[4] or start[5]))
        if impact > motion.impacts:
            return motion.end_time, 0.0
        x, report, _ = kernel_run(case.specimen, segments, start, impacts=impact, **options)
        return float(report[kernel.END]), float(np.sign(x[5]))

    picked = int(choice * (motion.impacts + 1))
    begin, sign = until(picked)
    end, _ = until(picked + 1)
    # the integrator takes samples up to 1e-12 s past an event from the side before it
    low, high = begin + 2e-12, min(end, duration) - 2e-12
    for _ in range(2):
        if high - low < 1e-10:
            return []
        times = np.linspace(low, high, LOOKS)
        _, report, samples = kernel_run(case.specimen, segments, start, times=times, **options)
        theta = samples[: int(report[kernel.SAMPLES]), 4]
        if theta.size == 0:
            return []
        if sign == 0.0:
            sign = float(np.sign(theta[np.abs(theta).argmax()]))
        if (sign * theta < -DEPTH).any():
            return ["passed the ground"]
        dips = np.flatnonzero((sign * theta[1:-1] <= sign * theta[:-2]) & (sign * theta[1:-1] < sign * theta[2:])) + 1
        if dips.size == 0:
            return []
        lowest = int(dips[(sign * theta[dips]).argmin()])
        low, high = times[lowest - 1], times[lowest + 1]
    return []


def _acceleration(segments: NDArray[np.float64], times: NDArray[np.float64]) -> NDArray[np.float64]:
    """The base's acceleration [m/s2] at `times`, from the table that `sim.excitation` describes."""
    ends = np.cumsum(segments[:, 0])
    row = np.minimum(np.searchsorted(ends, times, side="left"), len(segments) - 1)
    _, p0, p1, p2, p3, phase, omega, kappa, level, slope = segments[row].T
    t = times - (ends[row] - segments[row, 0])
    sine = np.sin(phase + t * (omega + 0.5 * kappa * t))
    return (p0 + t * (p1 + t * (p2 + t * p3))) * sine + level + slope * t
