"""The contenders of the work-precision table: each prepares itself once and then runs the standard case again."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from math import pi

import numpy as np
from numpy.typing import NDArray

from bench.comparators.case import DURATION, SPECIMEN, START, drive
from bench.comparators.catalogue import solve
from bench.comparators.problem import Problem
from bench.comparators.scipy_events import METHODS, integrate, python_rates
from bench.comparators.scipy_events import Method as ScipyMethod
from sim.rocking import Motion, Peaks

NOT_INSTALLED = "not installed"


@dataclass(frozen=True, eq=False)
class Outcome:
    """End state, shape (6,), number of impacts and of steps, and peaks if the method watched them."""

    end: NDArray[np.float64]
    impacts: int
    steps: int | None
    peaks: Peaks | None


Run = Callable[[], Outcome]


@dataclass(frozen=True)
class Method:
    """A method at one setting. `prepare` compiles what it needs; `weight` is about how long a run takes [s]."""

    name: str
    setting: str
    weight: float
    prepare: Callable[[], Run]
    module: str = ""

    @property
    def installed(self) -> bool:
        """Whether the library it needs is there."""
        return not self.module or find_spec(self.module) is not None


def methods(quick: bool) -> list[Method]:
    """All contenders; with `quick` those that take seconds are left out or run at one setting."""
    taylor = (1e-6, 1e-8, 1e-10, 1e-13) if quick else (1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14)
    scipy = {"RK45": {1e-6: 1.2}, "DOP853": {1e-10: 1.5}, "LSODA": {1e-10: 1.2}, "Radau": {1e-6: 4.0}}
    if not quick:
        scipy["RK45"] |= {1e-8: 1.9, 1e-10: 5.0}
        scipy["DOP853"] |= {1e-6: 1.0, 1e-8: 1.3, 1e-12: 2.5}
        scipy["LSODA"] |= {1e-6: 0.8, 1e-8: 1.0}
        scipy["Radau"] |= {1e-8: 12.0}
    heyoka = (1e-10, 1e-15) if quick else (1e-6, 1e-8, 1e-10, 1e-12, 1e-15)
    return [
        *(_named("taylor", 0.004, tolerance=tolerance) for tolerance in taylor),
        _named("taylor", 0.004, peaks=False, tolerance=1e-10),
        *(_heyoka(tolerance, peaks=False) for tolerance in heyoka),
        *(_heyoka(tolerance, peaks=True) for tolerance in heyoka[-1:]),
        _named("paper", 0.03, step=1e-3),
        *(_named("rk4-located", 5e-5 / step, step=step) for step in (4e-3, 2e-3, 1e-3, 5e-4)[: 3 if quick else 4]),
        *(_cvode(tolerance) for tolerance in ((1e-10,) if quick else (1e-6, 1e-8, 1e-10))),
        *(_scipy(name, tolerance, scipy[name][tolerance]) for name in METHODS for tolerance in sorted(scipy[name])),
        _scipy("DOP853", 1e-10, 2.0, python=True),
    ]


def _from_motion(motion: Motion, peaks: bool = True) -> Outcome:
    return Outcome(motion.end.as_array(), motion.impacts, motion.steps, motion.peaks if peaks else None)


def _named(
    name: str, weight: float, *, peaks: bool = True, tolerance: float | None = None, step: float | None = None
) -> Method:
    def run_for(duration: float) -> Outcome:
        window = 0.0 if peaks else None
        motion = solve(name, SPECIMEN, drive(duration), state=START, peaks_from=window, tolerance=tolerance, step=step)
        return _from_motion(motion, peaks)

    def prepare() -> Run:
        run_for(0.1)
        return lambda: run_for(DURATION)

    setting = f"tolerance {tolerance:g}" if step is None else f"step {1e3 * step:g} ms"
    return Method(name if peaks else f"{name}, no peaks", setting, weight, prepare)


def _scipy(name: ScipyMethod, tolerance: float, weight: float, *, python: bool = False) -> Method:
    def prepare() -> Run:
        problem = Problem.checked(SPECIMEN, drive(), START, None, None, pi / 2)
        equations = python_rates if python else None
        integrate(name, replace(problem, segments=drive(0.1).packed()), tolerance, equations)
        return lambda: _from_motion(integrate(name, problem, tolerance, equations), peaks=False)

    label = f"scipy {name}, Python" if python else f"scipy {name}"
    return Method(label, f"rtol {tolerance:g}", weight, prepare)


def _heyoka(tolerance: float, peaks: bool) -> Method:
    def prepare() -> Run:
        from bench.comparators.heyoka import HeyokaPeer

        peer = HeyokaPeer(tolerance, peaks=peaks)

        def run() -> Outcome:
            found = peer.run(DURATION)
            return Outcome(found.end, found.impacts, found.steps, None if found.peaks is None else Peaks(*found.peaks))

        peer.run(0.1)
        return run

    return Method("heyoka, with peaks" if peaks else "heyoka", f"tolerance {tolerance:g}", 0.02, prepare, "heyoka")


def _cvode(tolerance: float) -> Method:
    def prepare() -> Run:
        from bench.comparators.cvode import CvodePeer

        peer = CvodePeer(tolerance)

        def run() -> Outcome:
            end, impacts = peer.run()
            return Outcome(end, impacts, None, None)

        return run

    return Method("CVODE Adams", f"rtol {tolerance:g}", 0.8, prepare, "sksundae")
