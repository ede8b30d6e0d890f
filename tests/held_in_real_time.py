"""Unstable orbits held in real time: the real drivers against the emulated laboratory, then every file replayed.

    python -m tests.held_in_real_time [--lasers analogue] [--sample-rate 1000]

Both unstable points of the paper's campaign, one run each; the arguments are those of `rockbench emulate`. Each point
must be held with the predicted gain, and its file must replay bit for bit. Ten minutes, nearly all of it bench time.
Block and lead must together be shorter than a cycle, 0.419 s at 15 rad/s: where the computer keeps program or
laboratory from running for longer than the lead, the drive underflows and the run has failed.
"""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bench.config.model import BenchConfiguration
from bench.config.template import as_toml
from tests.emulated import emulated

POINTS = ((12.5, 0.64), (15.0, 0.97))
"""Frequency [rad/s] and stiffness ratio."""
BLOCK, LEAD = 0.05, 0.35
"""Duration of a block and lead of the drive [s]."""
QUICK = ("--settle-limit", "30", "--ramp-time", "4", "--harmonics", "5", "--starts", "2")


def program(*arguments: str) -> tuple[int, dict[str, Any]]:
    """Exit code of `rockbench` with these arguments, and what it printed as JSON; its log is passed on."""
    command = [sys.executable, "-m", "bench", *arguments, "--json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    return done.returncode, json.loads(done.stdout or "{}")


def timed(configuration: BenchConfiguration) -> BenchConfiguration:
    """The same bench with corrections in time."""
    acquisition = configuration.acquisition.model_copy(update={"block_duration": BLOCK, "lead": LEAD})
    return configuration.model_copy(update={"acquisition": acquisition})


def options(omega: float, beta: float) -> tuple[str, ...]:
    """Options of the run of one point."""
    return ("--omega", f"{omega:g}", "--beta", f"{beta:g}", *QUICK)


@contextmanager
def laboratory(arguments: Sequence[str]) -> Iterator[Path]:
    """An emulated laboratory, and the file of its configuration."""
    with emulated(*arguments, shown=True) as configuration, tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench.toml"
        file.write_text(as_toml(timed(configuration)), encoding="utf-8")
        yield file


def held(file: Path, omega: float, beta: float, out: Path) -> bool:
    """Hold one point and replay its file; prints both."""
    begun = time.monotonic()
    code, result = program("run", "harmonic", "--config", str(file), "--yes", "--out", str(out), *options(omega, beta))
    print(f"omega {omega:g} rad/s, beta {beta:g}: exit code {code} after {time.monotonic() - begun:.0f} s")
    found = next(iter(result.get("points", ())), None)
    if found is None:
        print(f"  no point: {result}")
    else:
        print(f"  {found['status']}: alpha_2 {found['alpha_2']:.4f}, predicted {found['alpha_2_predicted']:.4f}")
        print(f"  {found['reason']}")
    _, replayed = program("replay", str(out / "campaign.h5"))
    print(f"  replayed bit for bit: {replayed.get('identical')}; {replayed.get('differences', replayed)}", flush=True)
    good = found is not None and found["status"] == "held" and found["agrees"] is True
    return good and code == 0 and replayed.get("identical") is True


def main(arguments: list[str]) -> int:
    """Return 0 if every point is held, agrees with its prediction and replays bit for bit."""
    with laboratory(arguments) as file, tempfile.TemporaryDirectory() as folder:
        every = [held(file, *point, Path(folder) / f"run_{n}") for n, point in enumerate(POINTS)]
    return 0 if all(every) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
