"""Sensors of one trial, and the exact motions that they are shown: for `gain_uncertainty`."""

from dataclasses import dataclass
from datetime import UTC, datetime
from math import tau

import numpy as np
from numpy.random import SeedSequence
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.analysis.gain import SensorAccuracy
from bench.analysis.laser_calibration import LaserCalibration
from bench.analysis.signals import SignalMap
from protocols.laser_calibration.fit import calibration, fit_curve, mean_pass
from protocols.laser_calibration.plan import planned_passes
from protocols.laser_calibration.protocol import LaserCalibrationParameters
from sim.excitation import SineProgram, Sweep
from sim.gain import predict_gain
from sim.linear import steady_response
from sim.rocking import State, simulate
from sim.sensors import Laser
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters

Array = NDArray[np.float64]

RATE, RANGES, ACCURACY = 2000.0, (0.2, 0.2), SensorAccuracy()
REST, LEAD = round(2.0 * RATE), round(0.5 * RATE)
"""Samples at rest before each motion, and of it that are left out: the filter cards ring."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Truth, shape (n,) each: table x, v, a; storeys u1, u2 and their rates [SI]."""

    x: Array
    v: Array
    a: Array
    u1: Array
    u2: Array
    v1: Array
    v2: Array

    @property
    def drift(self) -> float:
        return float(np.abs(self.u2 - self.u1).max())


class Sensors:
    """The sensors of one trial."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng([seed, 1])
        scales = 0.001 / np.sqrt(2.0) * self.random.standard_normal(2)
        self.lasers = [Laser(scale_error=float(scale)) for scale in scales]
        self.seeds = SeedSequence([seed, 2]).spawn(2)
        self.rest = self.random.uniform(-0.002, 0.002, 2)
        self.table = 1.0 + ACCURACY.table_scale * float(self.random.standard_normal())
        self.parameters = VirtualBenchParameters(laser_1=self.lasers[0], laser_2=self.lasers[1])
        self.channels = VirtualBench(self.parameters, Specimen(), 1).channels

    def shown(self, motion: Motion) -> Array:
        """Values of the channels, shape (REST + n, 4), after a rest."""
        p = self.parameters
        x, v, a, u1, u2, v1, v2 = (
            np.concatenate((np.zeros(REST), getattr(motion, name))) for name in Motion.__dataclass_fields__
        )
        volts = np.array(
            [
                p.displacement_sensor.volts(self.table * x, RATE, self.random),
                p.accelerometer.volts(self.table * a, RATE, self.random),
                # the same seed: the same laser, its clock anywhere
                self._laser(0, x + u1, v + v1),
                self._laser(1, x + u2, v + v2),
            ]
        )
        counts = p.converter.counts(p.filter_unit.stream(RATE).read(volts).T, self.random)
        return np.column_stack([channel.to_unit(counts[:, k]) for k, channel in enumerate(self.channels)])

    def _laser(self, number: int, seen: Array, speed: Array) -> Array:
        stream = self.lasers[number].stream(RATE, self.seeds[number])
        before = int(self.random.integers(0, 2000))
        here = np.concatenate((np.zeros(before), seen)) + self.rest[number]
        return stream.read(here, np.concatenate((np.zeros(before), speed)))[before:]

    def signals(self, motion: Motion, found: LaserCalibration | None) -> Array:
        values = self.shown(motion)
        signals = SignalMap(self.channels, "ground", found)
        signals.tare(values[LEAD:REST])
        return signals.of(values)

    def calibrated(self) -> LaserCalibration:
        """What a calibration finds of these sensors."""
        asked = LaserCalibrationParameters()
        passes = []
        for omega, amplitude in planned_passes(asked):
            t = np.arange(round((asked.cycles + 2) * tau / omega * RATE)) / RATE
            x, v, a = (amplitude * omega**k * np.sin(omega * t + 0.5 * k * np.pi) for k in range(3))
            zero = np.zeros(t.size)
            cycles = cycles_of(self.signals(Motion(x, v, a, zero, zero, zero, zero), None), omega)
            passes.append(mean_pass(cycles, omega))
        rests = float(self.rest[0]), float(self.rest[1])
        return calibration(
            passes,
            (fit_curve(passes, 0, rests[0]), fit_curve(passes, 1, rests[1])),
            rests,
            ("first", "second"),
            ACCURACY,
            RANGES,
            reference_linearity=asked.reference_linearity,
            valid_days=asked.valid_days,
            date=datetime.now(UTC),
        )


def rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def cycles_of(signals: Array, omega: float) -> list[Cycle]:
    return CycleAnalyser(omega, RATE, REST + LEAD).push(np.column_stack((signals, signals[:, 0]))[REST + LEAD :])


def steady(specimen: Specimen, omega: float, amplitude: float, cycles: int) -> Motion:
    """The exact steady motion, bare or rocking."""
    n = round((cycles + 1) * tau / omega * RATE) + LEAD
    t = np.arange(n) / RATE
    if specimen.beta is None:
        phase, (u1, u2) = 0.0, steady_response(specimen, omega, amplitude)
        turned = np.exp(1j * omega * t)
        storeys = [(c * turned).imag for c in (u1, u2, 1j * omega * u1, 1j * omega * u2)]
    else:
        layer = predict_gain(specimen, omega, amplitude).rocking
        assert layer is not None
        phase, *start = (float(value) for value in layer.orbit.section)
        u1, u2, v1, v2, velocity = start
        # one period again and again: an orbit that is unstable is left in time
        fine = np.arange(4097) * (tau / omega / 4096)
        drive = SineProgram([Sweep.dwell(2.0 * tau / omega, amplitude, omega)], phase)
        moved = simulate(
            specimen, drive, state=State(u1, u2, v1, v2, 0.0, velocity), sample_times=fine, tolerance=1e-11
        ).samples
        assert moved is not None
        storeys = [np.interp(t % (tau / omega), fine, moved[:, k]) for k in range(4)]
    angle = omega * t + phase
    x, v, a = (-amplitude / omega**2 * np.sin(angle), -amplitude / omega * np.cos(angle), amplitude * np.sin(angle))
    return Motion(x, v, a, *storeys)
