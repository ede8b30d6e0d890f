"""The solvers by name, and the one call that runs any of them.

All share the equations of `sim.kernel.equations`; they differ in how they go through time and find events.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import pi
from types import MappingProxyType
from typing import Literal

from numpy.typing import ArrayLike

from sim.errors import InvalidInput
from sim.excitation import Excitation
from sim.rocking import TOLERANCE, Motion, State, simulate
from sim.solvers.fixed import PAPER_STEP, paper, rk4_located
from sim.solvers.problem import Problem
from sim.solvers.scipy_events import dop853
from sim.specimen import Specimen


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
