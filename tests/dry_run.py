"""Hardware in the loop, without hardware: a harmonic point on the real drivers against the emulated laboratory.

    python -m tests.dry_run [--sockets] [--omega 16 --beta 0.4 ...]

With `--sockets` the lasers are on network ports, as on Windows. Without other arguments the short form for continuous
integration, under two minutes in real time; with arguments, those of `rockbench run harmonic`. Real nidaqmx over gRPC,
real pyserial, the virtual bench moving in real time behind them.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.config.template import as_toml
from tests.emulated import emulated

SHORT = (
    *("--omega", "20", "--beta", "0.25", "--ramp-time", "2", "--measured-cycles", "8"),
    *("--settle-tolerance", "0.02", "--amplitude-tolerance", "0.02", "--distortion-tolerance", "0.05"),
)
"""The point that takes least time on the bench."""


def hurried(configuration: BenchConfiguration) -> BenchConfiguration:
    """The same bench with less patience: shorter ramps, less listening to the lasers."""
    hardware = configuration.hardware
    lasers = hardware.lasers.model_copy(update={"observation_time": 2.0})
    changed = {
        "ramps": configuration.ramps.model_copy(update={"stop": 1.0}),
        "hardware": hardware.model_copy(update={"lasers": lasers}),
    }
    return configuration.model_copy(update=changed)


def main(arguments: list[str]) -> int:
    """Run, print the points, and return 0 when every stable one agrees with its prediction."""
    lasers = ("--lasers", "socket") if arguments[:1] == ["--sockets"] else ()
    arguments = arguments[1:] if lasers else arguments
    with emulated(*lasers, shown=True) as configuration, tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench.toml"
        file.write_text(as_toml(configuration if arguments else hurried(configuration)), encoding="utf-8")
        command = [sys.executable, "-m", "bench", "run", "harmonic", "--config", str(file), "--yes", "--json"]
        command += ["--out", f"{folder}/run", *(arguments or SHORT)]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        return done.returncode
    result = json.loads(done.stdout)
    for point in result["points"]:
        print("measured", point["alpha_2"], "predicted", point["alpha_2_predicted"], point["status"])
    return 0 if all(point["agrees"] for point in result["points"] if point["predicted_stable"]) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
