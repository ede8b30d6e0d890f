"""Holds of unstable points over many seeds, each with a specimen drawn off the assumed one and its own sensors.

    python -m tests.benchmarks.hold [--seeds 100] [--points 15:0.97 12.5:0.64 14:0.97] [--share 0.04] [--scales]

Each run is `rockbench run harmonic` at one point on the simulated bench, whose true storeys and spring are off by up to
`--share` (rectangular), its damping by 30 % and its restitution by 1 %. Printed for each: status, cycles until the
capture, control, and the error of alpha_2 against the orbit of the true specimen on fixed ground at the achieved
amplitudes, relative and in stated uncertainties. In the end: shares captured, held and within the uncertainty, and for
every limited quantity the least margin of all runs, as a whole and while holding, against the margins that the
preflight stated. A run takes 7 to 15 s. With `--scales`, the scales of lasers and table sensors are off as well, by
what the budget assumes of them; without, the interval is wide for what is drawn.
"""

import argparse
import contextlib
import io
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from bench.app.cli.main import main
from bench.config.model import BenchConfiguration
from sim.gain import predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.specimen import Specimen
from tests.benchmarks.coverage_sensors import ACCURACY
from tests.benchmarks.limit_margins import MarginCount, demands_watched, stated_margins


def drawn(share: float, seed: int) -> tuple[Specimen, float]:
    """The true frame and block, and the ratio of true to nominal stiffness of the spring."""
    knowledge = SpecimenKnowledge(stiffness=share, damping=0.3, restitution=0.01, spring=share)
    (found,) = knowledge.draws(Specimen().coupled(1.0), 1, np.random.default_rng(seed))
    return found.bare(), found.k_c / (found.nominal_k_c or 1.0)


def configured(specimen: Specimen, factor: float, seed: int, folder: Path) -> Path:
    """A configuration file of the simulated bench with this truth."""
    true = specimen.model_dump(mode="json", exclude_none=True)
    lines = ["[simulation]", f"seed = {seed}", f"spring_factor = {factor!r}"]

    def table(name: str, values: dict[str, Any]) -> None:
        lines.append(f"[{name}]")
        nested = {key: value for key, value in values.items() if isinstance(value, dict)}
        lines.extend(f"{key} = {json.dumps(value)}" for key, value in values.items() if key not in nested)
        for key, value in nested.items():
            table(f"{name}.{key}", value)

    table("simulation.specimen", true)
    path = folder / "bench.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def draw_sensors(config: Path, seed: int, scales: bool, waves: tuple[float, float] | None) -> None:
    """Add errors of the sensors to a configuration file: of all `scales`, and the number of waves of the lasers'
    linearity errors. Both sensors of the table are off by the same, since the displacement is calibrated against the
    acceleration.
    """
    random = np.random.default_rng([seed, 23])
    table = ACCURACY.table_scale * float(random.standard_normal())
    lasers = (ACCURACY.laser_mismatch / np.sqrt(2.0) * random.standard_normal(2)).tolist()
    errors = {"accelerometer": table, "displacement_sensor": table, "laser_1": lasers[0], "laser_2": lasers[1]}
    with config.open("a", encoding="utf-8") as file:
        for name, error in errors.items():
            file.write(f"[simulation.bench.{name}]\n")
            if scales:
                file.write(f"scale_error = {error!r}\n")
            if waves is not None and name.startswith("laser"):
                file.write(f"linearity_periods = {float(random.uniform(*waves))!r}\n")


def measured(
    omega: float,
    beta: float,
    seed: int,
    share: float,
    options: list[str],
    *,
    scales: bool = False,
    waves: tuple[float, float] | None = None,
) -> dict[str, Any]:
    """The point of one run, with `truth`, the gain of the true specimen's orbit; for `scales` and `waves` see
    `draw_sensors`.
    """
    specimen, factor = drawn(share, seed)
    with tempfile.TemporaryDirectory() as folder:
        config = configured(specimen, factor, seed, Path(folder))
        draw_sensors(config, seed, scales, waves)
        command = ["run", "harmonic", "--yes", "--json", "--config", str(config), "--out", f"{folder}/run"]
        command += ["--omega", str(omega), "--beta", str(beta), *options]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as told:
            status = main(command)
        if status != 0:
            return {"status": "failed", "reason": told.getvalue()[-500:]}
        (point,) = json.loads(Path(f"{folder}/run/summary.json").read_text(encoding="utf-8"))["points"]
        point["stated_margins"] = stated_margins(Path(folder) / "run" / "campaign.h5")
    if point["status"] == "held":
        # a spring that is not the nominal one: beta of the true k_c over the true k1
        true = specimen.coupled(beta * factor * BenchConfiguration().specimen.frame.k1 / specimen.frame.k1)
        branch = predict_gain(true, omega, point["amplitude_m_s2"], point["bare_amplitude_m_s2"]).rocking
        point["truth"] = None if branch is None else branch.alpha_2
        point["true_multiplier"] = None if branch is None else branch.multiplier
    return point


def study() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--share", type=float, default=0.04)
    parser.add_argument("--points", nargs="+", default=["15:0.97", "12.5:0.64", "14:0.97"])
    parser.add_argument("--scales", action="store_true", help="draw the scales of the sensors as well")
    parser.add_argument("--options", nargs=argparse.REMAINDER, default=["--settle-limit", "40"])
    asked = parser.parse_args()
    for text in asked.points:
        omega, beta = map(float, text.split(":"))
        points, margins = list[dict[str, Any]](), MarginCount()
        for seed in range(asked.first, asked.first + asked.seeds):
            with demands_watched() as demands:
                point = measured(omega, beta, seed, asked.share, asked.options, scales=asked.scales)
            points.append(point)
            margins.add(demands, point.get("stated_margins", {}))
            row = f"{omega:g} {beta:g} seed {seed}: {point['status']}"
            if point.get("truth"):
                error = point["alpha_2"] / point["truth"] - 1.0
                row += (
                    f" after {point['captured_cycles']} cycles, control {100 * point['control_share']:.3f} %, "
                    f"alpha_2 {100 * error:+.2f} %, {error * point['truth'] / point['alpha_2_uncertainty']:+.2f} U, "
                    f"|mu| {point['true_multiplier']:.4f}"
                )
            else:
                row += f": {point['reason']}"
            print(row, flush=True)
        held = [point for point in points if point.get("truth")]
        steady = sum(point["status"] == "steady" for point in points)
        inside = sum(abs(p["alpha_2"] - p["truth"]) <= p["alpha_2_uncertainty"] for p in held)
        print(f"{omega:g} {beta:g}: held {len(held)}, steady {steady}, of {len(points)}; within U {inside}", flush=True)
        print(*margins.rows(), sep="\n", flush=True)


if __name__ == "__main__":
    study()
