"""A rig backend: a table of mass, spring and dashpot with a rigid specimen, in virtual or real time."""

from math import tau

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from bench.config.backend import CommonSettings, RigBackend, RigSettings
from drivers.clock import Clock, VirtualClock, WallClock
from drivers.computed import ComputedRig
from drivers.rig import Channel
from sim.parameters import quantity

FULL_SCALE = {"table_displacement": 0.1, "table_acceleration": 50.0, "laser_1": 0.1, "laser_2": 0.1}
"""Largest value of each channel [m, m/s2]; the lasers are on the ground and measure the table's displacement."""
COUNTS = 2**15 - 1


class LinearTable(RigSettings):
    """The table: x'' + 2 zeta w x' + w^2 x = gain * volts."""

    acceleration_range: float | None = quantity(50.0, "m/s2", "range of the accelerometer", gt=0)
    gain: float = quantity(2.0, "m/s2/V", "acceleration per volt far above the natural frequency", gt=0, le=100)
    natural_frequency: float = quantity(0.5, "Hz", "natural frequency of the table", gt=0, le=50)
    damping: float = quantity(0.7, "1", "damping ratio of the table", gt=0, le=2)
    noise: float = quantity(1.0, "1", "standard deviation of every channel's noise, in counts", ge=0, le=100)
    seed: int = quantity(1, "", "seed of the noise", ge=0)


class LinearTableRig(ComputedRig):
    """The table behind `drivers.rig.Rig`: each output is a digital filter of the drive, exact for a held voltage."""

    def __init__(self, settings: LinearTable, lead: int, clock: Clock) -> None:
        w, rate = tau * settings.natural_frequency, settings.sample_rate
        poles = [1.0, 2.0 * settings.damping * w, w**2]
        zeros = {"displacement": [settings.gain], "acceleration": [settings.gain, 0.0, 0.0]}
        self._filters = {
            name: tuple(np.squeeze(part) for part in cont2discrete((zero, poles), 1.0 / rate)[:2])
            for name, zero in zeros.items()
        }
        channels = tuple(
            Channel(name, *kind, scale / COUNTS, 0.0, (-COUNTS, COUNTS), "linear table")
            for name, scale in FULL_SCALE.items()
            for kind in [("acceleration", "m/s2") if "acceleration" in name else ("displacement", "m")]
        )
        description = {"backend": "linear-table", "table": f"{settings.gain:g} m/s2/V"}
        super().__init__(channels, rate, settings.drive_range, lead, clock, description)
        self._settings, self._noise = settings, np.random.default_rng(settings.seed)

    def begin(self) -> None:
        self._volts = 0.0
        self._memory = {name: np.zeros(2) for name in self._filters}

    def respond(self, volts: NDArray[np.float64]) -> NDArray[np.int16]:
        # a sample of the drive acts after the input sample of the same number
        held = np.concatenate(([self._volts], volts[:-1]))
        self._volts = float(volts[-1])
        values: dict[str, NDArray[np.float64]] = {}
        for name, (zeros, poles) in self._filters.items():
            values[name], self._memory[name] = lfilter(zeros, poles, held, zi=self._memory[name])
        measured = np.stack([values[channel.quantity] / channel.scale for channel in self.channels], axis=1)
        measured += self._settings.noise * self._noise.standard_normal(measured.shape)
        return np.clip(np.round(measured), -COUNTS - 1, COUNTS).astype(np.int16)


def open_table(configuration: CommonSettings, settings: LinearTable, realtime: bool) -> LinearTableRig:
    """The rig, paced by the wall clock or as fast as the computer allows."""
    return LinearTableRig(settings, configuration.lead_samples, WallClock() if realtime else VirtualClock())


BACKEND = RigBackend(open_table, LinearTable, real_time_only=False, operator=False)
