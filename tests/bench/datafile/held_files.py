"""A writer of a data file under locks that forbid it to write, and live readers that lock: run as a program.

    python -m tests.bench.datafile.held_files [--flushes 1000] [--readers 3] [--hold 0.01]

Linux has no mandatory locks: they are made by `mandatory.c`, compiled here and loaded into the writer. Prints what the
writer waited for. `tests/bench/datafile/test_held.py` runs a short one.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SOURCE = Path(__file__).with_name("mandatory.c")

READER = """
import sys, time
import h5py
path, hold = sys.argv[1], float(sys.argv[2])
print("ready", flush=True)
while True:
    try:
        # as other programs do: with the library's own locks
        with h5py.File(path, "r", swmr=True, locking=True) as file:
            file["entry/complete"][()]
            time.sleep(hold)
    except (OSError, KeyError, RuntimeError):
        pass
    time.sleep(4.0 * hold)
"""

WRITER = """
import fcntl, json, sys, time
from pathlib import Path
from bench.datafile import access, hdf5, held, writer
from tests.bench.datafile.living import begin, hand_over
path, flushes = Path(sys.argv[1]), int(sys.argv[2])
# the writer locks as on Windows: not by HDF5, and so that nobody else does
locking = access.locking
access.locking = hdf5.locking = lambda: locking("win32")
if sys.argv[3] == "guarded":
    held.keep_lockers_out = lambda handle: fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
held.HELD = float(sys.argv[4])
waits, sleep = [], time.sleep
class Time:
    monotonic = staticmethod(time.monotonic)
    @staticmethod
    def sleep(seconds):
        waits.append(seconds)
        sleep(seconds)
held.time = Time
recorder = begin(path)
print("begun", flush=True)
sys.stdin.readline()
longest = 0.0
for k in range(flushes):
    hand_over(recorder, k)
    begun = time.monotonic()
    recorder.sync()
    longest = max(longest, time.monotonic() - begun)
recorder.close("completed")
print(json.dumps({"flushes": flushes, "refused": len(waits), "longest": longest}), flush=True)
"""


def compiled(folder: Path) -> Path | None:
    """The library of mandatory locks; None without a compiler."""
    library = folder / "mandatory.so"
    try:
        command = ["cc", "-shared", "-fPIC", "-O1", "-o", str(library), str(SOURCE), "-ldl"]
        done = subprocess.run(command, capture_output=True, check=False)
    except OSError:
        return None
    return library if done.returncode == 0 else None


def write_under_readers(
    path: Path,
    library: Path,
    *,
    flushes: int,
    readers: int,
    hold: float,
    guard: str = "guarded",
    patience: float = 10.0,
) -> dict[str, float]:
    """Counts of a writer: flushes, refused writes, and the longest flush [s]. Raises AssertionError with its errors."""
    environment = os.environ | {"LD_PRELOAD": str(library)}
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(path), str(flushes), guard, str(patience)],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert writer.stdin is not None
    assert writer.stdout is not None
    assert writer.stdout.readline() == "begun\n"
    command = [sys.executable, "-c", READER, str(path), str(hold)]
    reading = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(readers)]
    try:
        for each in reading:
            assert each.stdout is not None
            assert each.stdout.readline() == "ready\n"
        told, errors = writer.communicate("go\n", timeout=600.0)
    finally:
        for each in reading:
            each.kill()
            each.communicate()
    assert writer.returncode == 0, errors
    return json.loads(told.splitlines()[-1])


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--flushes", type=int, default=1000)
    parser.add_argument("--readers", type=int, default=3)
    parser.add_argument("--hold", type=float, default=0.01)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        library = compiled(Path(folder))
        if library is None:
            print("needs Linux and a C compiler (cc)")
            return 2
        begun, path = time.monotonic(), Path(folder, "run.h5")
        found = write_under_readers(path, library, flushes=asked.flushes, readers=asked.readers, hold=asked.hold)
        from bench.datafile.inspection import verify

        problems = verify(path).problems
        print(f"{asked.readers} readers, {found}, {time.monotonic() - begun:.1f} s, problems: {list(problems)}")
        return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
