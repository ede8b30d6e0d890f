"""How cost and memory grow with the duration, the points of a map and the members of a scatter."""

import tracemalloc
from collections.abc import Callable, Sequence

import numpy as np

from bench.benchmark.section import Cell, Column, Section
from bench.benchmark.timing import in_turn
from bench.comparators.case import AMPLITUDE, OMEGA, PHASE, SPECIMEN, START
from sim.excitation import SineProgram, Sweep
from sim.maps import gain_map
from sim.rocking import simulate, simulate_many
from sim.specimen import Specimen

COLUMNS = (
    Column("what", "what grows"),
    Column("size", "size", "d"),
    Column("unit", "unit"),
    Column("min_ms", "min [ms]", ".3g"),
    Column("per_unit_us", "per unit [us]", ".3g"),
    Column("memory_kb", "memory [kB]", ".1f"),
    Column("exponent", "exponent", ".2f"),
)


def scaling(repetitions: int) -> Section:
    """Times at sizes that double, with the exponent of a power law through them: 1 is linear."""
    rows = [
        *_growth("duration", "s", (60, 120, 240, 480), _run_for, repetitions),
        *_growth("points", "points", (400, 800, 1600, 3200), _map_of, max(1, repetitions // 4)),
        *_growth("members", "runs", (50, 100, 200, 400), _scatter_of, max(1, repetitions // 4)),
    ]
    notes = (
        "Exponent: slope of log(time) over log(size), least squares; a fixed part makes it smaller than 1.",
        "Memory: greatest allocation by Python and numpy during a run; the working space inside the compiled kernel "
        "depends on the order of the series only.",
    )
    return Section("scaling", "Growth of the cost", COLUMNS, rows, notes)


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
