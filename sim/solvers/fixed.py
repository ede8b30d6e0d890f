"""The Runge-Kutta solvers with a fixed step: the paper's own procedure, and the same method with located events."""

import numpy as np
from numpy.typing import NDArray

from sim.rocking import MOST_IMPACTS, REST_ANGLE, Motion, motion_of
from sim.solvers.problem import Problem

PAPER_STEP = 1e-3
"""Time step [s] of the paper, section 3.3."""

SEISMIC_PARTS = 10
"""Into how many parts a step with an impact is divided under a record. The paper says "a further subdivision" only."""


def paper(problem: Problem, step: float) -> Motion:
    """Section 3.3 literally. Under a sampled record the step with an impact is repeated in SEISMIC_PARTS parts."""
    from sim.kernel.fixed_step import run_paper

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
    from sim.kernel.located_step import run_located

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
