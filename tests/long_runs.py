"""Growth of memory, threads, open files and time over many runs in one process, and of one long recording.

    python -m tests.long_runs [--runs 200] [--hours 24]

The hours are of bench time, recorded as fast as the disk takes them, with one live reader. Prints a line for every
tenth of each, and the growth from the second tenth to the last.
"""

import argparse
import contextlib
import io
import os
import sys
import tempfile
import threading
import time
from pathlib import Path

from bench.app.cli.main import main as rockbench
from bench.datafile.inspection import verify
from bench.datafile.reader import open_datafile
from tests.bench.datafile.living import BLOCK, RATE, begin, hand_over

POINT = ("run", "harmonic", "--omega", "16", "--beta", "0.4", "--json")


def resident() -> float:
    """Resident memory of this process [MB]; Linux only."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def state() -> tuple[float, int, int]:
    """Resident memory [MB], number of threads, number of open files."""
    return resident(), threading.active_count(), len(os.listdir("/proc/self/fd"))


def repeat_runs(folder: Path, count: int) -> None:
    """Carry out the same run `count` times in this process."""
    print(f"{'run':>6} {'time [s]':>9} {'memory [MB]':>12} {'threads':>8} {'files':>6}")
    found, every = list[tuple[float, int, int]](), max(count // 10, 1)
    for number in range(1, count + 1):
        begun = time.monotonic()
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            code = rockbench([*POINT, "--out", str(folder / f"run-{number}")])
        assert code == 0, f"run {number} ended with code {code}"
        if number % every == 0:
            found.append(state())
            memory, threads, files = found[-1]
            print(f"{number:6} {time.monotonic() - begun:9.2f} {memory:12.1f} {threads:8} {files:6}", flush=True)
    _growth(found)


def record_hours(folder: Path, hours: float) -> None:
    """Record `hours` of bench time, follow the file with a reader, and verify it."""
    path, blocks = folder / "long.h5", round(hours * 3600.0 * RATE / BLOCK)
    print(f"{'hours':>6} {'time [s]':>9} {'memory [MB]':>12} {'file [MB]':>10} {'slowest sync [ms]':>18}")
    recorder, found, slowest, begun = begin(path), list[tuple[float, int, int]](), 0.0, time.monotonic()
    every = max(blocks // 10, 1)
    with open_datafile(path) as reader:
        for k in range(blocks):
            hand_over(recorder, k)
            if k % 500 == 499:
                before = time.monotonic()
                recorder.sync()
                slowest = max(slowest, time.monotonic() - before)
                reader.refresh()
            if k % every == every - 1:
                found.append(state())
                size, spent = path.stat().st_size / 1e6, time.monotonic() - begun
                done = (k + 1) * BLOCK / RATE / 3600.0
                print(f"{done:6.2f} {spent:9.1f} {found[-1][0]:12.1f} {size:10.1f} {1e3 * slowest:18.1f}", flush=True)
                slowest = 0.0
    recorder.close("completed")
    problems = verify(path).problems
    print(f"verified: {list(problems) or 'intact'}, {resident():.1f} MB")
    _growth(found)


def _growth(found: list[tuple[float, int, int]]) -> None:
    first, last = found[min(1, len(found) - 1)], found[-1]
    changes = [after - before for before, after in zip(first, last, strict=True)]
    print(f"growth: {changes[0]:+.1f} MB, {changes[1]:+} threads, {changes[2]:+} open files", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--hours", type=float, default=24.0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if asked.hours:
            record_hours(Path(folder), asked.hours)
        if asked.runs:
            repeat_runs(Path(folder), asked.runs)
    return 0


if __name__ == "__main__":
    sys.exit(main())
