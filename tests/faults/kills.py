"""Runs of all protocols on the simulated bench in real time, killed with SIGKILL at random moments:
`python -m tests.faults.kills --kills 100 --seed 1`.

For each kill it prints how long the run had recorded, how much of that the file lost, and whether the file restored by
`rockbench file recover` replays. Several runs are under way at once, since each mostly waits.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from bench.datafile.reader import open_datafile

COMMANDS: dict[str, tuple[str, ...]] = {
    "check": ("check",),
    "coupling-stiffness": ("run", "coupling-stiffness"),
    "earthquake": ("run", "earthquake", "--beta", "0.97"),
    "free-rocking": ("run", "free-rocking"),
    "free-vibration": ("run", "free-vibration"),
    "harmonic": ("run", "harmonic", "--omega", "16", "--beta", "0.4"),
    "identify": ("run", "identify"),
    "laser-calibration": ("run", "laser-calibration"),
    "stability": ("run", "stability", "--omega", "15", "--beta", "0.97"),
}
"""Arguments of `rockbench`, by protocol."""

LATEST = 25.0
"""Latest moment of a kill [s] after the creation of the file; a run that ends before its moment is repeated."""

REPLAYS = "replays"
"""Result of a replay without differences."""

PATIENCE = 180.0
"""Longest wait [s] for the creation of a file, and for the recovery and the replay of one."""


@dataclass(frozen=True)
class Kill:
    """One killed run: time from the creation of the file to the kill, and time without a sample at its end [s]."""

    protocol: str
    recorded: float
    lost: float
    replay: str

    @property
    def good(self) -> bool:
        """Whether at most a second is lost and the restored file replays."""
        return self.lost <= 1.0 and self.replay == REPLAYS


def kill(protocol: str, moment: float, seed: int, folder: Path) -> Kill | None:
    """Kill a run `moment` [s] after it has created its file, and restore the file. None if the run ended before.

    Raises RuntimeError if the run does not create a file.
    """
    out = folder / "run"
    options = ("--realtime", "--yes", "--seed", str(seed), "--out", str(out))
    command = [sys.executable, "-m", "bench", *COMMANDS[protocol], *options]
    with (folder / "errors").open("wb") as errors:
        run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=errors)
    try:
        path = _created(run, out, folder)
        time.sleep(moment)
        killed_at = time.time()
        if run.poll() is not None:
            return None
    finally:
        run.kill()
        run.wait()
    with open_datafile(path) as record:
        recorded = killed_at - datetime.fromisoformat(record.start_time).timestamp()
        lost = recorded - record.rows / record.sample_rate
    return Kill(protocol, recorded, lost, _replayed(path, folder / "clean.h5"))


def _created(run: "subprocess.Popen[bytes]", out: Path, folder: Path) -> Path:
    """The data file of a run, as soon as it can be read."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and run.poll() is None:
        # not the hidden one that is being built
        for path in out.glob("[!.]*.h5"):
            return path
        time.sleep(0.05)
    raise RuntimeError(f"{' '.join(map(str, run.args))} wrote no file: {(folder / 'errors').read_text()}")


def _replayed(path: Path, clean: Path) -> str:
    """Whether the restored file replays, or what was wrong, in a few words."""
    for arguments in (("file", "recover", str(path), "--out", str(clean)), ("replay", str(clean))):
        command = [sys.executable, "-m", "bench", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
        if done.returncode:
            return f"{arguments[0]} ended with {done.returncode}: {(done.stderr.strip() or done.stdout)[-200:]}"
    return REPLAYS


def kills(count: int, seed: int, at_once: int) -> Iterator[Kill]:
    """`count` kills, the protocols in turn, at moments drawn with `seed`; runs that ended too early are repeated."""

    def one(number: int) -> Kill:
        random = np.random.default_rng([seed, number])
        protocol, latest = list(COMMANDS)[number % len(COMMANDS)], LATEST
        while True:
            with tempfile.TemporaryDirectory() as folder:
                found = kill(protocol, float(random.uniform(0.0, latest)), seed + number, Path(folder))
            if found is not None:
                return found
            latest *= 0.5

    with ThreadPoolExecutor(at_once) as threads:
        yield from threads.map(one, range(count))


def main() -> int:
    """Print every kill and the worst loss; return 1 if one lost more than a second or does not replay."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=16)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--at-once", type=int, default=4)
    given = parser.parse_args()
    found: list[Kill] = []
    for each in kills(given.kills, given.seed, given.at_once):
        found.append(each)
        print(f"{each.protocol:20} after {each.recorded:6.2f} s, lost {each.lost:5.2f} s, {each.replay}", flush=True)
    bad = sum(not each.good for each in found)
    print(f"{len(found)} kills, at most {max(each.lost for each in found):.2f} s lost, {bad} bad")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
