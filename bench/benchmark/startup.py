"""What a person waits for at the first use and at every later one: a whole command in a process of its own."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from bench.benchmark.section import Cell, Column, Section, Target
from bench.benchmark.timing import once
from bench.unfinished import unfinished
from sim.errors import RockbenchError

COMMAND = ("predict", "steady", "--omega", "16", "--beta", "0.4", "--json")

COLUMNS = (
    Column("start", "start"),
    Column("runs", "runs", "d"),
    Column("min_s", "min [s]", ".2f"),
    Column("median_s", "median [s]", ".2f"),
    Column("processor_s", "processor time of one [s]", ".2f"),
)


def startup(warm_runs: int) -> Section:
    """A cold start with an empty compiler cache, then warm ones with the cache that it left."""
    with tempfile.TemporaryDirectory() as cache, unfinished(Path(cache)):
        cold, cold_work = _run(cache)
        starts = sorted((_run(cache) for _ in range(warm_runs)), key=lambda start: start[0])
    warm, warm_work = starts[len(starts) // 2]
    compiling = None if cold_work is None or warm_work is None else cold_work - warm_work
    rows: list[dict[str, Cell]] = [
        {"start": "cold: everything compiled", "runs": 1, "min_s": cold, "median_s": cold, "processor_s": cold_work},
        {"start": "warm", "runs": warm_runs, "min_s": starts[0][0], "median_s": warm, "processor_s": warm_work},
        {"start": "difference: compilation", "runs": 1, "median_s": cold - warm, "processor_s": compiling},
    ]
    notes = ("On a machine that does other things too, the processor time says more than the clock.",)
    targets = (
        Target("compilation for predict steady", 12.0, cold - warm, "s"),
        Target("warm start of predict steady", 4.0, warm, "s"),
    )
    return Section("startup", f"Start of `rockbench {' '.join(COMMAND)}`", COLUMNS, rows, notes, targets)


def _run(cache: str) -> tuple[float, float | None]:
    """Time by the clock and of the processor [s]; the latter is None where the system does not tell.

    Raises RockbenchError when the command does not succeed.
    """
    code = f"import sys; from bench.cli.main import main; sys.exit(main({list(COMMAND)!r}))"
    before = os.times()
    elapsed, done = once(
        lambda: subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | {"NUMBA_CACHE_DIR": cache},
            capture_output=True,
            text=True,
            check=False,
        )
    )
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise RockbenchError(f"rockbench {' '.join(COMMAND)} ended with code {done.returncode}: {last}")
    after = os.times()
    work = after.children_user + after.children_system - before.children_user - before.children_system
    return elapsed, work or None
