"""Many trajectories of the standard case on one core, against heyoka's batch mode."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from math import pi

import numpy as np
from numpy.typing import NDArray

from bench.app.benchmark.section import Cell, Column, Section, Target, in_turn
from bench.app.benchmark.work_precision import NOT_INSTALLED
from bench.comparators.case import IMPACTS, SPECIMEN, START, drive, error_of
from sim.ensemble import side_by_side
from sim.rocking import Drive, RockingRun

COLUMNS = (
    Column("method", "method"),
    Column("setting", "setting"),
    Column("status", "status"),
    Column("error", "end-state error", ".1e"),
    Column("min_ms", "min [ms] per trajectory", ".2f"),
    Column("per_second", "trajectories per second and core", ".0f"),
)

OURS, THEIRS = "taylor", "heyoka, batch of 4"

MEMBERS = 8
"""Number of trajectories in a run of the engine: two for each of the kernel's parallel lanes, so that lanes are
refilled.
"""

TOLERANCES = (1e-9, 1e-10, 1e-11, 1e-12, 1e-13)

PEER_TOLERANCES = (1e-10, 1e-12, 1e-15)


@dataclass(frozen=True)
class _Many:
    """A method at one setting. `run` computes `count` trajectories; it returns the end state, shape (6,), and the
    number of impacts of one of them.
    """

    method: str
    tolerance: float
    count: int
    run: Callable[[], tuple[NDArray[np.float64], int]]


def members(repetitions: int) -> Section:
    """Time per trajectory on one core and error of the end state; no method computes peaks."""
    contenders = [_ours(tolerance) for tolerance in TOLERANCES]
    installed = find_spec("heyoka") is not None
    if installed:
        contenders += [_theirs(tolerance) for tolerance in PEER_TOLERANCES]
    for each in contenders:
        each.run()
    timings = in_turn({f"{each.method} {each.tolerance:g}": (each.run, repetitions) for each in contenders})
    rows: list[dict[str, Cell]] = []
    for each in contenders:
        timing = timings[f"{each.method} {each.tolerance:g}"]
        end, impacts = timing.result
        time = timing.minimum / each.count
        rows.append(
            {
                "method": each.method,
                "setting": f"tolerance {each.tolerance:g}",
                "status": "ok" if impacts == IMPACTS else "WRONG",
                "error": error_of(end),
                "min_ms": 1e3 * time,
                "per_second": 1.0 / time,
            }
        )
    if not installed:
        rows.append({"method": THEIRS, "setting": "", "status": NOT_INSTALLED})
    notes = (
        "Identical members, one thread. Errors of 1e-13 and below are rounding errors; the target therefore omits "
        "settings of heyoka with a smaller error than any setting of taylor.",
    )
    name = "time per trajectory relative to heyoka's batch mode at equal error"
    targets = (Target(name, 1.0, _at_equal_error(rows), "1"),)
    return Section("members", "Many trajectories of 120 s on one core", COLUMNS, rows, notes, targets)


def _at_equal_error(rows: list[dict[str, Cell]]) -> float | None:
    """For each setting of heyoka, the time of the engine's fastest setting that is at least as accurate is divided by
    heyoka's time. Returns the greatest of these ratios; None if no settings can be compared.
    """
    found = {name: [row for row in rows if row["method"] == name and row["status"] == "ok"] for name in (OURS, THEIRS)}
    ratios: list[float] = []
    for peer in found[THEIRS]:
        times = [_number(row, "min_ms") for row in found[OURS] if _number(row, "error") <= _number(peer, "error")]
        if times:
            ratios.append(min(times) / _number(peer, "min_ms"))
    return max(ratios, default=None)


def _number(row: dict[str, Cell], name: str) -> float:
    value = row[name]
    assert isinstance(value, float)
    return value


def _ours(tolerance: float) -> _Many:
    runs = [RockingRun(SPECIMEN, Drive(drive()), START, None, None, tolerance, 0.5 * pi) for _ in range(MEMBERS)]

    def run() -> tuple[NDArray[np.float64], int]:
        motion = side_by_side(runs)[-1]
        return motion.end.as_array(), motion.impacts

    return _Many(OURS, tolerance, MEMBERS, run)


def _theirs(tolerance: float) -> _Many:
    from bench.comparators.heyoka_batch import BATCH, HeyokaBatch

    return _Many(THEIRS, tolerance, BATCH, HeyokaBatch(tolerance).run)
