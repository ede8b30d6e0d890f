"""Simulated bench: shaker, specimen and instruments, from drive voltage to counts."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.random import SeedSequence
from numpy.typing import NDArray
from pydantic import model_validator

from sim.arrangement import Arrangement, sights, targets
from sim.channel import STOREYS, TABLE_ACCELERATION, TABLE_DISPLACEMENT, Channel
from sim.errors import InvalidInput
from sim.filter_unit import FilterUnit
from sim.parameters import Parameters, quantity
from sim.sensors import Accelerometer, Converter, DisplacementSensor, Laser, NormalNumbers, PlacedSensor
from sim.shaker import Shaker
from sim.specimen import Specimen

Array = NDArray[np.float64]

_LONGEST_STEP = 5.0e-4
"""Longest integration step [s]; its error in two seconds of violent rocking is below 1e-8 m."""
_STEPS_PER_TIME_CONSTANT = 5
"""Smallest number of steps within the shaker's shortest time constant."""
_PLACES = ("table", "storey 1", "storey 2")
_LET_GO = 3.0, 5.0
"""Shortest and longest time from the arming of the rig to the release of a hand-held block or frame [s]."""


class VirtualBenchParameters(Parameters):
    """Parameters of everything on the bench except the specimen."""

    sample_rate: float = quantity(2000.0, "1/s", "samples per second of drive and inputs", gt=0, le=20_000)
    catch_angle: float = quantity(0.35, "rad", "rotation at which a strap catches the toppling block", gt=0, lt=1.0)
    shaker: Shaker = Shaker()
    displacement_sensor: DisplacementSensor = DisplacementSensor()
    accelerometer: Accelerometer = Accelerometer()
    laser_1: Laser = Laser()
    laser_2: Laser = Laser()
    filter_unit: FilterUnit = FilterUnit()
    converter: Converter = Converter()

    @property
    def tick_rate(self) -> float:
        """True number of samples per second, which differs from `sample_rate` by the error of the sample clock."""
        return self.sample_rate * (1.0 + self.converter.clock_error)

    @model_validator(mode="after")
    def _check_cutoff(self) -> "VirtualBenchParameters":
        rate = self.sample_rate
        if self.filter_unit.cutoff >= 0.5 * rate:
            allowed = f"it must be below half the sample rate, {rate / 2:g} Hz (sample_rate = {rate:g} 1/s)"
            raise InvalidInput("filter_unit.cutoff", self.filter_unit.cutoff, allowed)
        return self

    @model_validator(mode="after")
    def _check_references(self) -> "VirtualBenchParameters":
        if self.laser_1.reference != self.laser_2.reference:
            allowed = (
                f"the drift requires one reference for both lasers, but laser_1.reference = {self.laser_1.reference!r}"
            )
            raise InvalidInput("laser_2.reference", self.laser_2.reference, allowed)
        return self


@dataclass(frozen=True)
class Truth:
    """True motion at the ticks of the last block, without errors of instruments: arrays of shape (n,), in SI units.

    `x`, `v` and `a` are those of the table; `a` is the mean acceleration since the previous tick.
    """

    x: Array
    v: Array
    a: Array
    u1: Array
    u2: Array
    v1: Array
    v2: Array
    theta: Array
    omega: Array


