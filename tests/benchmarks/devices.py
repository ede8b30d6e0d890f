"""Every device of the emulation with each set of modules through `rockbench check`, from `emulate` to the verdict.

    python -m tests.benchmarks.devices [--only cDAQ-9174] [--lasers analogue] [--point]

Each set is served by `rockbench emulate` in a process of its own, as an operator starts it. Prints one line for each,
with the failed lines of its check; ends with exit status 1 if one failed. A set takes about a minute, in real time.
With `--point`, the harmonic point of `tests.dry_run` is measured instead, on the first set of each device.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench.config.model import BenchConfiguration
from bench.config.template import as_toml
from sim.errors import InvalidInput
from tests.dry_run import SHORT, hurried
from tests.emulated import emulated
from tests.lateness import Lateness

CHASSIS = ("cDAQ-9174", "cDAQ-9185", "cRIO-9045", "cRIO-9049")
MODULES = (
    ("9205", "9263", "9401"),
    ("9215", "9263", "9485", "9401"),
    ("9239", "9263", "9401"),
    ("9234", "9269", "9401"),
    ("9205", "9239", "9269", "9401"),
)
SETS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("PCIe-6351", ()),
    ("USB-6351", ()),
    ("usb", ()),
    ("crio", ()),
    *((chassis, modules) for chassis in CHASSIS for modules in MODULES),
)
"""The device and its modules. An NI 9234 has the rates 51.2 kS/s / n only."""
RATE_OF_9234 = 2048.0
LEAD = 1.5
"""Drive queued ahead [s], so that a busy computer does not end a check."""


def checked(device: str, modules: tuple[str, ...], lasers: str) -> tuple[bool, str]:
    """Whether the check of a set passes, and what it failed for."""
    lines, problems, late = _carried_out(device, modules, lasers, ("check",), lambda given: given)
    problems += [f"{line['subject']}: {line['what']}" for line in lines if line["verdict"] == "failed"]
    return not problems, "; ".join([*problems, *late] if problems else [])


def measured(device: str, modules: tuple[str, ...], lasers: str) -> tuple[bool, str]:
    """Whether a harmonic point on a set agrees with its prediction; the point, or what the run failed for."""
    points, problems, late = _carried_out(device, modules, lasers, ("run", "harmonic", *SHORT), hurried)
    found = [f"alpha_2 {one['alpha_2']}, predicted {one['alpha_2_predicted']}, {one['status']}" for one in points]
    passed = not problems and bool(points) and all(one["agrees"] for one in points)
    return passed, "; ".join([*found, *problems, *([] if passed else late)])


def _carried_out(
    device: str,
    modules: tuple[str, ...],
    lasers: str,
    command: tuple[str, ...],
    adapted: Callable[[BenchConfiguration], BenchConfiguration],
) -> tuple[list[dict[str, Any]], list[str], list[str]]:
    """The points of the JSON result of a command on a set, why it was not completed, and how late the computer was."""
    arguments = ["--device", device, "--lasers", lasers, *(("--modules", *modules) if modules else ())]
    if "9234" in modules:
        arguments += ["--sample-rate", str(RATE_OF_9234)]
    try:
        with emulated(*arguments) as configuration, tempfile.TemporaryDirectory() as folder, Lateness() as lateness:
            file = Path(folder) / "bench.toml"
            # the test is of the devices, not of the computer
            patient = configuration.acquisition.model_copy(update={"lead": LEAD})
            configuration = adapted(configuration.model_copy(update={"acquisition": patient}))
            file.write_text(as_toml(configuration), encoding="utf-8")
            whole = [sys.executable, "-m", "bench", *command, "--config", str(file), "--yes", "--json"]
            done = subprocess.run([*whole, "--out", f"{folder}/run"], capture_output=True, text=True, check=False)
            late = [lateness.excuse] if lateness.excuse else []
    except (RuntimeError, InvalidInput) as error:
        return [], [str(error)], []
    if done.returncode not in (0, 1) or not done.stdout.strip():
        return [], [(done.stderr.strip().splitlines() or ["no answer"])[-1]], late
    result = json.loads(done.stdout)
    completed = result.get("status") == "completed"
    problems = [] if completed else [str(result.get("reason", result.get("error")))]
    return result.get("points", []), problems, late


def main() -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", default="", help="sets whose device contains this text")
    parser.add_argument("--lasers", choices=("analogue", "serial"), default="analogue")
    parser.add_argument("--point", action="store_true", help="a harmonic point on the first set of each device")
    options = parser.parse_args()
    good, done = True, set[str]()
    for device, modules in SETS:
        if options.only not in device or (options.point and device in done):
            continue
        done.add(device)
        passed, why = (measured if options.point else checked)(device, modules, options.lasers)
        good &= passed
        print(f"{device:12} {' '.join(modules):24} {'passed' if passed else 'FAILED'}  {why}", flush=True)
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
