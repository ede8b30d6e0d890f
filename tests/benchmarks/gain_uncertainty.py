"""Whether the stated uncertainty of a measured alpha_2 is honest, and how large it is at the default sensor settings.

    python -m tests.benchmarks.gain_uncertainty [--trials 20] [--record l-aquila]

The exact steady motions of the solver (or the exact motion under a record), bare and coupled, are shown to the virtual
lasers, filter cards and converter: each trial draws the phase of the linearity error and the clock of each laser, its
scale (0.1 % between the two), where the storeys rest, noise, and the scale of the table's sensors (0.5 %). The peaks
are found as the protocols find them, with and without a calibration, which is measured on the same lasers. The truth is
the solver's. Printed for each point: the mean expanded uncertainty, the largest part, the rms error over the standard
uncertainty, and the share of intervals that hold the truth; the bound of a transient that may be left is in the first
and not in the last two, for there is none here.
"""

import argparse
import json
from collections import Counter
from math import hypot, tau

import numpy as np

from bench.accelerograms.reference import RecordReference
from bench.analysis.gain import gain, steady_peak
from bench.analysis.laser_calibration import LaserCalibration
from bench.analysis.sensor_accuracy import SensorUncertainty
from bench.analysis.table_motion import at_rest_in_the_end, table_motion
from protocols.earthquake.measurement import observe
from protocols.earthquake.uncertainty import drift_errors
from protocols.harmonic.measurement import AMPLITUDE_STEP, LEFT
from protocols.harmonic.protocol import HarmonicParameters
from sim.excitation import SampledRecord
from sim.gain import predict_gain
from sim.rocking import simulate
from sim.specimen import Specimen
from tests.benchmarks.gain_sensors import ACCURACY, RANGES, RATE, REST, Array, Motion, Sensors, cycles_of, rms, steady

LOWEST, STRENGTH = 0.8, 1.3
"""Lowest frequency of a record [Hz], and its peak over the uplift acceleration."""


def harmonic(trials: int) -> None:
    asked, specimen = HarmonicParameters(), Specimen()
    level = asked.amplitude_factor * specimen.uplift_acceleration
    sensors = [Sensors(seed) for seed in range(trials)]
    found = [each.calibrated() for each in sensors]
    print("calibrated: error of the differential scale over its standard uncertainty, rms:", _scales(sensors, found))
    for calibrations in ([None] * trials, found):
        print("\nwith a calibration" if calibrations[0] else "by the data sheets alone")
        print("omega  beta   alpha_2  S    U [%]  without the table [%]  largest part        error/u  held  bias [%]")
        off: list[float] = []
        for omega in asked.omega:
            bare = steady(specimen.bare(), omega, level, asked.measured_cycles)
            references = [
                steady_peak(cycles_of(each.signals(bare, one), omega)[: asked.measured_cycles], omega)
                for each, one in zip(sensors, calibrations, strict=True)
            ]
            for beta in asked.beta:
                coupled = specimen.coupled(beta)
                moved = steady(coupled, omega, level, asked.measured_cycles)
                layers = [predict_gain(coupled, omega, level * (1 + k * AMPLITUDE_STEP)).rocking for k in (-1, 1)]
                slope = 0.0
                if layers[0] and layers[1]:
                    slope = np.log(layers[1].alpha_2 / layers[0].alpha_2) / (2.0 * AMPLITUDE_STEP)
                true = moved.drift / bare.drift
                sizes, largest, errors, here = [], Counter[str](), [], []
                for each, one, reference_ in zip(sensors, calibrations, references, strict=True):
                    doubt = SensorUncertainty(ACCURACY, RANGES, one)
                    peak = steady_peak(cycles_of(each.signals(moved, one), omega)[: asked.measured_cycles], omega)
                    result = gain(peak, reference_, doubt, slope)
                    # the gain that belongs to the amplitude that is stated
                    stated = each.table * (one.table_acceleration if one else 1.0)
                    error = result.alpha_2 / (true * stated**slope) - 1.0
                    u = result.uncertainty / result.alpha_2
                    table = abs(slope) * doubt.table_scale
                    left = 2.0 * LEFT * asked.settle_tolerance * np.sqrt(2.0 / 3.0)
                    sizes.append((hypot(u, left), hypot(np.sqrt(u**2 - 4.0 * table**2), left)))
                    largest[result.budget.dominating] += 1
                    errors.append(2.0 * error / u)
                    here.append(result.alpha_2 / true - 1.0)
                off += errors
                first, second = 100.0 * np.mean(sizes, axis=0)
                print(
                    f"{omega:5.1f}  {beta:4.2f}  {true:7.4f}  {slope:5.2f}  {first:5.2f}  {second:5.2f}"
                    f"                {largest.most_common(1)[0][0]:25s} {rms(errors):6.2f}  "
                    f"{np.mean(np.abs(errors) <= 2.0):5.0%}  {100.0 * np.mean(here):6.3f}"
                )
        print(f"all: rms error/u {rms(off):.2f}, held {np.mean(np.abs(off) <= 2.0):.1%}, n {len(off)}")


