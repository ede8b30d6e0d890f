"""How well serial lasers are placed on the DAQ's sample clock, against the truth that the emulated laboratory knows.

    python -m tests.benchmarks.alignment [--method watch|marker|both] [--seconds 15] [--restarts 20] [--known-delay]

For each method:

1. `rockbench check` measures the delay that is left and says what `hardware.lasers.delay` should be. With
   `--known-delay` it is that of the filter cards, which leaves the biases of the method itself.
2. With that value, sessions that each open the bench anew: where each laser's value was placed, against where it was
   really taken, after the first block and at the end, and where the final alignment of the run, which the data file
   stores, places the first block. The DAQ's channels lag by the delay of their filter cards, and the lasers are to lag
   by the same. Time stamps count 10 us; what an exposure is later than its stamp is taken out.

watch: the sample clock is read by a process of its own (`drivers.daqmx.clock_watch`). marker: pulses of a counter
switch the lasers off between the runs and at arming (`drivers.timebase.marking`).

The lateness of the machine is printed beside each session: of 99 in 100 short sleeps, and the worst.
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
from drivers.hardware.parameters import Hardware
from drivers.hardware.rig import HardwareRig
from drivers.rig import Alignment
from tests.emulated import emulated
from tests.lateness import Lateness

BLOCK, LEAD = 200, 800
ALLOWED = {"watch": 20e-6, "marker": 10e-6}
COUNTER = "Dev1/ctr0"


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


def error(one: Alignment, truth: dict[str, float], zero: float, clock: float, lag: float, at: float) -> float:
    """Placed less true time [s] of a value at second `at` of the run: `clock` is true over nominal sample rate."""
    sensor = (zero + at / clock - truth["epoch"]) * truth["rate"] / truth["nominal"] - truth["stamp_lag"]
    return one.offset + one.rate * sensor + one.delay - (at + lag)


PLACES = ("at the marks", "after the first block", "at the end", "first block in the final alignment")


def session(hardware: Hardware, lag: float, seconds: float) -> list[tuple[float, ...]]:
    """For each laser: its errors at `PLACES` [s], and that of its rate in the end [1]. Without marks, the first place
    is the start of the run."""
    with HardwareRig(hardware, lead=LEAD) as rig:
        rig.arm()
        rig.write(np.zeros(LEAD))
        found: list[list[float]] = []
        rates: list[float] = []
        blocks = round(seconds * rig.sample_rate / BLOCK)
        for block in range(1, blocks + 1):
            rig.write(np.zeros(BLOCK))
            rig.read(BLOCK)
            if block not in (1, blocks):
                continue
            truth, at = ask(str(hardware.emulator_address), "truth"), block * BLOCK / rig.sample_rate
            clock = truth["sample_rate"] / hardware.sample_rate
            zero = truth["first_sample"] + rig.skipped / truth["sample_rate"]
            lasers = [{**laser, "nominal": hardware.lasers.rate} for laser in truth["lasers"]]
            pairs = list(zip(rig.alignments, lasers, strict=True))
            middle = -0.5 * rig.skipped / rig.sample_rate
            found += [
                [error(one, laser, zero, clock, lag, place) for one, laser in pairs]
                for place in ((middle, at) if block == 1 else (at, BLOCK / rig.sample_rate))
            ]
            rates = [one.rate - clock * laser["nominal"] / laser["rate"] for one, laser in pairs]
        rig.stop()
    return list(zip(*found, rates, strict=True))


def measure(method: str, seconds: float, restarts: int, *, known: bool) -> bool:
    """Print the errors of each session, and whether all are below what is allowed."""
    with emulated("--clock-error", "12e-6", "30e-6", "-21e-6") as configuration:
        hardware = configuration.hardware
        daq = hardware.daq.model_copy(update={"laser_marker": COUNTER if method == "marker" else None})
        hardware = hardware.model_copy(update={"daq": daq})
        lag = configuration.simulation.bench.filter_unit.delay(hardware.sample_rate)
        delay = lag if known else checked_delay(configuration.model_copy(update={"hardware": hardware}))
        source = "known" if known else "by the check"
        print(f"{method}: delay as configured {1e3 * hardware.lasers.delay:.3f} ms, {source} {1e3 * delay:.3f} ms")
        hardware = hardware.model_copy(update={"lasers": hardware.lasers.model_copy(update={"delay": delay})})
        found: list[tuple[float, ...]] = []
        print(f"{'session':>7}  laser 1, laser 2: error {', '.join(PLACES)}, of the rate in the end [us, ppm]")
        for number in range(1, restarts + 1):
            with Lateness() as lateness:
                lasers = session(hardware, lag, seconds)
            found += lasers
            row = "   ".join(" ".join(f"{1e6 * one:+8.1f}" for one in errors) for errors in lasers)
            late = f"late {1e3 * lateness.typical:.1f}, worst {1e3 * lateness.worst:.0f} ms"
            print(f"{number:7d}  {row}   {late}", flush=True)
    met = True
    for column, place in enumerate(PLACES):
        errors = np.array([one[column] for one in found])
        worst, rms = float(np.abs(errors).max()), float(np.sqrt(np.mean(errors**2)))
        met &= worst < ALLOWED[method]
        told = f"worst {1e6 * worst:.1f} us, rms {1e6 * rms:.1f} us, mean {1e6 * errors.mean():+.1f} us"
        told += f", scatter {1e6 * errors.std():.1f} us"
        verdict = "met" if worst < ALLOWED[method] else "NOT MET"
        print(f"{method}, {place}: {told}, allowed {1e6 * ALLOWED[method]:.0f} us: {verdict}")
    return met


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--method", choices=("watch", "marker", "both"), default="both")
    parser.add_argument("--seconds", type=float, default=15.0)
    parser.add_argument("--restarts", type=int, default=20)
    parser.add_argument("--known-delay", action="store_true")
    given = parser.parse_args()
    methods = ("watch", "marker") if given.method == "both" else (given.method,)
    results = [measure(method, given.seconds, given.restarts, known=given.known_delay) for method in methods]
    sys.exit(0 if all(results) else 1)
