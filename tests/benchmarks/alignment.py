"""How well serial lasers are placed on the DAQ's sample clock, against the truth that the emulated laboratory knows.

    python -m tests.benchmarks.alignment [--seconds 60] [--runs 3]

1. `rockbench check` measures the delay that is left and says what `hardware.lasers.delay` should be.
2. With that value, several runs: where each laser's value was placed, against where it was really taken. The DAQ's
   channels lag by the delay of their filter cards, and the lasers are to lag by the same.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from bench.config.model import BenchConfiguration
from bench.config.toml import as_toml
from drivers.emulation.control import ask
from drivers.hardware.rig import HardwareRig
from drivers.rig import Alignment
from tests.emulated import emulated

BLOCK, LEAD = 200, 800
ALLOWED = 50e-6


def checked_delay(configuration: BenchConfiguration) -> float:
    """What `rockbench check` says that `hardware.lasers.delay` should be [s]."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench.toml"
        file.write_text(as_toml(configuration), encoding="utf-8")
        command = [sys.executable, "-m", "bench", "check", "--config", str(file), "--yes", "--json"]
        done = subprocess.run([*command, "--out", f"{folder}/check"], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(done.stderr)
    for line in json.loads(done.stdout)["points"]:
        if "hardware.lasers.delay" in line["what"]:
            return line["measured"]
    raise SystemExit(f"the check measured no delay:\n{done.stderr}")


def errors(one: Alignment, truth: dict[str, float], zero: float, clock: float, lag: float, until: float) -> np.ndarray:
    """Placed less true time [s] of values of a laser, through the run: `clock` is true over nominal sample rate."""
    taken = np.linspace(0.0, until, 200)
    host = zero + taken / clock
    sensor = (host - truth["epoch"]) * truth["rate"] / truth["nominal"]
    return one.offset + one.rate * sensor + one.delay - (taken + lag)


def measure(seconds: float, runs: int) -> bool:
    """Print the errors of each run, and say whether all are below what is allowed."""
    with emulated("--clock-error", "12e-6", "30e-6", "-21e-6") as configuration:
        hardware = configuration.hardware
        delay = checked_delay(configuration)
        print(f"delay as configured {1e3 * hardware.lasers.delay:.3f} ms, as the check says {1e3 * delay:.3f} ms")
        hardware = hardware.model_copy(update={"lasers": hardware.lasers.model_copy(update={"delay": delay})})
        lag = configuration.simulation.bench.filter_unit.delay(hardware.sample_rate)
        worst = 0.0
        print(f"{'run':>4} {'after':>6}  {'laser_1: error, rate':>28}  {'laser_2: error, rate':>28}")
        with HardwareRig(hardware, lead=LEAD) as rig:
            for run in range(1, runs + 1):
                rig.arm()
                rig.write(np.zeros(LEAD))
                blocks = round(seconds * rig.sample_rate / BLOCK)
                for number in range(1, blocks + 1):
                    rig.write(np.zeros(BLOCK))
                    rig.read(BLOCK)
                    if number % max(blocks // 6, 1):
                        continue
                    truth, until = ask(str(hardware.emulator_address), "truth"), number * BLOCK / rig.sample_rate
                    clock = truth["sample_rate"] / hardware.sample_rate
                    row: list[str] = []
                    for one, laser in zip(rig.alignments, truth["lasers"], strict=True):
                        known = {**laser, "nominal": hardware.lasers.rate}
                        # where the next values go
                        error = errors(one, known, truth["first_sample"], clock, lag, until)[-1]
                        true_rate = clock * hardware.lasers.rate / laser["rate"]
                        row.append(f"{1e6 * error:+10.1f} us {1e6 * (one.rate - true_rate):+7.2f} ppm off")
                        worst = max(worst, abs(error)) if until > 10.0 else worst
                    print(f"{run:4d} {until:5.0f}s  {row[0]:>28}  {row[1]:>28}")
                rig.stop()
    verdict = "met" if worst < ALLOWED else "NOT MET"
    print(f"worst error after 10 s {1e6 * worst:.1f} us, allowed {1e6 * ALLOWED:.0f} us: {verdict}")
    return worst < ALLOWED


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--runs", type=int, default=3)
    given = parser.parse_args()
    sys.exit(0 if measure(given.seconds, given.runs) else 1)
