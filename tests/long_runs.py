"""Growth of memory, threads, open files and time over many runs, and over runs of many hours.

    python -m tests.long_runs [--hours 24] [--runs 200] [--processes 200] [--campaign 24] [--emulated 2]

--hours      one file, recorded as fast as the disk takes it, with a live reader; hours of bench time
--runs       the same run, repeated in one process
--processes  the same run in a process of its own each, two at a time, all with results in one folder
--campaign   a harmonic campaign on the virtual bench; hours of bench time. Its file is then verified, replayed and
             exported
--emulated   a harmonic campaign on the emulated laboratory; hours of real time, then Ctrl-C. Another program that uses
             the processors makes it late: on Linux start it with `chrt -r 5`

Only what is named is carried out; without arguments, --hours and --runs with the numbers above. Prints a line for every
tenth of each, and the growth from the second tenth to the last. Linux only.
"""

import argparse
import contextlib
import io
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import psutil

from bench.app.cli.main import main as rockbench
from bench.config.template import as_toml
from bench.datafile.inspection import verify
from bench.datafile.reader import open_datafile
from tests.bench.datafile.living import BLOCK, RATE, begin, hand_over
from tests.emulated import emulated

POINT = ("run", "harmonic", "--omega", "16", "--beta", "0.4", "--json")
LONG_POINTS = ("run", "harmonic", "--measured-cycles", "1000", "--yes", "--json")
PROGRAM = (sys.executable, "-m", "bench")


def state(process: psutil.Process) -> tuple[float, int, int]:
    """Resident memory [MB], number of threads, number of open files of a process."""
    return process.memory_info().rss / 1e6, process.num_threads(), process.num_fds()


def growth(found: Sequence[tuple[float, int, int]]) -> None:
    """Print how the states of a process changed from the second tenth to the last."""
    first, last = found[min(1, len(found) - 1)], found[-1]
    changes = [after - before for before, after in zip(first, last, strict=True)]
    print(f"growth: {changes[0]:+.1f} MB, {changes[1]:+} threads, {changes[2]:+} open files", flush=True)


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
            found.append(state(psutil.Process()))
            memory, threads, files = found[-1]
            print(f"{number:6} {time.monotonic() - begun:9.2f} {memory:12.1f} {threads:8} {files:6}", flush=True)
    growth(found)