def _scales(sensors: list[Sensors], found: list[LaserCalibration]) -> str:
    """What the corrected lasers still differ by over their common span, against the lasers themselves."""
    errors = []
    for each, one in zip(sensors, found, strict=True):
        spans = []
        for number, curve in enumerate(one.lasers):
            stream = each.lasers[number].stream(RATE, each.seeds[number])
            phase = float(stream._constants[4])
            x = np.array([-0.04, 0.04]) + each.rest[number]
            shown = x * (1.0 + each.lasers[number].scale_error)
            shown += 0.2 * 0.0008 * np.sin(tau * 1.5 * x / 0.2 + phase)
            spans.append(float(np.diff(curve.corrected(shown))[0] / 0.08))
        errors.append((spans[1] - spans[0]) / one.differential_uncertainty)
    return f"{rms(errors):.2f}"


def table_record(acceleration: Array, dt: float) -> Array:
    """What a table with a short stroke makes of a record: without the motion below LOWEST, at rest in the end."""
    from scipy import signal

    high = signal.butter(4, LOWEST, "highpass", fs=1.0 / dt, output="sos")
    quiet = np.zeros(round(2.0 / dt))
    return at_rest_in_the_end(signal.sosfiltfilt(high, np.concatenate((quiet, acceleration, quiet))), dt)


def seismic(trials: int, name: str) -> None:
    record = RecordReference.parse(f"synthetic:{name}").read()
    specimen = Specimen()
    acceleration = table_record(record.acceleration, record.dt)
    acceleration *= STRENGTH * specimen.uplift_acceleration / np.abs(acceleration).max()
    motions = {
        beta: _under(specimen if beta is None else specimen.coupled(beta), acceleration, record.dt)
        for beta in (None, *HarmonicParameters().beta)
    }
    for calibrated in (False, True):
        print("\nwith a calibration" if calibrated else "\nby the data sheets alone")
        for beta in HarmonicParameters().beta:
            bare, coupled = motions[None], motions[beta]
            true, sizes, errors, largest = coupled.drift / bare.drift, [], [], Counter[str]()
            for seed in range(trials):
                each = Sensors(seed)
                one = each.calibrated() if calibrated else None
                seen = tuple(observe(each.signals(motion, one), REST, RATE).drift for motion in (bare, coupled))
                drawn = drift_errors((seen[0], seen[1]), SensorUncertainty(ACCURACY, RANGES, one), 4000, seed)
                parts = {part: float(np.std((1 + e[1]) / (1 + e[0]))) for part, e in drawn.items()}
                together = np.sum(list(drawn.values()), axis=0)
                u = float(np.std((1.0 + together[1]) / (1.0 + together[0])))
                largest[max(parts, key=lambda part: parts[part])] += 1
                sizes.append(2.0 * u)
                errors.append((seen[1].peak.value / seen[0].peak.value / true - 1.0) / u)
            print(
                json.dumps(
                    {
                        "record": name,
                        "beta": beta,
                        "alpha_2": round(true, 4),
                        "U [%]": round(100.0 * float(np.mean(sizes)), 3),
                        "largest": largest.most_common(1)[0][0],
                        "rms error/u": round(rms(errors), 2),
                        "held": round(float(np.mean(np.abs(errors) <= 2.0)), 3),
                    }
                )
            )


def _under(specimen: Specimen, acceleration: Array, dt: float) -> Motion:
    t = np.arange(0.0, (acceleration.size - 1) * dt, 1.0 / RATE)
    a = np.interp(t, np.arange(acceleration.size) * dt, acceleration)
    moved = simulate(specimen, SampledRecord(acceleration, dt), sample_times=t, tolerance=1e-9).samples
    assert moved is not None
    assert len(moved) == len(t), "the block topples"
    velocity, displacement = table_motion(a, 1.0 / RATE)
    return Motion(displacement, velocity, a, *(moved[:, k] for k in range(4)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--record", help="under this synthetic record instead of under sines")
    arguments = parser.parse_args()
    if arguments.record is None:
        harmonic(arguments.trials)
    else:
        seismic(arguments.trials, arguments.record)
