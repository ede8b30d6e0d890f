"""Error of every method against its run time on the standard case, and error of the gains that long runs give."""

from bench.benchmark.methods import NOT_INSTALLED, Method, Outcome, Run, methods
from bench.benchmark.section import Cell, Column, Section, Target
from bench.benchmark.timing import in_turn, once
from bench.comparators.case import IMPACTS, error_of, peak_error_of
from bench.comparators.catalogue import LAST_PERIODS, SOLVERS, steady_gain_by_time
from sim.gain import predict_gain
from sim.specimen import Specimen

POINTS = ((17.5, 0.40), (16.0, 0.97))
"""Omega [rad/s] and beta: point C of the paper, and one where alpha_2 is small."""

AMPLITUDE = 1.01 * 9.81 / 8.0

GAIN_COLUMNS = (
    Column("omega", "Omega [rad/s]", "g"),
    Column("beta", "beta", "g"),
    Column("solver", "solver"),
    Column("alpha_1", "alpha_1", ".10f"),
    Column("alpha_2", "alpha_2", ".10f"),
    Column("off_percent", "alpha_2 off by [%]", "+.2e"),
)


def steady_by_time() -> Section:
    """Every solver that takes milliseconds for a run, at its own accuracy, from the exact orbit."""
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
        f"Runs of 120 s from a point of the orbit, peaks of the last {LAST_PERIODS} periods. The impacts of the "
        "paper's procedure fall on its grid: it wanders about the orbit, and the result changes with the window.",
    )
    return Section("steady_by_time", "Gain coefficients by 120 s runs", GAIN_COLUMNS, rows, notes)


YARDSTICK = "taylor", "tolerance 1e-10"
"""The row that the others are compared with: the engine as it is used."""

COLUMNS = (
    Column("method", "method"),
    Column("setting", "setting"),
    Column("status", "status"),
    Column("impacts", "impacts", "d"),
    Column("steps", "steps", "d"),
    Column("error", "error of end", ".1e"),
    Column("peak_error", "error of peaks", ".1e"),
    Column("first_call_ms", "first call [ms]", ".0f"),
    Column("min_ms", "min [ms]", ".2f"),
    Column("median_ms", "median [ms]", ".2f"),
    Column("ratio", "min / taylor's", ".3g"),
)

NOTES = (
    "Errors: greatest deviation of the end state from the reference, in SI units (components reach about 1); of the "
    "peaks relative. The reference is heyoka's in 80-bit arithmetic, never ours.",
    "First call: compiling or loading what is compiled, and a tenth of a second of motion (CVODE: none). Times without "
    "it; the methods run in turn. Only the rows with an error of the peaks found peaks; the others did less.",
    'scipy and CVODE are given the compiled equations, "Python" the same ones uncompiled, as they are mostly used.',
    "A method that counts another number of impacts has missed or doubled one: its time means nothing.",
)


def work_precision(quick: bool, budget: float) -> Section:
    """The table; each method runs for about `budget` [s], at least once and at most 60 times.

    Ratios are of the shortest times: on a machine that does other things too, only these repeat.
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
    # the most accurate setting that is asked for here
    fine = min((row for row in rows if row["method"] == "taylor"), key=lambda row: float(row["error"] or 0.0))
    setting = str(fine["setting"])
    fine_error, fine_time = of("taylor", setting, "error"), of("taylor", setting, "ratio")
    plain, heyokas = of("taylor, no peaks", "tolerance 1e-10", "ratio"), of("heyoka", "tolerance 1e-15", "ratio")
    return [
        Target("error of taylor (1e-10) over 120 s", 1e-12, of(*YARDSTICK, "error"), "SI"),
        Target("time with peaks over heyoka's (1e-15) without", 1 / 3, share("heyoka", "tolerance 1e-15"), "1"),
        Target("time without peaks over heyoka's (1e-15) without", 1 / 3, _quotient(plain, heyokas), "1"),
        Target(
            "time with peaks over heyoka's (1e-15) with", 1 / 3, share("heyoka, with peaks", "tolerance 1e-15"), "1"
        ),
        Target(
            "time with peaks over scipy DOP853's (1e-10) without", 1 / 400, share("scipy DOP853", "rtol 1e-10"), "1"
        ),
        Target("the same, equations in Python", 1 / 400, share("scipy DOP853, Python", "rtol 1e-10"), "1"),
        Target(f"time of taylor ({setting}) over paper's", 1.0, _quotient(fine_time, papers_time), "1"),
        Target(f"error of taylor ({setting}) over paper's", 1e-10, _quotient(fine_error, papers), "1"),
    ]


def _quotient(ours: float | None, theirs: float | None) -> float | None:
    return None if ours is None or theirs is None else ours / theirs
