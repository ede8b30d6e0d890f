"""Cost of tasks: growth with duration, points and members; start-up of a command; streaming of blocks."""

import os
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.app.benchmark.records import ROCKING, ROCKING_OMEGA, ROCKING_PHASE, ROCKING_START
from bench.app.benchmark.section import Cell, Column, Section, Target, in_turn, once, timed
from bench.comparators.case import AMPLITUDE, OMEGA, PHASE, SPECIMEN, START
from bench.comparators.catalogue import solve
from bench.unfinished import temporary_folder
from sim.ensemble import simulate_many
from sim.errors import RockbenchError
from sim.excitation import SampledRecord, SineProgram, Sweep
from sim.maps import gain_map
from sim.rocking import simulate
from sim.specimen import Specimen
from sim.streaming import Stream

SCALING_COLUMNS = (
    Column("what", "growing quantity"),
    Column("size", "size", "d"),
    Column("unit", "unit"),
    Column("min_ms", "min [ms]", ".3g"),
    Column("per_unit_us", "per unit [us]", ".3g"),
    Column("memory_kb", "memory [kB]", ".1f"),
    Column("exponent", "exponent", ".2f"),
)


def scaling(repetitions: int) -> Section:
    """Times at doubling sizes, with the exponent of the fitted power law: 1 is linear."""
    rows = [
        *_growth("duration", "s", (60, 120, 240, 480), _run_for, repetitions),
        *_growth("points", "points", (400, 800, 1600, 3200), _map_of, max(1, repetitions // 4)),
        *_growth("members", "runs", (50, 100, 200, 400), _scatter_of, max(1, repetitions // 4)),
    ]
    notes = (
        "Exponent: least-squares slope of log(time) against log(size); a constant part reduces it.",
        "Memory: peak allocation by Python and numpy during a run; the workspace of the compiled kernel "
        "depends only on the order of the series.",
    )
    return Section("scaling", "Growth of the cost", SCALING_COLUMNS, rows, notes)


def _growth(
    what: str, unit: str, sizes: Sequence[int], make: Callable[[int], Callable[[], object]], repetitions: int
) -> list[dict[str, Cell]]:
    runs = {str(size): (make(size), repetitions) for size in sizes}
    for run, _ in runs.values():
        run()
    timings = in_turn(runs)
    times = [timings[str(size)].minimum for size in sizes]
    exponent = float(np.polyfit(np.log(sizes), np.log(times), 1)[0])
    rows: list[dict[str, Cell]] = []
    for size, elapsed in zip(sizes, times, strict=True):
        rows.append(
            {
                "what": what,
                "size": size,
                "unit": unit,
                "min_ms": 1e3 * elapsed,
                "per_unit_us": 1e6 * elapsed / size,
                "memory_kb": _memory(runs[str(size)][0]) / 1024.0,
                "exponent": exponent if size == sizes[-1] else None,
            }
        )
    return rows


def _memory(run: Callable[[], object]) -> int:
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _run_for(duration: int) -> Callable[[], object]:
    excitation = SineProgram([Sweep.dwell(float(duration), AMPLITUDE, OMEGA)], phase=PHASE)
    return lambda: simulate(SPECIMEN, excitation, state=START)


def _map_of(points: int) -> Callable[[], object]:
    betas, omegas = np.linspace(0.3, 0.5, 20), np.linspace(15.0, 17.0, points // 20)
    return lambda: gain_map(Specimen(), betas, omegas, AMPLITUDE)


def _scatter_of(members: int) -> Callable[[], object]:
    specimens = [SPECIMEN.coupled(float(beta)) for beta in np.linspace(0.63, 0.65, members)]
    excitation = SineProgram([Sweep.dwell(20.0, AMPLITUDE, OMEGA)], phase=PHASE)
    return lambda: simulate_many(specimens, excitation, states=START)


COMMAND = ("predict", "steady", "--omega", "16", "--beta", "0.4", "--json")

STARTING = "Importing the libraries (numpy, numba, pydantic, h5py) and loading the compiled functions take most of it."
"""What limits the start of a short command."""

STARTUP_COLUMNS = (
    Column("start", "start"),
    Column("runs", "runs", "d"),
    Column("min_s", "min [s]", ".2f"),
    Column("median_s", "median [s]", ".2f"),
    Column("processor_s", "processor time per run [s]", ".2f"),
)


def startup(cold_runs: int, warm_runs: int) -> Section:
    """Time cold starts, each with an empty compiler cache, then warm starts with a filled cache."""
    with temporary_folder() as folder:
        caches = [folder / str(number) for number in range(cold_runs)]
        colds = sorted((_run(cache) for cache in caches), key=lambda start: start[0])
        starts = sorted((_run(caches[0]) for _ in range(warm_runs)), key=lambda start: start[0])
    (cold, cold_work), (warm, warm_work) = (each[len(each) // 2] for each in (colds, starts))
    # other load makes a start longer, never shorter
    shortest = colds[0][0] - starts[0][0]
    compiling = None if cold_work is None or warm_work is None else cold_work - warm_work
    rows: list[dict[str, Cell]] = [
        {
            "start": "cold: everything compiled",
            "runs": cold_runs,
            "min_s": colds[0][0],
            "median_s": cold,
            "processor_s": cold_work,
        },
        {"start": "warm", "runs": warm_runs, "min_s": starts[0][0], "median_s": warm, "processor_s": warm_work},
        {"start": "difference: compilation", "min_s": shortest, "median_s": cold - warm, "processor_s": compiling},
    ]
    notes = (
        "On a machine under other load, processor time is more meaningful than elapsed time. A helper process compiles "
        "a part of the kernel at the same time.",
        "Two thirds of the compilation time are spent on the function that advances many members, which is compiled "
        "last. Compilation is mostly the compiler's analysis in Python, not the optimisation of machine code.",
    )
    targets = (
        Target(
            "compilation for predict steady",
            4.0,
            shortest,
            "s",
            "The function that advances many members takes two thirds of it, nearly all for the compiler's analysis in "
            "Python, which the second processor cannot share.",
        ),
        Target("warm start of predict steady, processor time", 0.9, warm_work, "s", STARTING),
    )
    return Section("startup", f"Start of `rockbench {' '.join(COMMAND)}`", STARTUP_COLUMNS, rows, notes, targets)


def _run(cache: Path) -> tuple[float, float | None]:
    """Elapsed and processor time [s]; the latter is None where the system does not report it. Raises RockbenchError if
    the command fails.
    """
    before = os.times()
    elapsed, done = once(
        lambda: subprocess.run(
            [sys.executable, "-P", "-m", "bench", *COMMAND],
            env=os.environ | {"NUMBA_CACHE_DIR": str(cache)},
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


RATE = 20_000
"""Output states per second."""

BLOCK = 0.05
"""Duration of a block [s]."""

CHECKED = 0.5
"""Duration of the comparison with another integrator [s]."""

STREAMING_COLUMNS = (
    Column("drive_hz", "updates of the drive [1/s]", "d"),
    Column("error", "error, first 0.5 s", ".1e"),
    Column("bitwise", "identical for other block lengths", "s"),
    Column("min_ms", "min [ms]", ".4g"),
    Column("median_ms", "median [ms]", ".4g"),
    Column("times_real_time", "times real time", ".0f"),
)


def streaming(duration: float, repetitions: int, drives: Sequence[int] = (1_000, 2_000, 20_000)) -> Section:
    """Time the streaming of `duration` [s] of steady rocking on one core, at several update rates of the drive."""
    rows = [_row(rate, duration, repetitions) for rate in drives]
    fastest = rows[0]["times_real_time"]
    notes = (
        f"{RATE} states per second, blocks of {1e3 * BLOCK:g} ms, with peaks, block rocking throughout. The target "
        "applies to the first row. Between two updates of the drive, the motion is smooth.",
        "Error of the end state in SI units against dop853 at 1e-13.",
    )
    share = 200.0 / fastest if isinstance(fastest, float) else None
    targets = (Target("streaming: 200 divided by the speed in multiples of real time", 1.0, share, "1"),)
    return Section("streaming", "Streaming", STREAMING_COLUMNS, rows, notes, targets)


def _row(rate: int, duration: float, repetitions: int) -> dict[str, Cell]:
    t = np.arange(round(duration * rate) + 1) / rate
    wave = 1.01 * ROCKING.uplift_acceleration * np.sin(ROCKING_OMEGA * t + ROCKING_PHASE)
    timing = timed(lambda: _stream(wave, rate, round(BLOCK * rate)), repetitions)
    short = wave[: round(CHECKED * rate) + 1]
    truth = solve("dop853", ROCKING, SampledRecord(short, 1.0 / rate), state=ROCKING_START, tolerance=1e-13)
    found = _stream(short, rate, round(BLOCK * rate))[-1]
    same = bool((_stream(wave, rate, round(BLOCK * rate)) == _stream(wave, rate, 137)).all())
    return {
        "drive_hz": rate,
        "error": float(np.abs(found - truth.end.as_array()).max()),
        "bitwise": same,
        "min_ms": 1e3 * timing.minimum,
        "median_ms": 1e3 * timing.median,
        "times_real_time": duration / timing.minimum,
    }


def _stream(wave: NDArray[np.float64], rate: int, block: int) -> NDArray[np.float64]:
    """Output states, shape (n, 6), for the drive `wave` [m/s2], sampled at `rate` [1/s] and fed in blocks of `block`
    samples.
    """
    stream = Stream(ROCKING, 1.0 / rate, state=ROCKING_START, divisions=RATE // rate)
    return np.concatenate([stream.feed(wave[k : k + block]) for k in range(0, wave.size, block)])