def start_processes(folder: Path, count: int) -> None:
    """Carry out the same run in `count` processes, two at a time, which choose the names of their folders."""

    def run(_number: int) -> float:
        begun = time.monotonic()
        done = subprocess.run([*PROGRAM, *POINT], cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return time.monotonic() - begun

    # other parts leave files in the folder as well
    folder = folder / "processes"
    folder.mkdir()
    with ThreadPoolExecutor(2) as pool:
        times = list(pool.map(run, range(count)))
    files = sorted(folder.rglob("campaign.h5"))
    assert len(files) == count, f"{len(files)} files of {count} processes"
    tenth = max(count // 10, 1)
    early, late = (sum(part) / len(part) for part in (times[:tenth], times[-tenth:]))
    print(f"{count} processes: {early:.2f} s each of the first tenth, {late:.2f} s of the last", flush=True)
    problems = [f"{path}: {problem}" for path in files for problem in verify(path).problems]
    print(f"{len(files)} files verified: {problems or 'intact'}", flush=True)


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
                found.append(state(psutil.Process()))
                size, spent = path.stat().st_size / 1e6, time.monotonic() - begun
                done = (k + 1) * BLOCK / RATE / 3600.0
                print(f"{done:6.2f} {spent:9.1f} {found[-1][0]:12.1f} {size:10.1f} {1e3 * slowest:18.1f}", flush=True)
                slowest = 0.0
    recorder.close("completed")
    problems = verify(path).problems
    print(f"verified: {list(problems) or 'intact'}, {state(psutil.Process())[0]:.1f} MB")
    growth(found)


def watched(command: Sequence[str], path: Path, hours: float) -> int:
    """Exit code of a run that is ended by Ctrl-C after `hours` of bench time; prints its state at every tenth."""
    print(f"{'hours':>6} {'time [s]':>9} {'memory [MB]':>12} {'threads':>8} {'files':>6} {'file [MB]':>10}")
    found, begun, due = list[tuple[float, int, int]](), time.monotonic(), 0.1 * hours
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as run:
        while run.poll() is None and due <= hours + 1e-9:
            # seldom, because opening a growing file costs the processor time of half a second of a run
            time.sleep(max(1.0, 3.6 * hours))
            with contextlib.suppress(Exception), open_datafile(path) as record:
                done = record.rows / record.sample_rate / 3600.0
                if done < due:
                    continue
                due += 0.1 * hours
                found.append(state(psutil.Process(run.pid)))
                size, spent = path.stat().st_size / 1e6, time.monotonic() - begun
                memory, threads, files = found[-1]
                print(f"{done:6.2f} {spent:9.1f} {memory:12.1f} {threads:8} {files:6} {size:10.1f}", flush=True)
        if run.poll() is None:
            run.send_signal(signal.SIGINT)
    growth(found)
    return run.returncode


def used(*arguments: str) -> None:
    """Carry out a command of the program, and print its time and its greatest memory."""
    begun = time.monotonic()
    run = subprocess.Popen([*PROGRAM, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(run.pid, 0)
    run.returncode = os.waitstatus_to_exitcode(status)
    told = f"exit code {run.returncode}, {time.monotonic() - begun:.1f} s, at most {usage.ru_maxrss / 1e3:.0f} MB"
    print(f"{' '.join(arguments[:2])}: {told}", flush=True)


def campaign(folder: Path, hours: float) -> None:
    """A campaign of `hours` on the virtual bench, then what a person does with its file."""
    # about 2000 s for each frequency: 1000 cycles, of the bare frame and with three springs
    command = [*PROGRAM, *LONG_POINTS, "--omega", f"10:20:{max(2, round(2.1 * hours))}", "--out", str(folder / "day")]
    path = folder / "day" / "campaign.h5"
    print(f"exit code {watched(command, path, hours)}")
    used("file", "verify", str(path))
    used("replay", str(path))
    used("export", str(path), "--to", "csv", "--out", str(folder / "exported"))


def emulated_hours(folder: Path, hours: float) -> None:
    """A campaign of `hours` in real time, on the emulated laboratory with clocks that disagree."""
    with emulated("--clock-error", "12e-6", "30e-6", "-21e-6", "--sample-rate", "1000", shown=True) as configuration:
        file = folder / "emulated.toml"
        file.write_text(as_toml(configuration), encoding="utf-8")
        many = f"14:20:{max(2, round(2.0 * hours))}"
        command = [*PROGRAM, *LONG_POINTS, "--config", str(file), "--omega", many, "--out", str(folder / "two")]
        path = folder / "two" / "campaign.h5"
        print(f"exit code {watched(command, path, hours)}")
    with open_datafile(path) as record:
        aligned = [one for lasers in record.alignments.values() for one in lasers]
    for sensor in sorted({one.sensor for one in aligned}):
        rates = [1e6 * (one.rate - 1.0) for one in aligned if one.sensor == sensor]
        lost, late = (sum(getattr(one, name) for one in aligned if one.sensor == sensor) for name in ("lost", "late"))
        print(f"{sensor}: rate {rates[0]:+.1f} ppm first, {rates[-1]:+.1f} ppm last; {lost} lost, {late} late values")
    print(f"verified: {list(verify(path).problems) or 'intact'}")
    used("replay", str(path))


def main() -> int:
    parser = argparse.ArgumentParser()
    whole = {"hours": record_hours, "campaign": campaign, "emulated": emulated_hours}
    counted = {"runs": repeat_runs, "processes": start_processes}
    for name in whole:
        parser.add_argument(f"--{name}", type=float, default=0.0)
    for name in counted:
        parser.add_argument(f"--{name}", type=int, default=0)
    asked: dict[str, Any] = vars(parser.parse_args())
    asked = asked if any(asked.values()) else asked | {"hours": 24.0, "runs": 200}
    with tempfile.TemporaryDirectory() as folder:
        for name, last in whole.items():
            if asked[name]:
                last(Path(folder), asked[name])
        for name, repeat in counted.items():
            if asked[name]:
                repeat(Path(folder), asked[name])
    return 0


if __name__ == "__main__":
    sys.exit(main())
