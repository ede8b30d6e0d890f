"""Error against run time for every method on the standard case, and errors of gains from long runs."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from math import pi

import numpy as np
from numpy.typing import NDArray

from bench.app.benchmark.section import Cell, Column, Section, Target, in_turn, once
from bench.comparators.case import AMPLITUDE, DURATION, IMPACTS, SPECIMEN, START, drive, error_of, peak_error_of
from bench.comparators.catalogue import LAST_PERIODS, SOLVERS, solve, steady_gain_by_time
from bench.comparators.problem import Problem
from bench.comparators.scipy_events import METHODS, integrate, python_rates
from bench.comparators.scipy_events import Method as ScipyMethod
from sim.gain import predict_gain
from sim.rocking import Motion, Peaks
from sim.specimen import Specimen

NOT_INSTALLED = "not installed"


@dataclass(frozen=True, eq=False)
class Outcome:
    """End state, shape (6,), number of impacts and of steps, and peaks if the method tracks them."""

    end: NDArray[np.float64]
    impacts: int
    steps: int | None
    peaks: Peaks | None


Run = Callable[[], Outcome]


@dataclass(frozen=True)
class Method:
    """A method at one setting. `prepare` compiles its functions and returns the function that is timed; `weight` is the
    approximate duration of a run [s].
    """

    name: str
    setting: str
    weight: float
    prepare: Callable[[], Run]
    module: str = ""

    @property
    def installed(self) -> bool:
        """Whether the library of the method is installed."""
        return not self.module or find_spec(self.module) is not None


def methods(quick: bool) -> list[Method]:
    """All methods at all settings; with `quick`, at fewer settings."""
    taylor = (1e-6, 1e-8, 1e-10, 1e-12, 1e-13) if quick else (1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14)
    scipy = {"RK45": {1e-6: 1.2}, "DOP853": {1e-10: 1.5}, "LSODA": {1e-10: 1.2}, "Radau": {1e-6: 4.0}}
    if not quick:
        scipy["RK45"] |= {1e-8: 1.9, 1e-10: 5.0}
        scipy["DOP853"] |= {1e-6: 1.0, 1e-8: 1.3, 1e-12: 2.5}
        scipy["LSODA"] |= {1e-6: 0.8, 1e-8: 1.0}
        scipy["Radau"] |= {1e-8: 12.0}
    heyoka = (1e-10, 1e-15) if quick else (1e-6, 1e-8, 1e-10, 1e-12, 1e-15)
    return [
        *(_named("taylor", 0.004, tolerance=tolerance) for tolerance in taylor),
        *(_named("taylor", 0.004, peaks=False, tolerance=tolerance) for tolerance in taylor if tolerance <= 1e-10),
        *(_heyoka(tolerance, peaks=False) for tolerance in heyoka),
        *(_heyoka(tolerance, peaks=True) for tolerance in (1e-10, 1e-15)),
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
        from bench.comparators.libraries import HeyokaPeer

        peer = HeyokaPeer(tolerance, peaks=peaks)

        def run() -> Outcome:
            found = peer.run(DURATION)
            return Outcome(found.end, found.impacts, found.steps, None if found.peaks is None else Peaks(*found.peaks))

        peer.run(0.1)
        return run

    return Method("heyoka, with peaks" if peaks else "heyoka", f"tolerance {tolerance:g}", 0.02, prepare, "heyoka")


def _cvode(tolerance: float) -> Method:
    def prepare() -> Run:
        from bench.comparators.libraries import CvodePeer

        peer = CvodePeer(tolerance)

        def run() -> Outcome:
            end, impacts = peer.run()
            return Outcome(end, impacts, None, None)

        return run

    return Method("CVODE Adams", f"rtol {tolerance:g}", 0.8, prepare, "sksundae")


POINTS = ((17.5, 0.40), (16.0, 0.97))
"""Omega [rad/s] and beta: point C of the paper, and a point with small alpha_2."""

GAIN_COLUMNS = (
    Column("omega", "Omega [rad/s]", "g"),
    Column("beta", "beta", "g"),
    Column("solver", "solver"),
    Column("alpha_1", "alpha_1", ".10f"),
    Column("alpha_2", "alpha_2", ".10f"),
    Column("off_percent", "error of alpha_2 [%]", "+.2e"),
)


def steady_by_time() -> Section:
    """Gains from 120 s runs that start on the exact orbit, for the fast solvers, each with its default settings."""
    rows: list[dict[str, Cell]] = []
    for omega, beta in POINTS:
        specimen = Specimen(beta=beta)
        exact = predict_gain(specimen, omega, AMPLITUDE).rocking
        if exact is None:
            continue
        place: dict[str, Cell] = {"omega": omega, "beta": beta}
        rows.append(
            place | {"solver": "periodic orbit", "alpha_1": exact.alpha_1, "alpha_2": exact.alpha_2, "off_percent": 0.0}
        )
        for name in (name for name in SOLVERS if name != "dop853"):
            found = steady_gain_by_time(name, specimen, omega, AMPLITUDE)
            off = 100.0 * (found.alpha_2 / exact.alpha_2 - 1.0)
            rows.append(
                place | {"solver": name, "alpha_1": found.alpha_1, "alpha_2": found.alpha_2, "off_percent": off}
            )
    notes = (
        f"Runs of 120 s from a point of the orbit; peaks over the last {LAST_PERIODS} periods. The paper's "
        "procedure places impacts on its time grid; its solution therefore wanders about the orbit, and the result "
        "depends on the window.",
    )
    return Section("steady_by_time", "Gain coefficients by 120 s runs", GAIN_COLUMNS, rows, notes)


YARDSTICK = "taylor", "tolerance 1e-10"
"""The reference row: the engine with its default settings."""

COLUMNS = (
    Column("method", "method"),
    Column("setting", "setting"),
    Column("status", "status"),
    Column("impacts", "impacts", "d"),
    Column("steps", "steps", "d"),
    Column("error", "error of end state", ".1e"),
    Column("peak_error", "error of peaks", ".1e"),
    Column("first_call_ms", "first call [ms]", ".0f"),
    Column("min_ms", "min [ms]", ".2f"),
    Column("median_ms", "median [ms]", ".2f"),
    Column("ratio", "min / taylor's", ".3g"),
)

NOTES = (
    "Errors: greatest deviation of the end state from the reference, in SI units (components reach about 1); errors "
    "of the peaks are relative. The reference is heyoka in 80-bit arithmetic, an independent integrator.",
    "First call: compilation or loading of the compiled code, and a tenth of a second of motion (none for CVODE); it "
    "is excluded from the other times. The methods run in turn. Only rows with an error of the peaks compute peaks; "
    "the others do less work.",
    'scipy and CVODE call the compiled equations; "Python" marks uncompiled equations, the usual practice.',
    "A method with a different number of impacts has missed an impact or counted one twice: its time is meaningless.",
)


def work_precision(quick: bool, budget: float) -> Section:
    """The work-precision table; each method runs for about `budget` [s], at least once and at most 60 times. Ratios use
    the shortest times: on a loaded machine only these are repeatable.
    """
    contenders = methods(quick)
    firsts: dict[str, float] = {}
    runs: dict[str, tuple[Run, int]] = {}
    for method in contenders:
        if method.installed:
            firsts[_key(method)], run = once(method.prepare)
            runs[_key(method)] = run, max(1, min(60, int(budget / method.weight)))
    timings = in_turn(runs)
    yardstick = timings["{} {}".format(*YARDSTICK)].minimum
    rows: list[dict[str, Cell]] = []
    for method in contenders:
        row: dict[str, Cell] = {"method": method.name, "setting": method.setting, "status": NOT_INSTALLED}
        if method.installed:
            timing = timings[_key(method)]
            found: Outcome = timing.result
            row |= {
                "status": "ok" if found.impacts == IMPACTS else "WRONG",
                "impacts": found.impacts,
                "steps": found.steps,
                "error": error_of(found.end),
                "peak_error": None if found.peaks is None else peak_error_of(found.peaks),
                "first_call_ms": 1e3 * firsts[_key(method)],
                "min_ms": 1e3 * timing.minimum,
                "median_ms": 1e3 * timing.median,
                "ratio": timing.minimum / yardstick,
            }
        rows.append(row)
    return Section(
        "work_precision",
        "Work and precision: 120 s of steady rocking, Omega 17 rad/s, beta 0.64, 649 impacts",
        COLUMNS,
        rows,
        NOTES,
        _targets(rows),
    )


def _key(method: Method) -> str:
    return f"{method.name} {method.setting}"


def _targets(rows: list[dict[str, Cell]]) -> list[Target]:
    def of(method: str, setting: str, column: str) -> float | None:
        for row in rows:
            if (row["method"], row["setting"]) == (method, setting):
                value = row.get(column)
                return value if isinstance(value, float) else None
        return None

    def share(method: str, setting: str) -> float | None:
        theirs = of(method, setting, "ratio")
        return None if theirs is None else 1.0 / theirs

    papers, papers_time = of("paper", "step 1 ms", "error"), of("paper", "step 1 ms", "ratio")
    # the most accurate setting of taylor
    fine = min((row for row in rows if row["method"] == "taylor"), key=lambda row: float(row["error"] or 0.0))
    setting = str(fine["setting"])
    fine_error, fine_time = of("taylor", setting, "error"), of("taylor", setting, "ratio")

    def at_equal_error(ours: str, theirs: str) -> float | None:
        """Time of the engine's fastest setting that is at least as accurate as `theirs` at 1e-10, relative to the time
        of `theirs`.
        """
        error, time = of(theirs, "tolerance 1e-10", "error"), of(theirs, "tolerance 1e-10", "ratio")
        pairs = [(row.get("ratio"), row.get("error")) for row in rows if row["method"] == ours]
        times = [
            t for t, e in pairs if error is not None and isinstance(t, float) and isinstance(e, float) and e <= error
        ]
        return _quotient(min(times, default=None), time)

    return [
        Target("error of taylor (1e-10) over 120 s", 1e-12, of(*YARDSTICK, "error"), "SI"),
        Target(
            "time relative to heyoka at equal error, no peaks", 1 / 2, at_equal_error("taylor, no peaks", "heyoka"), "1"
        ),
        Target(
            "time relative to heyoka at equal error, peaks", 1 / 3, at_equal_error("taylor", "heyoka, with peaks"), "1"
        ),
        Target(
            "time with peaks relative to scipy DOP853 (1e-10) without peaks",
            1 / 400,
            share("scipy DOP853", "rtol 1e-10"),
            "1",
            "scipy calls the compiled equations here, which makes it almost twice as fast as with a Python function.",
        ),
        Target(
            "time with peaks relative to scipy DOP853 (1e-10) with equations in Python, without peaks",
            1 / 400,
            share("scipy DOP853, Python", "rtol 1e-10"),
            "1",
        ),
        Target(f"time of taylor ({setting}) over that of paper", 1.0, _quotient(fine_time, papers_time), "1"),
        Target(f"error of taylor ({setting}) over that of paper", 1e-10, _quotient(fine_error, papers), "1"),
    ]


def _quotient(ours: float | None, theirs: float | None) -> float | None:
    return None if ours is None or theirs is None else ours / theirs
