"""Peak drift ratio under a synthetic record, as measured by drawn sensors: for `coverage` and `audit`."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from bench.accelerograms.reference import RecordReference
from bench.analysis.linearity import LinearFrame
from bench.analysis.reading_correction import ReadingCorrection
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.table_motion import table_motion, with_final_rest
from bench.config.model import BenchConfiguration
from protocols.earthquake.laser_check import LaserCheck, laser_check
from protocols.earthquake.observation import observe
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.uncertainty import drift_errors, with_better_zero
from sim.excitation import SampledRecord
from sim.rocking import simulate
from sim.specimen import Specimen
from tests.benchmarks.coverage_sensors import ACCURACY, CASES, RANGES, RATE, REST, Array, Case, Motion, Sensors
from tests.benchmarks.estimates import Estimate, Statistics

LOWEST, STRENGTH = 0.8, 1.3
"""Lowest frequency of a record [Hz], and its peak over the uplift acceleration."""

WEAKER = {"kobe": 0.7, "el-centro": 0.9, "erzincan": 0.7, "parkfield": 1.1}
"""That of records under which the block would topple, or a storey leave the range of its laser."""

PAUSE = 60.0
"""Longest pause between the tests [s], in which the clock of a laser wanders by several measuring periods."""

DRAWS = 4000

Source = Literal["motion", "check", "data sheet"]
"""What the linearity errors of the lasers, or what a calibration leaves of them, are known from: the motion of the
second storey in both tests, the harmonics of a sine before them, or the data sheet or calibration alone."""

ASKED = EarthquakeParameters()

FRAME = LinearFrame(Specimen().bare(), grounded=True)

DISTORTION = 0.01
"""Third harmonic of the table under the sine that checks the lasers, which is not controlled."""


def table_record(acceleration: Array, dt: float) -> Array:
    """What a table with a short stroke makes of a record: without the motion below LOWEST, at rest in the end."""
    from scipy import signal

    high = signal.butter(4, LOWEST, "highpass", fs=1.0 / dt, output="sos")
    quiet = np.zeros(round(2.0 / dt))
    return with_final_rest(signal.sosfiltfilt(high, np.concatenate((quiet, acceleration, quiet))), dt)


@lru_cache(maxsize=16)
def motion_under(name: str, beta: float | None) -> Motion:
    """Motion under a synthetic record, of the specimen with the spring `beta` or of the bare frame (None)."""
    record = RecordReference.parse(f"synthetic:{name}").read()
    specimen = Specimen() if beta is None else Specimen().coupled(beta)
    acceleration = table_record(record.acceleration, record.dt)
    acceleration *= WEAKER.get(name, STRENGTH) * specimen.uplift_acceleration / np.abs(acceleration).max()
    return _moved(specimen, acceleration, record.dt)


@lru_cache(maxsize=1)
def check_and_motion() -> tuple[LaserCheck, Motion]:
    """The check of the lasers that the protocol makes, and the motion of the bare frame under it, for a table with a
    third harmonic of `DISTORTION`.
    """
    check = laser_check(EarthquakeParameters(laser_check=True), BenchConfiguration())
    assert check is not None
    sine, amplitude = check.shaking.target.acceleration, check.amplitude
    sine = sine + DISTORTION * (3.0 * sine - 4.0 * sine**3 / amplitude**2)
    return check, _moved(Specimen(), sine, 1.0 / RATE)


def _moved(specimen: Specimen, acceleration: Array, dt: float) -> Motion:
    t = np.arange(0.0, (acceleration.size - 1) * dt, 1.0 / RATE)
    a = np.interp(t, np.arange(acceleration.size) * dt, acceleration)
    moved = simulate(specimen, SampledRecord(acceleration, dt), sample_times=t, tolerance=1e-9).samples
    assert moved is not None
    assert len(moved) == len(t), "the block topples"
    velocity, displacement = table_motion(a, 1.0 / RATE)
    return Motion(displacement, velocity, a, *(moved[:, k] for k in range(4)))


@dataclass(frozen=True)
class Measured:
    """Measured peak drift ratio, and its standard uncertainties by contribution, relative."""

    estimate: Estimate
    parts: dict[str, float]


def measured(seed: int, name: str, beta: float, case: Case, source: Source = "motion") -> Measured:
    """The peak drift ratio of one bench, coupled over bare, whose linearity errors are known from this `source`, and
    from a calibration if there is one; the true one is that of the motions.
    """
    bare, coupled = motion_under(name, None), motion_under(name, beta)
    sensors = Sensors(seed, case, pause=PAUSE)
    found = sensors.calibrated()[0] if case.calibrated else None
    checks = None
    if source == "check":
        check, moved = check_and_motion()
        checks = check.evaluate(sensors.signals(moved, found)[REST:], BenchConfiguration())
    accuracy = SensorUncertainty(ACCURACY, RANGES, found).corrected_by(checks)
    signals = [sensors.signals(motion, found) for motion in (bare, coupled)]
    if source == "motion":
        accuracy = accuracy.found_in(signals, FRAME, RATE, ASKED.laser_block or 0.0)
    frame = FRAME if accuracy.shapes_known else None
    correction = ReadingCorrection(accuracy)
    tests = [observe(correction(each), REST, RATE, frame) for each in signals]
    seen = [each.drift for each in with_better_zero(tests[0], tests[1], accuracy, DRAWS, seed)]
    drawn = drift_errors((seen[0], seen[1]), accuracy, DRAWS, seed)
    together = np.sum(list(drawn.values()), axis=0)
    ratio = seen[1].peak.value / seen[0].peak.value
    return Measured(
        Estimate(ratio, ratio * _scatter(together), coupled.drift / bare.drift),
        {part: _scatter(errors) for part, errors in drawn.items()},
    )


def _scatter(errors: Array) -> float:
    """Relative standard deviation of the ratio with drawn errors of both peaks, shape (2, n)."""
    return float(np.std((1.0 + errors[1]) / (1.0 + errors[0])))


def seismic(
    trials: int, name: str, betas: Sequence[float], periods: Sequence[float] = (), source: Source = "motion"
) -> None:
    """Print the coverage under the record `name` at each stiffness ratio, with default lasers whose errors are known
    from this `source`, and calibrated ones. With `periods`, of lasers with these numbers of periods in their linearity
    error.
    """
    cases = [Case(f"{each:g} periods", waves=(each, each)) for each in periods]
    known = ["default", "calibrated"] if source == "motion" else ["default"]
    for case in cases or [CASES[each] for each in known]:
        print(f"\n{case.name}")
        for beta in betas:
            rows = [measured(seed, name, beta, case, source) for seed in range(trials)]
            largest = Counter(max(row.parts, key=lambda part: row.parts[part]) for row in rows)
            found = Statistics.of([row.estimate for row in rows])
            print(
                json.dumps(
                    {
                        "record": name,
                        "beta": beta,
                        "alpha_2": round(rows[0].estimate.truth, 4),
                        "U [%]": round(100.0 * found.relative, 3),
                        "largest": largest.most_common(1)[0][0],
                        "rms error/u": round(found.rms, 2),
                        "held": round(found.covered, 3),
                    }
                ),
                flush=True,
            )
