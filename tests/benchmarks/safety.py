"""Does the table do what it is told, and is it stopped when it does not: tracking, reaction, faults, in one report.

    python -m tests.benchmarks.safety              some minutes and the time of `tests.benchmarks.faults`
    python -m tests.benchmarks.safety --quick      without the fault matrix: every fault once on the emulated bench

Tracking: the table's fundamental and harmonics against what was asked, at points of the harmonic protocol, as its
accelerometer measured them. Reaction: from the first sample beyond a limit to the first changed sample of the output,
on the emulated bench told by the output stage and the true motion. Faults: as `tests.benchmarks.faults` counts them.
Ends with exit status 1 if a point was not held, a reaction took longer than promised, or a fault was lost or broke a
rule.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

from bench.config.model import BenchConfiguration
from bench.config.template import as_toml
from tests.benchmarks.faults import BLOCKS, LEADS, matrix, reaction_table, report
from tests.dry_run import SHORT, hurried
from tests.emulated import emulated
from tests.faults.reaction import RATE, Reaction, react

POINTS = ("--omega", "15", "20", "--beta", "0.25")
"""What is tracked on the simulated bench; on the emulated one, in real time, the short point of `tests.dry_run`."""
LEAST_LEAD = 0.1
"""The shortest lead that a machine which also plays the laboratory can keep [s]."""
HELD = 0.01
"""Relative error of the amplitude with which a point counts as held; the protocol itself asks for more by default."""
PHASES = np.linspace(0.0, 1.0, 6, endpoint=False)


@contextmanager
def _simulated() -> Generator[BenchConfiguration]:
    yield BenchConfiguration()


def tracked(bench: str) -> list[dict[str, Any]]:
    """The points of a harmonic campaign on a bench, as `rockbench run harmonic --json` tells them."""
    opened, asked = {"simulated": (_simulated, POINTS), "emulated": (emulated, SHORT)}[bench]
    with opened() as configuration, TemporaryDirectory() as folder:
        file = Path(folder) / "bench.toml"
        file.write_text(as_toml(hurried(configuration) if bench == "emulated" else configuration), encoding="utf-8")
        command = [sys.executable, "-m", "bench", "run", "harmonic", "--config", str(file), "--yes", "--json"]
        command += ["--out", f"{folder}/run", *asked]
        done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        print(f"no tracking on the {bench} bench: {done.stderr.splitlines()[-1]}")
        return []
    points: list[dict[str, Any]] = json.loads(done.stdout)["points"]
    return points


def tracking_table(found: dict[str, list[dict[str, Any]]]) -> str:
    """A line for each point: errors of amplitude and phase of the table, its distortion, corrections it took."""
    heads = ["omega [rad/s]", "beta", "amplitude [%]", "phase [mrad]", "distortion [%]", "corrections"]
    lines = [f"{'':12}" + "".join(f"{head:>16}" for head in heads)]
    for bench, points in found.items():
        for point in points:
            errors = (1e2 * point["amplitude_error"], 1e3 * point["phase_error_rad"], 1e2 * point["table_harmonics"])
            cells = [f"{point['omega_rad_s']:g}", f"{point['beta']:g}", *(f"{error:.3f}" for error in errors)]
            cells.append(str(point["table_updates"]))
            lines.append(f"{bench:12}" + "".join(f"{cell:>16}" for cell in cells))
    return "\n".join(lines)


def reactions(react_with: Callable[[int, int, float], Reaction], least: float = 0.0) -> list[list[Reaction]]:
    """For each block length and lead of at least `least` [s], the reactions at some phases."""
    sizes = [(round(block * RATE), round(lead * RATE)) for block in BLOCKS for lead in LEADS if lead >= least]
    return [[react_with(block, lead, float(phase)) for phase in PHASES] for block, lead in sizes]


def once_each() -> bool:
    """Every fault once on the emulated bench; whether all was as it should be."""
    from tests.faults.emulated.pool import Campaigns, few

    with Campaigns(few()) as begun:
        return report("emulated", [begun.verdict(case) for case in few()])


def main() -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    begin = perf_counter()
    benches = ("simulated", "emulated") if os.name == "posix" else ("simulated",)
    points = {bench: tracked(bench) for bench in benches}
    print(f"The table against what was asked:\n{tracking_table(points)}", flush=True)
    times = {"simulated": reactions(react)}
    if "emulated" in benches:
        from tests.faults.emulated.reaction import patient

        times["emulated"] = reactions(patient, LEAST_LEAD)
    for bench, found in times.items():
        print(f"Reaction on the {bench} bench, at {RATE:g} samples/s:\n{reaction_table(found)}", flush=True)
    good = [once_each()] if options.quick and "emulated" in benches else []
    good += [] if options.quick else [matrix(bench, "") for bench in benches]
    good += [bool(found) for found in points.values()]
    good += [abs(point["amplitude_error"]) <= HELD for found in points.values() for point in found]
    good += [one.measured <= one.promised for found in times.values() for group in found for one in group]
    print(f"{perf_counter() - begin:.0f} s")
    return int(not all(good))


if __name__ == "__main__":
    sys.exit(main())
