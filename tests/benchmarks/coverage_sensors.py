"""Benches drawn at random, and the motions that their sensors are shown: for `coverage`."""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from math import tau

import numpy as np
from numpy.random import SeedSequence
from numpy.typing import NDArray

from bench.analysis.cycles import HARMONICS as OF_SINES
from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.analysis.laser_calibration import LaserCalibration
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.signals import SignalMap
from protocols.laser_calibration.curves import HARMONICS, mean_pass
from protocols.laser_calibration.plan import planned_passes
from protocols.laser_calibration.protocol import LaserCalibrationParameters
from protocols.laser_calibration.reference import ReferenceCurve
from protocols.laser_calibration.scales import calibrate
from sim.excitation import SampledRecord
from sim.filter_unit import FilterUnit
from sim.kernel.laser import WAVE_PHASE
from sim.rocking import State, Status, simulate
from sim.sensors import Laser
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters

Array = NDArray[np.float64]

RATE, RANGES, ACCURACY = 2000.0, (0.2, 0.2), SensorAccuracy()
REST, LEAD = round(2.0 * RATE), round(0.5 * RATE)
"""Samples at rest before each motion, and of it that are left out: the filter cards ring."""


@dataclass(frozen=True)
class Case:
    """What the sensors of a case do. The linearity error of a laser has from `waves[0]` to `waves[1]` periods over its
    range; `clock` is the relative error of the sample clock, `cutoff` that of the filter cards; `noise` [m] is that of
    laser 1; `drift` the relative change of the table's amplitude during a test; `off` are sources switched off.
    """

    name: str
    calibrated: bool = False
    waves: tuple[float, float] = (1.5, 1.5)
    clock: float = 0.0
    cutoff: float = 0.0
    noise: float = 5e-6
    drift: float = 0.0
    off: frozenset[str] = field(default_factory=frozenset[str])


CASES = {
    each.name: each
    for each in (
        Case("default"),
        Case("calibrated", calibrated=True),
        Case("smooth", waves=(0.5, 2.0)),
        Case("short waves", waves=(3.0, 6.0)),
        Case("short waves, calibrated", calibrated=True, waves=(3.0, 6.0)),
        Case("clock", clock=30e-6),
        Case("amplitude drift", drift=0.002),
        Case("noisy laser", noise=100e-6),
        Case("filter", cutoff=0.1),
    )
}

CLOCK = 50e-6
"""Largest relative difference between the rates of a laser's clock and the sample clock, as of two quartz clocks."""

REFERENCE_WAVES = (0.5, 2.0)
"""Fewest and most periods of the linearity error of the table's displacement sensor over the calibrated span."""

