"""Models of the instruments from motion to counts: lasers, accelerometer, displacement sensor and converter.

Each instrument is a group of parameters. The method `stream` starts a laser, which has internal state; the other models
are functions of the samples. The results do not depend on how the ticks are divided into blocks, if every instrument
has a separate random generator.
"""

from math import floor
from typing import Literal

import numpy as np
from numpy.random import Generator, SeedSequence
from numpy.typing import NDArray

from sim.parameters import Parameters, quantity

Array = NDArray[np.float64]


PORTION = 4096
"""Number of normal numbers drawn at once from each generator."""


class NormalNumbers:
    """Standard normal numbers from several generators, drawn in large portions, since each call takes as long as
    a hundred numbers. They are the same as with one call per use.
    """

    def __init__(self, *generators: Generator) -> None:
        self._generators = generators
        self._drawn = np.empty((len(generators), 0))
        self._used = 0

    def take(self, n: int) -> Array:
        """The next `n` numbers of each generator, shape (generators, n)."""
        if self._used + n > self._drawn.shape[1]:
            rest = self._drawn[:, self._used :]
            more = max(PORTION, n) - rest.shape[1]
            drawn = np.empty((len(self._generators), rest.shape[1] + more))
            drawn[:, : rest.shape[1]] = rest
            for row, each in zip(drawn, self._generators, strict=True):
                each.standard_normal(out=row[rest.shape[1] :])
            self._drawn = drawn
            self._used = 0
        taken = self._drawn[:, self._used : self._used + n]
        self._used += n
        return taken


class Laser(Parameters):
    """Triangulation laser similar to the optoNCDT 1420, read at its analogue output. The reading at rest is mid range.

    The current is 4 mA at the start and 20 mA at the end of the measuring range, with a reserve of 1 % at both ends
    (manuals of the optoNCDT 1420 and of related sensors). The number of bits of the output and the error current are
    not clearly documented and are therefore parameters.
    """

    measuring_range: float = quantity(0.200, "m", "measuring range; the storey rests at mid range", gt=0)
    rate: float = quantity(4000.0, "1/s", "measurements per second, timed by the laser's free-running clock", gt=0)
    clock_error: float = quantity(20e-6, "1", "relative error of the laser's clock", gt=-0.01, lt=0.01)
    latency: int = quantity(2, "1", "number of measurements between exposure and output", ge=0, le=100)
    output_bits: int = quantity(
        12, "1", "resolution [bit] of the analogue output over the measuring range", ge=8, le=24
    )
    noise: float = quantity(5e-6, "m", "standard deviation of a measurement", ge=0)
    linearity: float = quantity(
        0.0008, "1", "amplitude of the smooth linearity error, relative to the measuring range", ge=0, lt=0.1
    )
    linearity_periods: float = quantity(
        1.5, "1", "number of periods of the linearity error in the measuring range", ge=0, formerly="linearity_waves"
    )
    scale_error: float = quantity(0.0, "1", "relative error of the sensitivity", gt=-0.5, lt=0.5)
    load: float = quantity(500.0, "ohm", "load resistor that converts the current to a voltage", gt=0)
    error_current: float = quantity(0.0030, "A", "output current without a valid measurement", ge=0)
    reference: Literal["ground", "table"] = quantity(
        "ground", "", "mounting of the laser: on the ground it measures x + u, on the table u"
    )

    @property
    def nominal(self) -> tuple[float, float]:
        """Scale [m/V] and offset [m] from the data sheet: displacement = scale * volts + offset."""
        slope = self.measuring_range / (0.016 * self.load)
        return slope, -slope * 0.004 * self.load - 0.5 * self.measuring_range

    @property
    def valid_volts(self) -> tuple[float, float]:
        """Range of voltages of valid measurements [V], from 3.8 to 20.2 mA, including the reserve."""
        return 0.0038 * self.load, 0.0202 * self.load

    def stream(self, sample_rate: float, seed: SeedSequence) -> "LaserStream":
        """Running laser whose output is sampled at `sample_rate` [1/s]."""
        return LaserStream(self, sample_rate, seed)


class LaserStream:
    """Running laser, which converts the target's motion at the ticks to the output at the ticks. `state` is for
    `sim.kernel.instruments`, which reads all instruments at once.
    """

    def __init__(self, laser: Laser, sample_rate: float, seed: SeedSequence) -> None:
        from sim.kernel.laser import LaserState, measure

        self._measure = measure
        random = np.random.default_rng(seed)
        phase = float(random.uniform())
        wave_phase = float(random.uniform(0.0, 2.0 * np.pi))
        constants = np.array(
            [
                laser.measuring_range,
                1.0 + laser.scale_error,
                laser.linearity,
                laser.linearity_periods,
                wave_phase,
                2.0**laser.output_bits,
                laser.load,
                laser.error_current,
                laser.noise,
            ]
        )
        clock = np.array([laser.rate * (1.0 + laser.clock_error) / sample_rate, phase, 1.0 / sample_rate])
        counters = np.array([0, floor(-phase) - laser.latency], dtype=np.int64)
        self.state = LaserState(constants, clock, counters, np.zeros(2), np.empty(laser.latency + 1))
        self._normals = NormalNumbers(random)

    def noise(self, ticks: int) -> Array:
        """Standard normal numbers for the measurements that are new at the end of the next `ticks`, shape (m,)."""
        (tick, following), (per_tick, phase, _) = self.state.counters.tolist(), self.state.clock.tolist()
        newest = floor((tick + ticks - 1) * per_tick - phase)
        return self._normals.take(newest + 1 - following)[0]

    def read(self, displacement: Array, velocity: Array) -> Array:
        """Output [V] at each tick, shape (n,), for the position [m] and velocity [m/s] of the target, shape (n,)."""
        volts = np.empty(displacement.size)
        if volts.size:
            self._measure(self.state, self.noise(displacement.size), displacement, velocity, volts)
        return volts