class VirtualBench:
    """Bench that converts drive voltage to counts, tick by tick, for any duration.

    The channels of the `further` sensors follow those of table and lasers. All random numbers depend on `seed`: the
    same seed and drive give the same counts, however the drive is divided into blocks. Tick i of a block is sampled
    just before its drive sample takes effect. A part held by hand is released between two ticks, without an initial
    velocity, a few seconds after `arm`.
    """

    def __init__(
        self, parameters: VirtualBenchParameters, specimen: Specimen, seed: int, further: Sequence[PlacedSensor] = ()
    ) -> None:
        from sim.kernel import table
        from sim.kernel.instruments import digitise_motion

        self._kernel, self._digitise_motion = table, digitise_motion
        self.parameters = parameters
        self._further = tuple(further)
        # the first generators do not depend on the number of sensors
        sources = SeedSequence(seed).spawn(7 + len(self._further))
        rate = parameters.tick_rate
        force, displacement, accelerometer = (np.random.default_rng(source) for source in sources[:3])
        self._force_noise = NormalNumbers(force)
        self._force_level = parameters.shaker.force_noise * (0.5 * rate) ** 0.5
        self._hand_random = np.random.default_rng(sources[6])
        randoms = [np.random.default_rng(source) for source in sources[7:]]
        self._linear_noise = NormalNumbers(displacement, accelerometer, *randoms)
        linear = parameters.displacement_sensor, parameters.accelerometer, *self._further
        self._linear = np.array([sensor.constants(rate) for sensor in linear])
        self._laser_1 = parameters.laser_1.stream(rate, sources[3])
        self._laser_2 = parameters.laser_2.stream(rate, sources[4])
        self._input_noise = NormalNumbers(np.random.default_rng(sources[5]))
        self._velocities = np.zeros(3)
        self._held_for: int | None = None
        self._cards = parameters.filter_unit.stream(rate).state(len(self._linear) + 2)
        step = min(_LONGEST_STEP, parameters.shaker.shortest_time / _STEPS_PER_TIME_CONSTANT)
        self._substeps = ceil(1.0 / (rate * step) - 1e-9)
        self._state = np.zeros(table.STATES)
        self._carried = np.zeros(2)
        self._mode = table.REST
        self._samples = np.zeros((0, table.COLUMNS))
        self.mount(Arrangement(specimen))

    @property
    def arrangement(self) -> Arrangement:
        """Specimen on the table, with its present clamps and manual restraints."""
        return self._arrangement

    @property
    def specimen(self) -> Specimen:
        """Specimen on the table."""
        return self._arrangement.specimen

    @property
    def fallen(self) -> bool:
        """Whether the block is held by its catch."""
        return self._mode == self._kernel.FALLEN and self._arrangement.tilt == 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Input channels in column order, with nominal calibrations that do not include simulated scale errors."""
        p, lsb = self.parameters, self.parameters.converter.lsb
        lowest, highest = (code + inward for code, inward in zip(p.converter.codes, (1, -1), strict=True))
        linear = (
            (TABLE_DISPLACEMENT, "displacement", "m", p.displacement_sensor, "simulated displacement sensor"),
            (TABLE_ACCELERATION, "acceleration", "m/s2", p.accelerometer, "simulated accelerometer"),
        )
        channels = [
            Channel(name, kind, unit, lsb * sensor.nominal[0], sensor.nominal[1], (lowest, highest), device)
            for name, kind, unit, sensor, device in linear
        ]
        for name, laser in zip(STOREYS, (p.laser_1, p.laser_2), strict=True):
            slope, offset = laser.nominal
            low, high = (round(volts / lsb) for volts in laser.valid_volts)
            valid = max(low, lowest), min(high, highest)
            channels.append(Channel(name, "displacement", "m", lsb * slope, offset, valid, "simulated optoNCDT 1420"))
        for sensor in self._further:
            slope, offset = sensor.nominal
            device = f"simulated, on {sensor.place}"
            kind, unit = sensor.measures, sensor.unit
            channels.append(Channel(sensor.name, kind, unit, lsb * slope, offset, (lowest, highest), device))
        return tuple(channels)

    @property
    def truth(self) -> Truth:
        """True motion at the ticks of the last `run` or `coast`."""
        x, v, u1, u2, v1, v2, theta, omega, a = self._samples.T
        return Truth(x=x, v=v, a=a, u1=u1, u2=u2, v1=v1, v2=v2, theta=theta, omega=omega)

    @property
    def sights(self) -> Array:
        """True motion of the lasers' targets in the last `run` or `coast`, shape (4, n); see `sim.arrangement`."""
        return sights(self._samples, self._arrangement, self._grounded)

    @property
    def _grounded(self) -> bool:
        # both lasers have the same reference, as the parameters require
        return self.parameters.laser_1.reference == "ground"

    def run(self, volts: Array) -> NDArray[np.int16]:
        """Play `volts` [V], shape (n,), and return the counts sampled at the same ticks, shape (n, n_channels)."""
        n, channels, converter = volts.size, len(self._linear) + 2, self.parameters.converter
        counts = np.empty((channels, n), dtype=np.int16)
        if n > 0:
            self._move(volts)
            self._digitise_motion(
                targets(self._samples, self._arrangement),
                self._grounded,
                self._further_values(),
                self._linear_noise.take(n),
                self._linear,
                self._laser_1.state,
                self._laser_1.noise(n),
                self._laser_2.state,
                self._laser_2.noise(n),
                self._cards,
                self._input_noise.take(n * channels).reshape(n, channels),
                converter.noise,
                converter.lsb,
                *converter.codes,
                counts,
            )
        return counts.T

    def coast(self, seconds: float) -> None:
        """Simulate the bench at zero drive without sampling."""
        self._move(np.zeros(max(1, round(seconds * self.parameters.tick_rate))))

    def mount(self, arrangement: Arrangement) -> None:
        """Set up this arrangement with the specimen at rest; a block held by its catch is put upright.

        The table stops at its present position, or is locked at mid stroke. Raises InvalidInput, without changing
        anything, if the block would be held by hand beyond the angle of its catch.
        """
        catch = self.parameters.catch_angle
        if abs(arrangement.tilt) >= catch:
            raise InvalidInput(
                "tilt", arrangement.tilt, f"its magnitude must be below the catch angle of {catch:g} rad"
            )
        self._arrange(arrangement)
        self._held_for = None
        self._state[1:] = 0.0
        self._velocities[:] = 0.0
        self._state[2:4] = arrangement.storeys()
        self._state[6] = arrangement.tilt
        if arrangement.table_locked:
            self._state[0] = 0.0
        self._carried[:] = 0.0
        # a block held by hand is as fixed as one held by the catch
        self._mode = self._kernel.REST if arrangement.tilt == 0.0 else self._kernel.FALLEN

    def arm(self) -> None:
        """Arm the bench: a part held by hand is released 3 to 5 s later."""
        if self._arrangement.held:
            self._held_for = round(self._hand_random.uniform(*_LET_GO) * self.parameters.tick_rate)

    def disarm(self) -> None:
        """Disarm the bench: a part that is still held by hand will not be released."""
        self._held_for = None

    def _arrange(self, arrangement: Arrangement) -> None:
        self._arrangement = arrangement
        self._plant = arrangement.plant(self.parameters.shaker, self.parameters.catch_angle)

    def _let_go(self) -> None:
        """Release block and frame from rest."""
        if self._arrangement.tilt != 0.0:
            self._mode = self._kernel.ROCK_A if self._arrangement.tilt > 0.0 else self._kernel.ROCK_B
        self._arrange(self._arrangement.let_go())
        self._held_for = None

    def _move(self, volts: Array) -> None:
        shaker, n = self.parameters.shaker, volts.size
        # numpy's clip takes several times as long for short blocks
        limited = np.minimum(np.maximum(volts, -shaker.drive_range), shaker.drive_range)
        requests = shaker.gain * np.ascontiguousarray(limited, dtype=np.float64)
        noise = self._force_level * self._force_noise.take(n)[0]
        self._samples = np.empty((n, self._kernel.COLUMNS))
        start = 0
        if self._held_for is not None and self._held_for < n:
            start = self._held_for
            self._stream(slice(0, start), requests, noise)
            self._let_go()
        self._stream(slice(start, n), requests, noise)
        if self._held_for is not None:
            self._held_for -= n

    def _stream(self, ticks: slice, requests: Array, noise: Array) -> None:
        """Advance through some of the ticks of a block."""
        self._mode = self._kernel.stream(
            self._plant,
            1.0 / self.parameters.tick_rate,
            self._substeps,
            requests[ticks],
            noise[ticks],
            self._mode,
            self._state,
            self._carried,
            self._samples[ticks],
        )

    def _further_values(self) -> Array:
        """Values at the further sensors [unit], shape (m, n)."""
        if not self._further:
            return np.empty((0, 0))
        motion = self._motion(self._samples.T)
        return np.array([motion[sensor.measures][_PLACES.index(sensor.place)] for sensor in self._further])

    def _motion(self, s: Array) -> dict[str, Array]:
        """Displacement, velocity and acceleration of table and storeys relative to the ground, each of shape (3, n).

        The acceleration of a storey is the mean since the previous tick, from the difference of the velocities that the
        kernel returns.
        """
        x, v, u1, u2, v1, v2, _, _, a = s
        velocity = np.stack((v, v + v1, v + v2))
        before = np.column_stack((self._velocities, velocity[:, :-1]))
        self._velocities = velocity[:, -1].copy()
        acceleration = (velocity - before) * self.parameters.tick_rate
        acceleration[0] = a
        return {"displacement": np.stack((x, x + u1, x + u2)), "velocity": velocity, "acceleration": acceleration}
