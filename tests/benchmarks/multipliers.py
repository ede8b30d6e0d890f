"""Multipliers and boundaries of drawn benches, against the exact ones of the drawn specimen on its table.

    python -m tests.benchmarks.multipliers [--seeds 100] [--points 15:0.97 15.6:0.97 12.5:0.64] [--share 0.04]
        [--boundary 15.2:15.6:0.97]

Each run is `rockbench run stability` on the simulated bench, whose storeys and spring are off by up to `--share`
(rectangular), its damping by 30 % and its restitution by 1 %, as configured; the scale of its accelerometer is off with
a standard deviation of 0.5 %, as assumed. The truth is computed with `sim.table_orbit` for the drawn specimen at the
stated amplitude, so that the error of the scale counts. The measured pair is compared with the nearest one; where
another pair is slower, this is counted. Printed for each run: errors of modulus and angle, absolute and in expanded
uncertainties. In the end: rms error, and the shares covered. With `--boundary`, each run brackets the boundary between
two frequencies; its truth is found by bisection.
"""

import argparse
import contextlib
import io
import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.app.cli.main import main
from bench.config.model import BenchConfiguration
from protocols.stability.prediction import rocking
from protocols.stability.protocol import StabilityPoint
from protocols.stability.results import measured_boundaries
from sim.specimen import Specimen
from sim.table_orbit import table_orbit
from tests.benchmarks.estimates import Estimate, Omitted, Statistics
from tests.benchmarks.hold import configured, drawn

SCALE = 0.005
"""Standard deviation of the relative error of the accelerometer's scale."""


def measured(
    options: list[str], beta: float, seed: int, share: float
) -> tuple[list[dict[str, Any]], Specimen] | Omitted:
    """Points of one run, and the true specimen; the reason of a run that did not end as planned."""
    specimen, factor = drawn(share, seed)
    error = SCALE * float(np.random.default_rng(10_000 + seed).standard_normal())
    with tempfile.TemporaryDirectory() as folder:
        config = configured(specimen, factor, seed, Path(folder))
        with config.open("a", encoding="utf-8") as file:
            file.write(f"[simulation.bench.accelerometer]\nscale_error = {error!r}\n")
            file.write(f"[uncertainty]\nstiffness = {share!r}\nspring = {share!r}\n")
        command = ["run", "stability", "--yes", "--json", "--config", str(config), "--out", f"{folder}/run"]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as told:
            status = main([*command, "--beta", str(beta), *options])
        if status != 0:
            return Omitted(told.getvalue().strip().rpartition("\n")[2])
        points = json.loads(Path(f"{folder}/run/summary.json").read_text(encoding="utf-8"))["points"]
    # a spring that is not the nominal one: beta of the true k_c over the true k1
    true = specimen.coupled(beta * factor * BenchConfiguration().specimen.frame.k1 / specimen.frame.k1)
    return points, true


def multipliers(specimen: Specimen, omega: float, amplitude: float) -> NDArray[np.complex128]:
    """Multipliers of the specimen's orbit on the table, the slowest first."""
    orbit, shaker = rocking(specimen, omega, amplitude), BenchConfiguration().simulated_shaker
    assert orbit is not None
    assert shaker is not None
    found = table_orbit(orbit, shaker, 10).multipliers
    upper = found[found.imag >= 0.0]
    return upper[np.argsort(-np.abs(upper))]


def truth(specimen: Specimen, omega: float, amplitude: float) -> complex:
    """Slowest multiplier of the specimen's orbit on the table."""
    return complex(multipliers(specimen, omega, amplitude)[0])


@dataclass(frozen=True)
class Released:
    """One point, with the modulus and the angle [rad] of its multiplier.

    The true ones are those of the pair that is nearest to the measured one; `exchanged` is set if another pair is
    slower.
    """

    point: dict[str, Any]
    modulus: Estimate
    angle: Estimate
    exchanged: bool


