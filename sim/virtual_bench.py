"""The bench without the laboratory: shaker, specimen and instruments, from drive volts to counts."""

from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING

import numpy as np
from numpy.random import SeedSequence
from numpy.typing import NDArray
from pydantic import model_validator

from sim.channel import Channel
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity
from sim.sensors import Accelerometer, Converter, DisplacementSensor, FilterUnit, Laser
from sim.shaker import Shaker
from sim.specimen import Specimen

if TYPE_CHECKING:
    from sim.kernel.plant import Plant

Array = NDArray[np.float64]

_LONGEST_STEP = 5.0e-4
"""Longest integration step [s]; its error in two seconds of violent rocking is below 1e-8 m."""
_STEPS_PER_TIME_CONSTANT = 5
"""Steps within the shortest time constant of the shaker, should that ask for more."""


class VirtualBenchParameters(Parameters):
    """Everything on the bench but the specimen."""

    sample_rate: float = quantity(2000.0, "1/s", "samples per second of drive and inputs", gt=0, le=20_000)
    catch_angle: float = quantity(0.35, "rad", "rotation at which a strap catches the toppling block", gt=0, lt=1.0)
    shaker: Shaker = Shaker()
    displacement_sensor: DisplacementSensor = DisplacementSensor()
    accelerometer: Accelerometer = Accelerometer()
    laser_1: Laser = Laser()
    laser_2: Laser = Laser()
    filter_unit: FilterUnit = FilterUnit()
    converter: Converter = Converter()

    @model_validator(mode="after")
    def _filter_below_half_the_sample_rate(self) -> "VirtualBenchParameters":
        if self.filter_unit.cutoff >= 0.5 * self.sample_rate:
            raise InvalidInput(
                "filter_unit.cutoff",
                self.filter_unit.cutoff,
                f"it must be below sample_rate / 2 = {self.sample_rate / 2}",
            )
        return self

    @model_validator(mode="after")
    def _lasers_stand_together(self) -> "VirtualBenchParameters":
        if self.laser_1.reference != self.laser_2.reference:
            allowed = f"the drift needs both lasers in one place, laser_1.reference = {self.laser_1.reference!r}"
            raise InvalidInput("laser_2.reference", self.laser_2.reference, allowed)
        return self


@dataclass(frozen=True)
class Truth:
    """What really happened at the ticks of the last block, arrays of shape (n,): for tests, not for users."""

    x: Array
    v: Array
    a: Array
    u1: Array
    u2: Array
    v1: Array
    v2: Array
    theta: Array


def plant_of(specimen: Specimen, shaker: Shaker, catch_angle: float) -> "Plant":
    """The constants of the moving system as `sim.kernel.table` takes them."""
    from sim.kernel.plant import Plant

    f, k, (c1, c2) = specimen.frame, specimen.block, specimen.frame.dashpots
    standing = specimen.beta is not None
    return Plant(
        m1=f.m1,
        m2=f.m2,
        k1=f.k1,
        k2=f.k2,
        c1=c1,
        c2=c2,
        h1=f.h1,
        k_c=specimen.k_c,
        d=specimen.d,
        b=k.b,
        h_b=k.h_b,
        mass=k.mass if standing else 0.0,
        inertia=k.inertia,
        restitution=k.restitution,
        g=specimen.g,
        catch_angle=catch_angle,
        moving_mass=shaker.moving_mass,
        k_s=shaker.k_s,
        c_s=shaker.c_s,
        friction=shaker.friction,
        friction_velocity=shaker.friction_velocity,
        half_stroke=shaker.half_stroke,
        stop_stiffness=shaker.stop_stiffness,
        stop_damping=shaker.stop_damping,
        bl=shaker.bl,
        resistance=shaker.resistance,
        holds_current=1.0 if shaker.amplifier == "current" else 0.0,
        voltage_limit=shaker.voltage_limit,
        current_limit=shaker.current_limit,
        lag=shaker.amplifier_lag,
    )


