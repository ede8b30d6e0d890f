"""Rounding errors of fitted peaks, against the known motion of simulated lasers behind filter and converter."""

from dataclasses import replace
from math import tau

import numpy as np
import pytest
from numpy.random import SeedSequence

from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.analysis.gain import SensorAccuracy, steady_peak
from bench.analysis.rounding_correction import FEWEST, MODEL, Rounding, rounding
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.signals import DRIFT, LASER_1, SIGNALS
from bench.analysis.steady import Steadiness
from protocols.common.sine.settling import Settled
from protocols.harmonic.conditions import Conditions
from sim.filter_unit import FilterUnit
from sim.knowledge import SpecimenKnowledge
from sim.sensors import Converter, Laser
from sim.specimen import Specimen
from tests.bench.calibrated import calibration

RATE, OMEGA, CYCLES, ORDERS = 2000.0, 20.0, 24, 5
STEP = 0.2 / 2**12
NOISE = 4e-7
"""Standard deviation of the peak [m] due to the noise of the samples, without rounding errors."""


def measured(seed: int, swing: float, bits: int = 12, cutoff: float = 100.0) -> tuple[list[Cycle], float, float]:
    """Cycles of laser 1 reading a sine of `swing` steps with a third harmonic while laser 2 reads 0, the phase of the
    sine's peak [rad], and the error of the fitted harmonics there [m].
    """
    random = np.random.default_rng(seed)
    first = 0.5 * swing * STEP * random.uniform(0.97, 1.03) * np.exp(1j * random.uniform(0.0, tau))
    third = 0.05 * abs(first) * np.exp(1j * random.uniform(0.0, tau))
    t = np.arange(round((CYCLES + 6) * tau / OMEGA * RATE)) / RATE
    motion = first * np.exp(1j * OMEGA * t), third * np.exp(3j * OMEGA * t)
    x, v = motion[0] + motion[1], 1j * OMEGA * (motion[0] + 3.0 * motion[1])
    rest, laser = random.uniform(-1e-3, 1e-3), Laser(linearity=0.0, output_bits=bits)
    volts = laser.stream(RATE, SeedSequence(seed)).read(x.real + rest, v.real.copy())
    counts = Converter().counts(FilterUnit(cutoff=cutoff).stream(RATE).read(volts[None]).T, random)
    scale, offset = laser.nominal
    readings = counts * Converter().lsb * scale + offset - rest
    analyser = CycleAnalyser(OMEGA, RATE, round(3 * tau / OMEGA * RATE))
    values = np.zeros((t.size, len(SIGNALS) + 1))
    values[:, LASER_1], values[:, DRIFT] = readings[:, 0], -readings[:, 0]
    cycles = analyser.push(values[analyser.first :])[:CYCLES]
    fitted = np.mean([-1j * cycle.harmonics(LASER_1)[:ORDERS] for cycle in cycles], axis=0)
    # the phase of the fundamental includes the delay of laser and filter
    phase = -float(np.angle(fitted[0]))
    true = abs(first) + (third * np.exp(-3j * np.angle(first))).real
    return cycles, phase, float((fitted @ np.exp(1j * phase * np.arange(1, ORDERS + 1))).real - true)


def estimated(cycles: list[Cycle], phase: float, step: float = STEP) -> Rounding | None:
    return rounding(cycles, OMEGA, LASER_1, phase, ORDERS, step)


# 50 um is the resolution of the data sheet, 2 % larger than a step
@pytest.mark.parametrize(
    ("swing", "cutoff", "step", "share", "motions"),
    [
        (24.0, 100.0, STEP, 0.4, 8),
        pytest.param(18.5, 100.0, STEP, 0.75, 60, marks=pytest.mark.soak),
        pytest.param(60.0, 100.0, 5e-5, 0.45, 8, marks=pytest.mark.soak),
        (200.0, 300.0, 5e-5, 0.6, 8),
    ],
)
def test_most_of_the_error_is_found_and_the_rest_is_stated(
    swing: float, cutoff: float, step: float, share: float, motions: int
) -> None:
    errors, found = list[float](), list[Rounding]()
    for seed in range(motions):
        cycles, phase, error = measured(seed, swing, cutoff=cutoff)
        errors.append(error)
        estimate = estimated(cycles, phase, step)
        assert estimate is not None
        found.append(estimate)
    before, after = np.array(errors), np.array(errors) - [each.error for each in found]
    assert after.std() < share * before.std()
    stated = np.array([each.variance for each in found]) + MODEL**2 * before.var() + NOISE**2
    assert 0.55 < np.sqrt(np.mean(after**2 / stated)) < 1.35


def test_fine_steps_are_not_corrected() -> None:
    cycles, phase, _ = measured(1, 60.0, bits=20)
    found = estimated(cycles, phase)
    assert found is not None
    assert abs(found.error) < 0.01 * STEP


def test_a_motion_of_few_steps_or_with_missing_samples_has_no_estimate() -> None:
    cycles, phase, _ = measured(1, 0.9 * FEWEST)
    assert estimated(cycles, phase) is None
    cycles, phase, _ = measured(1, 60.0)
    assert estimated([replace(cycles[0], samples=cycles[0].samples - 1), *cycles[1:]], phase) is None


def test_the_peak_of_the_drift_is_corrected_if_the_lasers_are_calibrated() -> None:
    cycles, _, _ = measured(1, 60.0)
    peak = steady_peak(cycles, OMEGA)
    sensors = SensorUncertainty(SensorAccuracy(laser_resolution=STEP), (0.2, 0.2))
    reference = Settled(peak, Steadiness(True, 0.0, 0.0, 1), 60.0, 0.0, 0.0, 0)
    conditions = Conditions(OMEGA, Specimen().coupled(0.25), SpecimenKnowledge(), reference, sensors)
    assert conditions.corrected(peak) == (peak, conditions)
    calibrated = replace(sensors, calibration=calibration(-0.05, 0.05))
    corrected, _ = replace(conditions, sensors=calibrated).corrected(peak)
    fitted = peak.readings.fitted
    assert fitted is not None
    found = estimated(cycles, fitted.phase)
    assert found is not None
    # a larger reading of laser 1 is a smaller drift
    assert corrected.drift == pytest.approx(peak.drift + peak.readings.sign * found.error, rel=1e-12)
    assert corrected.readings.drift == corrected.drift
    left = corrected.readings.fitted
    assert left is not None
    before, after = fitted.variances(STEP), left.variances(STEP)
    assert after[0] == pytest.approx(found.variance + MODEL**2 * before[0])
    assert after[0] < 0.3 * before[0]
    # laser 2 does not move, so that nothing is known of its steps
    assert after[1] == before[1]
