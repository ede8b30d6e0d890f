"""How well serial lasers are placed on the DAQ's sample clock, against the truth that the emulated laboratory knows.

    python -m tests.benchmarks.alignment [--seconds 15] [--restarts 20]

1. `rockbench check` measures the delay that is left and says what `hardware.lasers.delay` should be.
2. With that value, sessions that each open the bench anew: where each laser's value was placed, against where it was
   really taken. The DAQ's channels lag by the delay of their filter cards, and the lasers are to lag by the same.

The sample clock is read by a process of its own (`drivers.daqmx.clock_watch`).
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from bench.config.model import BenchConfiguration
from bench.config.template import as_toml
from drivers.emulation.control import ask
from drivers.hardware.rig import HardwareRig
from drivers.rig import Alignment
from tests.emulated import emulated
from tests.lateness import Lateness

BLOCK, LEAD = 200, 800
ALLOWED = 20e-6


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


def measure(seconds: float, restarts: int) -> bool:
    """Print the errors of each session at its end, and whether all are below what is allowed."""
    with emulated("--clock-error", "12e-6", "30e-6", "-21e-6") as configuration:
        hardware = configuration.hardware
        delay = checked_delay(configuration)
        print(f"delay as configured {1e3 * hardware.lasers.delay:.3f} ms, as the check says {1e3 * delay:.3f} ms")
        hardware = hardware.model_copy(update={"lasers": hardware.lasers.model_copy(update={"delay": delay})})
        lag = configuration.simulation.bench.filter_unit.delay(hardware.sample_rate)
        found: list[float] = []
        print(f"{'session':>7}  {'laser_1: error, rate':>28}  {'laser_2: error, rate':>28}")
        for session in range(1, restarts + 1):
            with HardwareRig(hardware, lead=LEAD) as rig, Lateness() as lateness:
                rig.arm()
                rig.write(np.zeros(LEAD))
                blocks = round(seconds * rig.sample_rate / BLOCK)
                for _ in range(blocks):
                    rig.write(np.zeros(BLOCK))
                    rig.read(BLOCK)
                truth, until = ask(str(hardware.emulator_address), "truth"), blocks * BLOCK / rig.sample_rate
                clock = truth["sample_rate"] / hardware.sample_rate
                row: list[str] = []
                for one, laser in zip(rig.alignments, truth["lasers"], strict=True):
                    known = {**laser, "nominal": hardware.lasers.rate}
                    # where the next values go
                    error = errors(one, known, truth["first_sample"], clock, lag, until)[-1]
                    true_rate = clock * hardware.lasers.rate / laser["rate"]
                    row.append(f"{1e6 * error:+10.1f} us {1e6 * (one.rate - true_rate):+7.2f} ppm off")
                    found.append(error)
                rig.stop()
            excuse = lateness.excuse or ""
            print(f"{session:7d}  {row[0]:>28}  {row[1]:>28}  {excuse}", flush=True)
    worst, rms = float(np.abs(found).max()), float(np.sqrt(np.mean(np.square(found))))
    verdict = "met" if worst < ALLOWED else "NOT MET"
    told = f"worst {1e6 * worst:.1f} us, rms {1e6 * rms:.1f} us, allowed {1e6 * ALLOWED:.0f} us"
    print(f"watch of the clock: {told}: {verdict}")
    return worst < ALLOWED


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seconds", type=float, default=15.0)
    parser.add_argument("--restarts", type=int, default=20)
    given = parser.parse_args()
    sys.exit(0 if measure(given.seconds, given.restarts) else 1)
