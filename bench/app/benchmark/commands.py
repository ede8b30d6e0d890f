"""Benchmark of commands whose result a user waits for: elapsed time, processor time and memory of each, in its own
process.
"""

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from bench.app.benchmark.scaling import STARTING
from bench.app.benchmark.section import Cell, Column, Section, Target
from bench.unfinished import temporary_folder
from sim.errors import RockbenchError
from sim.waiting import end

COLUMNS = (
    Column("command", "command"),
    Column("elapsed_s", "elapsed [s]", ".2f"),
    Column("processor_s", "processor time [s]", ".2f"),
    Column("memory_mb", "memory [MB]", ".0f"),
)


@dataclass(frozen=True)
class Waited:
    """A command and the limits of its time and memory.

    line : arguments of the command.
    limit : maximum time [s].
    of : key of the time to which `limit` applies: elapsed or processor time.
    memory : maximum memory [MB]; None for no limit.
    quick : whether the quick benchmark includes the command.
    bound : what limits the time, if it may exceed the limit.
    """

    line: str
    limit: float
    of: Literal["elapsed_s", "processor_s"] = "elapsed_s"
    memory: float | None = None
    quick: bool = False
    bound: str = ""


COMMANDS = (
    Waited("--help", 0.25, "processor_s", quick=True),
    Waited("predict steady", 0.9, "processor_s", quick=True, bound=STARTING),
    Waited("predict seismic", 3.0, quick=True),
    Waited("paper --html paper.html", 40.0),
    Waited(
        "predict map --omega 12:21:1000 --beta 0.1:1.2:1000 --out map.h5",
        40.0,
        memory=1000.0,
        bound="Nearly all of it is the kernel's, on all processors: 80 us of processor time a point.",
    ),
    Waited(
        "run earthquake --out campaign",
        60.0,
        bound="The draws behind the intervals use all processors; planning and the simulated bench use one.",
    ),
)
"""Commands with earthquake records use the seven synthetic ones: `predict seismic` with 40 stiffnesses, the campaign
with three springs.
"""


POLLING = 0.01
"""Time between two readings of the peak memory of a command [s]."""


def commands(quick: bool) -> Section:
    """Run every command once, with a kernel that is already compiled; with `quick`, only the short commands."""
    rows: list[dict[str, Cell]] = []
    targets: list[Target] = []
    for each in COMMANDS:
        row: dict[str, Cell] = {"command": f"rockbench {each.line}"}
        if each.quick or not quick:
            with temporary_folder() as folder:
                row |= _measured(each.line.split(), folder)
            rows.append(row)
        time_of, memory = row.get(each.of), row.get("memory_mb")
        kind = "processor time" if each.of == "processor_s" else "time"
        name = " ".join(each.line.split(" --")[0].split()) or each.line
        measured = time_of if isinstance(time_of, float) else None
        targets.append(Target(f"{kind} of {name}", each.limit, measured, "s", each.bound))
        if each.memory is not None:
            measured = memory if isinstance(memory, float) else None
            targets.append(Target(f"memory of {name}, 1000 x 1000", each.memory, measured, "MB"))
    notes = (
        "Each command runs once in a new process, with the compiled kernel but without cached results. "
        "The targets for elapsed times apply to two processors without other load.",
    )
    return Section("commands", "Commands", COLUMNS, rows, notes, targets)


def _measured(arguments: Sequence[str], folder: Path) -> dict[str, Cell]:
    """Times [s] and peak memory [MB] of a command run in `folder`; None where the system does not report them. Raises
    RockbenchError if the command fails.
    """
    code = f"import sys; from bench.app.cli.process import run; sys.argv[1:] = {list(arguments)!r}; run()"
    environment = os.environ | {"ROCKBENCH_RESULT_CACHE": "off"}
    begin = time.perf_counter()
    with (folder / "messages").open("w+b") as messages:
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", code],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=messages,
        )
        try:
            ended, processor, memory = _ended(process)
        finally:
            end(process, 0.0)
        elapsed = time.perf_counter() - begin
        if ended != 0:
            messages.seek(0)
            last = (messages.read().decode(errors="replace").strip().splitlines() or ["no message"])[-1]
            raise RockbenchError(f"rockbench {' '.join(arguments)} ended with code {ended}: {last}")
    return {"elapsed_s": elapsed, "processor_s": processor, "memory_mb": memory}


def _ended(process: "subprocess.Popen[bytes]") -> tuple[int, float | None, float | None]:
    """Exit code, processor time [s] and peak memory [MB] of a process after its end."""
    if sys.platform == "win32":
        end(process, float("inf"))
        return process.returncode, None, None
    peak = None
    while (found := os.wait4(process.pid, os.WNOHANG))[0] == 0:
        peak = _high_water(process.pid) or peak
        time.sleep(POLLING)
    _, status, usage = found
    process.returncode = os.waitstatus_to_exitcode(status)
    per_mb = 2**20 if sys.platform == "darwin" else 2**10
    return process.returncode, usage.ru_utime + usage.ru_stime, peak or usage.ru_maxrss / per_mb


def _high_water(process: int) -> float | None:
    """Peak memory [MB] of a running process so far; None where the system does not state it.

    On Linux, the peak in the usage of an ended process is at least that of its parent.
    """
    with suppress(OSError, ValueError, IndexError):
        status = Path(f"/proc/{process}/status").read_text(encoding="ascii", errors="replace")
        return int(status.split("VmHWM:", 1)[1].split(maxsplit=1)[0]) / 2**10
    return None
