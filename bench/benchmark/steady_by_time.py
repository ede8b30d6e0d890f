"""Gain coefficients by 120 s runs, against the periodic orbit: what a solver's error does to what it is used for."""

from bench.benchmark.section import Cell, Column, Section
from bench.comparators.catalogue import LAST_PERIODS, SOLVERS, steady_gain_by_time
from sim.gain import predict_gain
from sim.specimen import Specimen

POINTS = ((17.5, 0.40), (16.0, 0.97))
"""Omega [rad/s] and beta: point C of the paper, and one where alpha_2 is small."""

AMPLITUDE = 1.01 * 9.81 / 8.0

COLUMNS = (
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
    return Section("steady_by_time", "Gain coefficients by 120 s runs", COLUMNS, rows, notes)
