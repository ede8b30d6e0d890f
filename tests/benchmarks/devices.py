"""Every device of the emulation with each set of modules through `rockbench check`, from `emulate` to the verdict.

    python -m tests.benchmarks.devices [--only cDAQ-9174] [--lasers analogue]

Each set is served by `rockbench emulate` in a process of its own, as an operator starts it. Prints one line for each,
with the failed lines of its check; ends with exit status 1 if one failed. A set takes about a minute, in real time.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from bench.config.template import as_toml
from sim.errors import InvalidInput
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
    arguments = ["--device", device, "--lasers", lasers, *(("--modules", *modules) if modules else ())]
    if "9234" in modules:
        arguments += ["--sample-rate", str(RATE_OF_9234)]
    try:
        with emulated(*arguments) as configuration, tempfile.TemporaryDirectory() as folder, Lateness() as lateness:
            file = Path(folder) / "bench.toml"
            # the check is of the devices, not of the computer
            patient = configuration.acquisition.model_copy(update={"lead": LEAD})
            file.write_text(as_toml(configuration.model_copy(update={"acquisition": patient})), encoding="utf-8")
            command = [sys.executable, "-m", "bench", "check", "--config", str(file), "--yes", "--json"]
            done = subprocess.run([*command, "--out", f"{folder}/check"], capture_output=True, text=True, check=False)
            excuse = lateness.excuse or ""
    except (RuntimeError, InvalidInput) as error:
        return False, str(error)
    if done.returncode not in (0, 1) or not done.stdout.strip():
        return False, (done.stderr.strip().splitlines() or ["no answer"])[-1]
    result = json.loads(done.stdout)
    lines = [f"{line['subject']}: {line['what']}" for line in result.get("points", ()) if line["verdict"] == "failed"]
    if result.get("status") != "completed":
        lines.append(str(result.get("reason", result.get("error"))))
    return not lines, "; ".join([*lines, *([excuse] if excuse and lines else [])])


def main() -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", default="", help="sets whose device contains this text")
    parser.add_argument("--lasers", choices=("analogue", "serial"), default="analogue")
    options = parser.parse_args()
    good = True
    for device, modules in SETS:
        if options.only not in device:
            continue
        passed, why = checked(device, modules, options.lasers)
        good &= passed
        print(f"{device:12} {' '.join(modules):24} {'passed' if passed else 'FAILED'}  {why}", flush=True)
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
