"""Coverage of the stated uncertainty of alpha_2: many benches, each with other sensors and another specimen.

    python -m tests.benchmarks.coverage [--benches 40] [--points 16,0.40 20,0.25] [--only default "short waves"]
    python -m tests.benchmarks.coverage --budget          # sources switched off one by one
    python -m tests.benchmarks.coverage --record l-aquila [--beta 0.25] [--source check] [--periods 0.5 2 4]

Each bench draws a specimen from the assumed uncertainty, lasers (scale, linearity, clock, rest, noise), the scale of
the table's sensors, and the harmonics and amplitude that the control of the table leaves. The exact motion of the
specimen approaches its steady state from a point near it; criterion, measurement and budget are those of the harmonic
protocol. The error e over the standard uncertainty u, the rms of e/u, its mean, and the share of the intervals (k = 2)
that cover the truth are printed for two truths: the gain of the true specimen at the stated amplitude, by the exact
steady solver, and the ratio of the peaks of the simulated motions during the measurement.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import tau

import numpy as np

from bench.analysis.cycles import Cycle
from bench.analysis.gain import steady_peak
from bench.analysis.laser_calibration import LaserCalibration
from bench.analysis.linearity import LinearFrame
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.steady import Steadiness, SteadyDetector
from bench.config.model import BenchConfiguration
from protocols.common.sine.settling import INTERVAL, JUDGED, LASERS, SHORTEST, TRANSIENT, Settled, checked
from protocols.harmonic.conditions import Conditions
from protocols.harmonic.judgement import judge
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, PointStatus
from protocols.laser_calibration.reference import ReferenceCurve
from sim.gain import predict_gain
from sim.linear import steady_response
from sim.rocking import State
from sim.specimen import Specimen
from tests.benchmarks.coverage_record import seismic
from tests.benchmarks.coverage_sensors import (
    ACCURACY,
    CASES,
    LEAD,
    RANGES,
    RATE,
    SOURCES,
    Array,
    Case,
    Motion,
    Sensors,
    approach,
    cycles_of,
    rms,
)
from tests.benchmarks.estimates import Estimate, Omitted

POINTS = ((16.0, 0.40), (17.5, 0.97), (20.0, 0.25), (20.0, 0.64))
"""Frequency [rad/s] and stiffness ratio."""

PERTURBED = 0.03
"""Standard deviation of the first state relative to the steady one."""

LONGEST = 200
"""Cycles of a test, settling included."""

ASKED, CONFIGURATION = HarmonicParameters(), BenchConfiguration()
NOMINAL = CONFIGURATION.known_specimen
FRAME = LinearFrame(NOMINAL.bare(), grounded=True)
LEVEL = ASKED.amplitude_factor * NOMINAL.uplift_acceleration


@dataclass(frozen=True, eq=False)
class Observed:
    """One test: all its cycles until the end of the measurement, and the peak drift during it [m]."""

    cycles: Sequence[Cycle]
    waited: int
    drift: float


@dataclass(frozen=True, eq=False)
class Bench:
    """Both tests of a bench at one point, its true specimen, and its calibration."""

    omega: float
    specimen: Specimen
    clock: float
    scale: float
    bare: Observed
    coupled: Observed
    calibration: LaserCalibration | None
    others: Sequence[tuple[float, Observed]] = ()


def bench(seed: int, case: Case, omega: float, beta: float, *, campaign: bool = False) -> Bench | Omitted:
    """Both tests of a bench, in a `campaign` also those of the bare frame at its other frequencies; omitted where the
    true motion is not stable, or does not become steady.
    """
    random, sensors = np.random.default_rng([seed, 3]), Sensors(seed, case)
    specimen = NOMINAL.coupled(beta)
    if "truth" not in case.off:
        [specimen] = CONFIGURATION.known.draws(specimen, 1, random)
    true = omega / (1.0 + case.clock)
    branch = predict_gain(specimen, true, LEVEL).rocking
    if branch is None or not branch.stable:
        return Omitted("not stable")
    found = calibrated(seed, case)[0] if case.calibrated else None
    phase, *start = (float(value) for value in branch.orbit.section)
    moved = np.array([*start[:4], 0.0, start[4]])
    if "transient" not in case.off:
        moved = moved * (1.0 + PERTURBED * random.standard_normal(6))
    further = [one for one in ASKED.omega if one != omega] if campaign else []
    tests: list[tuple[float, Observed]] = []
    for at, state, start_phase, which in (
        (omega, _bare_start(specimen, omega, case, random), 0.0, specimen.bare()),
        (omega, moved, phase, specimen),
        *((one, _bare_start(specimen, one, case, random), 0.0, specimen.bare()) for one in further),
    ):
        try:
            motion = approach(which, State.from_array(state), start_phase, at, LEVEL, LONGEST, sensors)
        except RuntimeError:
            return Omitted("fell")
        test = _observed(motion, cycles_of(sensors.signals(motion, found), at), at)
        if test is not None:
            tests.append((at, test))
        elif at == omega:
            return Omitted("not steady")
    scale = sensors.table * (found.table_acceleration if found else 1.0)
    (_, bare), (_, coupled), *others = tests
    return Bench(omega, specimen, case.clock, scale, bare, coupled, found, others)


def _bare_start(specimen: Specimen, omega: float, case: Case, random: np.random.Generator) -> Array:
    """A state of the bare frame near its steady motion at phase 0."""
    true = omega / (1.0 + case.clock)
    amplitudes = np.array(steady_response(specimen.bare(), true, LEVEL))
    steady = np.array([*(c.imag for c in (*amplitudes, *(1j * true * amplitudes))), 0.0, 0.0])
    if "transient" in case.off:
        return steady
    sizes = np.array([*np.abs(amplitudes), *(true * np.abs(amplitudes)), 0.0, 0.0])
    return steady + PERTURBED * sizes * random.standard_normal(6)


@lru_cache(maxsize=256)
def calibrated(seed: int, case: Case) -> tuple[LaserCalibration, ReferenceCurve]:
    """What a calibration finds of the sensors of a bench: the same at all of its points."""
    sensors = Sensors(seed, case)
    # another noise than that of the tests
    sensors.random = np.random.default_rng([seed, 4])
    return sensors.calibrated()


def _observed(motion: Motion, cycles: Sequence[Cycle], omega: float) -> Observed | None:
    """Wait and measure as the protocol does."""
    detector = SteadyDetector(ASKED.settle_tolerance, JUDGED, LASERS, omega * ACCURACY.laser_timing)
    measured, done = ASKED.measured_cycles, 0
    while done + measured <= len(cycles):
        if done * tau / omega >= SHORTEST and detector.judge().steady:
            for cycle in cycles[done : done + measured]:
                detector.push(cycle)
            if detector.judge(allowance=2.0).steady:
                per, first = tau / omega * RATE, LEAD
                window = slice(first + round(done * per), first + round((done + measured) * per))
                drift = motion.u2[window] - motion.u1[window]
                return Observed(cycles[: done + measured], done, float(np.abs(drift).max()))
            done += measured
            continue
        for cycle in cycles[done : done + INTERVAL]:
            detector.push(cycle)
        done += INTERVAL
    return None


@dataclass(frozen=True)
class Score:
    """Relative errors against both truths, relative standard uncertainty, and the point."""

    specimen: float
    motion: float
    u: float
    point: HarmonicPoint

    @property
    def estimate(self) -> Estimate:
        """alpha_2, with the gain of the true specimen at the stated amplitude."""
        value = self.point.alpha_2 or 0.0
        return Estimate(value, value * self.u, value / (1.0 + self.specimen))


def _settled(test: Observed, omega: float, *, linear: bool) -> Settled:
    cycles = list(test.cycles)
    measured = ASKED.measured_cycles
    before, frame = cycles[TRANSIENT:-measured], FRAME if linear else None
    peak = steady_peak(cycles[-measured:], omega, before=before, frame=frame)
    return Settled(peak, Steadiness(True, 0.0, 0.0, 1), test.waited * tau / omega, 0.0, 0.0, 0)


def score(each: Bench) -> Score:
    """Measure with the program, and compare with the truth."""
    references = [_settled(test, omega, linear=True) for omega, test in ((each.omega, each.bare), *each.others)]
    sensors = checked(SensorUncertainty(ACCURACY, RANGES, each.calibration), references)
    tests = references[0], _settled(each.coupled, each.omega, linear=False)
    specimen = NOMINAL.coupled(each.specimen.label or 0.0)
    block = ASKED.laser_block or 0.0
    conditions = Conditions(each.omega, specimen, CONFIGURATION.known, tests[0], sensors, frame=FRAME, block=block)
    point = judge(tests[1], conditions, 1)
    assert point.alpha_2 is not None
    assert point.alpha_2_uncertainty is not None
    stated = predict_gain(each.specimen, each.omega, tests[1].peak.amplitude, tests[0].peak.amplitude).rocking
    assert stated is not None
    return Score(
        specimen=point.alpha_2 / stated.alpha_2 - 1.0,
        motion=point.alpha_2 * each.bare.drift / each.coupled.drift - 1.0,
        u=0.5 * point.alpha_2_uncertainty / point.alpha_2,
        point=point,
    )


def scored(seed: int, case: Case, omega: float, beta: float, *, campaign: bool = False) -> Score | Omitted:
    """One bench, measured; omitted as well where the motion is on the other branch, which has another gain."""
    found = bench(seed, case, omega, beta, campaign=campaign)
    if isinstance(found, Omitted):
        return found
    one = score(found)
    return one if one.point.status is PointStatus.STEADY else Omitted(one.point.status.value)


def harmonic(benches: int, first: int, points: Sequence[tuple[float, float]], cases: Sequence[Case]) -> None:
    print(
        "case                     point          n   U [%]  covered   rms e/u  bias/u   "
        "| ratio of the motion: covered, rms e/u | largest parts [%]"
    )
    for case in cases:
        for omega, beta in points:
            found = [scored(seed, case, omega, beta) for seed in range(first, first + benches)]
            scores = [one for one in found if isinstance(one, Score)]
            print(f"{case.name:24s} {omega:5.1f} {beta:5.2f}  {summary(scores)}", flush=True)


def summary(scores: Sequence[Score]) -> str:
    u = np.array([each.u for each in scores])
    errors, moved = (np.array([getattr(each, name) for each in scores]) / u for name in ("specimen", "motion"))
    parts = [{n: p / (each.point.alpha_2 or 1.0) for n, p in _parts(each.point).items()} for each in scores]
    means = {name: 100.0 * rms([each.get(name, 0.0) for each in parts]) for name in parts[0]}
    largest = sorted(means.items(), key=lambda part: -part[1])[:5]
    return (
        f"{u.size:4d}  {200.0 * rms(u):5.2f}  {np.mean(np.abs(errors) <= 2.0):6.1%}   {rms(errors):6.2f}   "
        f"{errors.mean():+6.2f}   | {np.mean(np.abs(moved) <= 2.0):6.1%} {rms(moved):5.2f} | "
        + ", ".join(f"{name} {size:.3f}" for name, size in largest)
    )


def _parts(point: HarmonicPoint) -> dict[str, float]:
    return {name: float(size) for name, size in json.loads(point.uncertainty_parts).items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=int, default=40)
    parser.add_argument("--first", type=int, default=0, help="number of the first bench: seeds follow it")
    parser.add_argument("--points", nargs="+", default=[f"{omega},{beta}" for omega, beta in POINTS])
    parser.add_argument("--only", nargs="+", choices=list(CASES), default=list(CASES), help="cases")
    parser.add_argument("--budget", action="store_true", help="the default sensors, sources switched off one by one")
    parser.add_argument("--record", help="under this synthetic record instead of under sines")
    parser.add_argument("--beta", nargs="+", type=float, default=ASKED.beta, help="stiffness ratios under the record")
    parser.add_argument(
        "--source",
        choices=("motion", "check", "data sheet"),
        default="motion",
        help="under the record, what the linearity errors of lasers without calibration are known from",
    )
    parser.add_argument(
        "--periods", nargs="+", type=float, default=[], help="under the record, periods of the linearity errors"
    )
    asked = parser.parse_args()
    if asked.record is None and (asked.beta is not ASKED.beta or asked.source != "motion" or asked.periods):
        parser.error("--beta, --source and --periods apply to --record")
    if asked.record is not None:
        seismic(asked.benches, asked.record, asked.beta, asked.periods, asked.source)
        return
    points = [(float(omega), float(beta)) for omega, beta in (each.split(",") for each in asked.points)]
    cases = [CASES[name] for name in asked.only]
    if asked.budget:
        cases = [replace(CASES["default"], name=f"only {name}", off=frozenset(SOURCES) - {name}) for name in SOURCES]
    harmonic(asked.benches, asked.first, points, cases)


if __name__ == "__main__":
    main()