class VirtualBench:
    """A bench that turns drive volts into counts, tick by tick, without end.

    Everything random comes from `seed`; the same seed and drive give the same counts, however the drive is cut
    into blocks. Tick i of a block is sampled just before its drive sample takes effect.
    """

    def __init__(self, parameters: VirtualBenchParameters, specimen: Specimen, seed: int) -> None:
        from sim.kernel import table

        self._kernel = table
        self.parameters = parameters
        sources = SeedSequence(seed).spawn(6)
        rate = parameters.sample_rate
        self._force_random, self._displacement_random, self._accelerometer_random = (
            np.random.default_rng(source) for source in sources[:3]
        )
        self._laser_1 = parameters.laser_1.stream(rate, sources[3])
        self._laser_2 = parameters.laser_2.stream(rate, sources[4])
        self._converter_random = np.random.default_rng(sources[5])
        self._filter = parameters.filter_unit.stream(rate)
        step = min(_LONGEST_STEP, parameters.shaker.shortest_time / _STEPS_PER_TIME_CONSTANT)
        self._substeps = ceil(1.0 / (rate * step) - 1e-9)
        self._state = np.zeros(table.STATES)
        self._carried = np.zeros(2)
        self._mode = table.REST
        self._samples = np.zeros((0, table.COLUMNS))
        self.mount(specimen)

    @property
    def specimen(self) -> Specimen:
        """What stands on the table."""
        return self._specimen

    @property
    def fallen(self) -> bool:
        """Whether the block hangs in its catch."""
        return self._mode == self._kernel.FALLEN

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The inputs in the order of the columns, with the nominal calibrations: scale errors are not known to it."""
        p, lsb = self.parameters, self.parameters.converter.lsb
        lowest, highest = (code + inward for code, inward in zip(p.converter.codes, (1, -1), strict=True))
        linear = (
            ("table_displacement", "displacement", "m", p.displacement_sensor, "simulated displacement sensor"),
            ("table_acceleration", "acceleration", "m/s2", p.accelerometer, "simulated accelerometer"),
        )
        channels = [
            Channel(name, kind, unit, lsb * sensor.nominal[0], sensor.nominal[1], (lowest, highest), device)
            for name, kind, unit, sensor, device in linear
        ]
        for name, laser in (("laser_1", p.laser_1), ("laser_2", p.laser_2)):
            slope, offset = laser.nominal
            low, high = (round(volts / lsb) for volts in laser.valid_volts)
            valid = max(low, lowest), min(high, highest)
            channels.append(Channel(name, "displacement", "m", lsb * slope, offset, valid, "simulated optoNCDT 1420"))
        return tuple(channels)

    @property
    def truth(self) -> Truth:
        """The motion at the ticks of the last `run` or `coast`."""
        s = self._samples
        return Truth(x=s[:, 0], v=s[:, 1], a=s[:, 8], u1=s[:, 2], u2=s[:, 3], v1=s[:, 4], v2=s[:, 5], theta=s[:, 6])

    def run(self, volts: Array) -> NDArray[np.int16]:
        """Play `volts`, shape (n,) [V], and return the counts sampled meanwhile, shape (n, 4)."""
        if volts.size == 0:
            return np.empty((0, 4), dtype=np.int16)
        self._move(volts)
        filtered = self._filter.read(self._sense())
        return self.parameters.converter.counts(filtered.T, self._converter_random)

    def coast(self, seconds: float) -> None:
        """Let the bench move at zero drive without sampling it."""
        self._move(np.zeros(max(1, round(seconds * self.parameters.sample_rate))))

    def mount(self, specimen: Specimen) -> None:
        """Put `specimen` on the table, standing still; the table is steadied where it is."""
        self._specimen = specimen
        self._plant = plant_of(specimen, self.parameters.shaker, self.parameters.catch_angle)
        self._state[1:] = 0.0
        self._carried[:] = 0.0
        self._mode = self._kernel.REST

    def stand_up(self) -> None:
        """Stand the block up again and steady everything."""
        self.mount(self._specimen)

    def _move(self, volts: Array) -> None:
        p = self.parameters
        reach = p.shaker.drive_range
        requests = p.shaker.gain * np.clip(np.ascontiguousarray(volts, dtype=np.float64), -reach, reach)
        noise_level = p.shaker.force_noise * (0.5 * p.sample_rate) ** 0.5
        noise = noise_level * self._force_random.standard_normal(volts.size)
        self._samples = np.empty((volts.size, self._kernel.COLUMNS))
        self._mode = self._kernel.stream(
            self._plant,
            1.0 / p.sample_rate,
            self._substeps,
            requests,
            noise,
            self._mode,
            self._state,
            self._carried,
            self._samples,
        )

    def _sense(self) -> Array:
        """Voltages at the filter cards, shape (4, n)."""
        p, s = self.parameters, np.ascontiguousarray(self._samples.T)
        volts = np.empty((4, s.shape[1]))
        volts[0] = p.displacement_sensor.volts(s[0], p.sample_rate, self._displacement_random)
        volts[1] = p.accelerometer.volts(s[8], p.sample_rate, self._accelerometer_random)
        for row, u, laser, stream in ((2, 2, p.laser_1, self._laser_1), (3, 3, p.laser_2, self._laser_2)):
            on_ground = laser.reference == "ground"
            volts[row] = stream.read(s[u] + s[0] if on_ground else s[u], s[u + 2] + s[1] if on_ground else s[u + 2])
        return volts