def released(omega: float, beta: float, seed: int, share: float, options: list[str]) -> Released | Omitted:
    """The point of one run without bisection."""
    run = measured(["--omega", str(omega), "--no-bisect", *options], beta, seed, share)
    if isinstance(run, Omitted):
        return run
    (point,), specimen = run
    if point["modulus"] is None:
        return Omitted(f"{point['status']}: {point['reason']}")
    pairs = multipliers(specimen, omega, point["amplitude_m_s2"])
    seen = point["modulus"] * np.exp(1j * point["angle_rad"])
    exact = complex(pairs[int(np.argmin(np.abs(pairs - seen)))])
    return Released(
        point,
        Estimate(point["modulus"], 0.5 * point["modulus_uncertainty"], abs(exact)),
        Estimate(point["angle_rad"], 0.5 * point["angle_uncertainty_rad"], abs(float(np.angle(exact)))),
        exact != pairs[0],
    )


def of_points(asked: argparse.Namespace) -> None:
    for text in asked.points:
        omega, beta = map(float, text.split(":"))
        found = list[Released]()
        failed = 0
        for seed in range(asked.first, asked.first + asked.seeds):
            one = released(omega, beta, seed, asked.share, asked.options)
            if isinstance(one, Omitted):
                failed += 1
                print(f"{text} seed {seed}: {one.reason}", flush=True)
                continue
            found.append(one)
            point, modulus, angle = one.point, one.modulus, one.angle
            print(
                f"{text} seed {seed}: |mu| {modulus.truth:.4f} {modulus.value - modulus.truth:+.5f} "
                f"({0.5 * modulus.e:+.2f} U), angle {np.degrees(angle.value - angle.truth):+.3f} deg "
                f"({0.5 * angle.e:+.2f} U), {point['released_cycles']} cycles, {point['pairs']} pairs, "
                f"autocorrelation {point['autocorrelation']:+.2f}",
                flush=True,
            )
        if found:
            moduli, angles = ([getattr(one, name) for one in found] for name in ("modulus", "angle"))
            off, turned = (np.array([abs(each.value - each.truth) for each in one]) for one in (moduli, angles))
            inside, within = (Statistics.of(one).covered for one in (moduli, angles))
            print(
                f"{text}: measured {len(found)} of {asked.seeds}; |mu| within 0.005 {np.mean(off <= 0.005):.0%}, "
                f"within U {inside:.0%}, rms {np.sqrt(np.mean(off**2)):.5f}; angle within "
                f"1 deg {np.mean(turned <= np.radians(1.0)):.0%}, within U {within:.0%}; "
                f"not measured {failed}, another pair slower {sum(one.exchanged for one in found)}",
                flush=True,
            )


def of_boundaries(asked: argparse.Namespace) -> None:
    low, high, beta = map(float, asked.boundary.split(":"))
    inside, close, found = 0, 0, 0
    for seed in range(asked.first, asked.first + asked.seeds):
        options = ["--omega", str(low), str(high), *asked.options]
        run = measured(options, beta, seed, asked.share)
        if isinstance(run, Omitted):
            print(f"boundary, seed {seed}: {run.reason}", flush=True)
            continue
        rows, specimen = run
        points = [StabilityPoint.model_validate(row) for row in rows]
        boundary = next(iter(measured_boundaries(points)), None)
        if boundary is None:
            print(f"boundary, seed {seed}: none between the frequencies", flush=True)
            continue
        amplitude = next(point.amplitude_m_s2 or 0.0 for point in points if point.amplitude_m_s2)
        below, above = boundary.low - 0.1, boundary.high + 0.1
        falling = abs(truth(specimen, below, amplitude)) > 1.0
        while above - below > 1e-3:
            middle = 0.5 * (below + above)
            if (abs(truth(specimen, middle, amplitude)) > 1.0) is falling:
                below = middle
            else:
                above = middle
        off = boundary.place - 0.5 * (below + above)
        found, inside, close = found + 1, inside + (abs(off) <= boundary.uncertainty), close + (abs(off) <= 0.05)
        print(
            f"boundary, seed {seed}: {boundary.place:.4f} rad/s, {off:+.4f} ({off / boundary.uncertainty:+.2f} U), "
            f"{len(points)} points",
            flush=True,
        )
    print(f"boundary: {found} of {asked.seeds}; within U {inside}, within 0.05 rad/s {close}", flush=True)


def study() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--share", type=float, default=0.04)
    parser.add_argument("--points", nargs="*", default=["15:0.97", "15.6:0.97", "12.5:0.64"])
    parser.add_argument("--boundary", default="")
    parser.add_argument("--options", nargs="*", default=["--starts", "3"])
    asked = parser.parse_args()
    of_points(asked)
    if asked.boundary:
        of_boundaries(asked)


if __name__ == "__main__":
    study()