class LinearSensor(Parameters):
    """Sensor with a proportional voltage output."""

    sensitivity: float
    noise_density: float
    scale_error: float = quantity(0.0, "1", "relative error of the sensitivity", gt=-0.5, lt=0.5)

    @property
    def nominal(self) -> tuple[float, float]:
        """Scale [unit/V] and offset [unit] from the calibration: value = scale * volts + offset."""
        return 1.0 / self.sensitivity, 0.0

    def constants(self, sample_rate: float) -> tuple[float, float, float]:
        """Standard deviation of the noise [unit], white up to half the `sample_rate` [1/s], sensitivity [V/unit] and
        voltage at zero [V].
        """
        return self.noise_density * (0.5 * sample_rate) ** 0.5, self.sensitivity * (1.0 + self.scale_error), 0.0

    def volts(self, value: Array, sample_rate: float, random: Generator) -> Array:
        """Output [V] for values in the sensor's unit, same shape."""
        level, slope, zero = self.constants(sample_rate)
        return (random.standard_normal(value.size) * level + value) * slope + zero


class Accelerometer(LinearSensor):
    """Servo or MEMS accelerometer on the table, usable down to zero frequency."""

    sensitivity: float = quantity(1.0, "V s2/m", "volts per m/s2 as calibrated", gt=0)
    noise_density: float = quantity(2e-4, "m/s2/Hz^0.5", "amplitude spectral density of the white noise", ge=0)


class DisplacementSensor(LinearSensor):
    """Displacement transducer between table and ground."""

    sensitivity: float = quantity(100.0, "V/m", "volts per metre as calibrated", gt=0)
    noise_density: float = quantity(5e-7, "m/Hz^0.5", "amplitude spectral density of the white noise", ge=0)


Place = Literal["table", "storey 1", "storey 2", "elsewhere"]
SIMULATED = ("acceleration", "velocity", "displacement")
"""Quantities that a sensor of the simulated bench can measure."""


class PlacedSensor(LinearSensor):
    """Additional sensor with a proportional voltage output, for the motion of `place` relative to the ground."""

    name: str = quantity(..., "", "name of the sensor's channel")
    measures: str = quantity(..., "", "measured quantity: acceleration, velocity or displacement")
    unit: str = quantity(..., "", "SI unit of the values")
    place: Place = quantity(..., "", "part on which the sensor is mounted")
    sensitivity: float = quantity(..., "V/unit", "volts per unit as calibrated")
    zero: float = quantity(0.0, "V", "output voltage when the measured quantity is zero")
    noise_density: float = quantity(0.0, "unit/Hz^0.5", "amplitude spectral density of the white noise", ge=0)

    @property
    def nominal(self) -> tuple[float, float]:
        return 1.0 / self.sensitivity, -self.zero / self.sensitivity

    def constants(self, sample_rate: float) -> tuple[float, float, float]:
        level, slope, _ = super().constants(sample_rate)
        return level, slope, self.zero


class Converter(Parameters):
    """Analogue-to-digital converter, which saturates beyond its range."""

    bits: int = quantity(14, "1", "resolution", ge=8, le=16)
    range: float = quantity(10.0, "V", "largest input magnitude", gt=0)
    noise: float = quantity(0.0004, "V", "standard deviation of a sample due to input noise", ge=0)
    clock_error: float = quantity(0.0, "1", "relative error of the sample clock", gt=-0.01, lt=0.01)

    @property
    def lsb(self) -> float:
        """Volts per count."""
        return 2.0 * self.range / 2**self.bits

    @property
    def codes(self) -> tuple[int, int]:
        """Lowest and highest count."""
        return -(2 ** (self.bits - 1)), 2 ** (self.bits - 1) - 1

    def counts(self, volts: Array, random: Generator) -> NDArray[np.int16]:
        """Convert the voltages of all channels to counts, same shape (n, n_channels)."""
        from sim.kernel.filter import digitise

        normal = random.standard_normal(volts.shape).reshape(len(volts), -1)
        # each channel is contiguous in memory, as the following steps require
        by_channel = np.ascontiguousarray(volts.reshape(normal.shape).T)
        found = np.empty(by_channel.shape, dtype=np.int16)
        digitise(by_channel, normal, self.noise, self.lsb, *self.codes, found)
        return found.T.reshape(volts.shape, order="A")