SOURCES = ("linearity", "scales", "table", "harmonics", "transient", "truth", "steps")
"""Sources of error that `--off` switches off one by one."""


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
    """The sensors of one bench. `pause` [s] is the longest time before a motion: the longer, the less related are the
    ages of a laser's held readings in two tests.
    """

    def __init__(self, seed: int, case: Case = CASES["default"], *, pause: float = 1.0) -> None:
        self.random, self.pause = np.random.default_rng([seed, 1]), round(pause * RATE)
        self.case, on = case, {name: 0.0 if name in case.off else 1.0 for name in SOURCES}
        scales = on["scales"] * ACCURACY.laser_mismatch / np.sqrt(2.0) * self.random.standard_normal(2)
        waves = self.random.uniform(*case.waves, 2)
        noises = case.noise, Laser().noise
        self.lasers = [
            Laser(
                scale_error=float(scale),
                linearity_periods=float(wave),
                linearity=on["linearity"] * Laser().linearity,
                noise=noise,
                output_bits=12 if on["steps"] else 24,
            )
            for scale, wave, noise in zip(scales, waves, noises, strict=True)
        ]
        others = np.random.default_rng([seed, 5])
        clocks = others.uniform(-CLOCK, CLOCK, 2)
        self.lasers = [
            laser.model_copy(update={"clock_error": float(clock)})
            for laser, clock in zip(self.lasers, clocks, strict=True)
        ]
        self.reference = float(others.uniform(*REFERENCE_WAVES)), float(others.uniform(0.0, tau))
        self.seeds = SeedSequence([seed, 2]).spawn(2)
        self.rest = self.random.uniform(-0.002, 0.002, 2)
        self.table = 1.0 + on["table"] * ACCURACY.table_scale * float(self.random.standard_normal())
        unit = FilterUnit(cutoff=FilterUnit().cutoff * (1.0 + case.cutoff))
        self.parameters = VirtualBenchParameters(laser_1=self.lasers[0], laser_2=self.lasers[1], filter_unit=unit)
        self.channels = VirtualBench(self.parameters, Specimen(), 1).channels

    def shown(self, motion: Motion) -> Array:
        """Values of the channels, shape (REST + n, 4), after a rest."""
        p = self.parameters
        x, v, a, u1, u2, v1, v2 = (
            np.concatenate((np.zeros(REST), getattr(motion, name))) for name in Motion.__dataclass_fields__
        )
        x_shown = self.table * x + (self._reference_error(x) if self.case.calibrated else 0.0)
        volts = np.array(
            [
                p.displacement_sensor.volts(x_shown, RATE, self.random),
                p.accelerometer.volts(self.table * a, RATE, self.random),
                # the same seed: the same laser, its clock anywhere
                self._laser(0, x + u1, v + v1),
                self._laser(1, x + u2, v + v2),
            ]
        )
        counts = p.converter.counts(p.filter_unit.stream(RATE).read(volts).T, self.random)
        return np.column_stack([channel.to_unit(counts[:, k]) for k, channel in enumerate(self.channels)])

    def _reference_error(self, x: Array) -> Array:
        """Linearity error of the table's displacement sensor [m], with the assumed limit."""
        asked = LaserCalibrationParameters()
        span = 2.0 * max(amplitude for _, amplitude in planned_passes(asked))
        waves, phase = self.reference
        return asked.reference_linearity * span * np.sin(tau * waves * x / span + phase)

    def _laser(self, number: int, seen: Array, speed: Array) -> Array:
        stream = self.lasers[number].stream(RATE, self.seeds[number])
        before = int(self.random.integers(0, self.pause))
        # the storeys come to rest within one step of the laser's output
        rest = self.rest[number] + ACCURACY.laser_resolution * float(self.random.uniform(-0.5, 0.5))
        here = np.concatenate((np.zeros(before), seen)) + rest
        return stream.read(here, np.concatenate((np.zeros(before), speed)))[before:]

    def signals(self, motion: Motion, found: LaserCalibration | None) -> Array:
        values = self.shown(motion)
        signals = SignalMap(self.channels, "ground", found)
        signals.tare(values[LEAD:REST])
        return signals.of(values)

    def true_reference_error(self, readings: Array) -> Array:
        """Linearity error of the table's displacement sensor [m] at `readings` [m]."""
        # the error changes by less than a hundredth over its own size
        return self._reference_error((readings - self._reference_error(readings)) / self.table)

    def calibrated(self) -> tuple[LaserCalibration, ReferenceCurve]:
        """What a calibration finds of these sensors."""
        asked = LaserCalibrationParameters()
        passes = []
        for omega, amplitude in planned_passes(asked):
            t = np.arange(round((asked.cycles + 2) * tau / omega * RATE)) / RATE
            x, v, a = (amplitude * omega**k * np.sin(omega * t + 0.5 * k * np.pi) for k in range(3))
            zero = np.zeros(t.size)
            signals = self.signals(Motion(x, v, a, zero, zero, zero, zero), None)
            cycles = cycles_of(signals, omega, HARMONICS)
            passes.append(mean_pass(cycles, omega))
        found, _, reference = calibrate(
            passes,
            (float(self.reading(0, np.zeros(1))[0]), float(self.reading(1, np.zeros(1))[0])),
            ("first", "second"),
            ACCURACY,
            RANGES,
            reference_linearity=asked.reference_linearity,
            valid_days=asked.valid_days,
            date=datetime.now(UTC),
        )
        return found, reference

    def reading(self, number: int, displacement: Array) -> Array:
        """Readings of laser 0 or 1 at `displacement` [m] from rest, relative to mid range, without noise and steps."""
        laser, x = self.lasers[number], displacement + self.rest[number]
        phase = float(laser.stream(RATE, self.seeds[number]).state.constants[WAVE_PHASE])
        turns = tau * laser.linearity_periods * x / laser.measuring_range
        return x * (1.0 + laser.scale_error) + laser.measuring_range * laser.linearity * np.sin(turns + phase)


def rms(values: list[float] | Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def cycles_of(signals: Array, omega: float, harmonics: int = OF_SINES) -> list[Cycle]:
    analyser = CycleAnalyser(omega, RATE, REST + LEAD, harmonics)
    return analyser.push(np.column_stack((signals, signals[:, 0]))[REST + LEAD :])


ODD, EVEN = 0.003, 0.0003
"""Rms of the odd and the even harmonics of the controlled table, relative to its fundamental: docs/harmonic.md."""

AMPLITUDE = 0.0005
"""Standard deviation of the controlled amplitude, relative."""


def approach(
    specimen: Specimen, start: State, phase: float, omega: float, amplitude: float, cycles: int, sensors: Sensors
) -> Motion:
    """Exact motion from `start`, over so many cycles, of a table with the harmonics that its control leaves.

    A sample clock that is fast by e is a table that is slow by e: times are those of the samples.
    """
    case, random = sensors.case, sensors.random
    true, rate = omega / (1.0 + case.clock), RATE
    t = np.arange(round((cycles + 1) * tau / omega * rate) + LEAD) / rate * (1.0 + case.clock)
    amplitude *= 1.0 + AMPLITUDE * float(random.standard_normal())
    angle = true * t + phase
    x, v, a = (np.zeros(t.size) for _ in range(3))
    for k in range(1, 11):
        height, turn = amplitude, 0.0
        if k > 1:
            share = 0.0 if "harmonics" in case.off else (ODD if k % 2 else EVEN)
            height *= share * float(abs(random.standard_normal())) / 2.0
            turn = float(random.uniform(0.0, tau))
        height *= 1.0 + case.drift * (t / t[-1] - 1.0)
        a += height * np.sin(k * angle + turn)
        v -= height / (k * true) * np.cos(k * angle + turn)
        x -= height / (k * true) ** 2 * np.sin(k * angle + turn)
    moved = simulate(
        specimen, SampledRecord(a, float(t[1])), state=start, sample_times=t, peaks_from=None, tolerance=1e-9
    )
    assert moved.samples is not None
    if moved.status is not Status.COMPLETED or len(moved.samples) < t.size:
        raise RuntimeError("the block fell")
    return Motion(x, v, a, *(moved.samples[:, k] for k in range(4)))
