"""What the guard watches, made from the channels: motion of the table, load of the shaker, specimen."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import LASERS
from drivers.rig import Channel

Array = NDArray[np.float64]

VELOCITY_WINDOW = 0.02
"""Time over which the table's velocity is differenced [s]: long against the noise, short against the motion."""

NAMES = {
    "displacement": ("table displacement", "m"),
    "velocity": ("table velocity", "m/s"),
    "acceleration": ("table acceleration", "m/s2"),
    "force": ("force on the table", "N"),
    "current": ("coil current", "A"),
    "heating": ("coil heating", "A"),
    "laser_range": ("share of the laser's range", "1"),
    "drift": ("drift", "m"),
}
"""Every watched quantity: its name for people, and its unit."""


@dataclass(frozen=True)
class Mover:
    """What is known of the shaker: enough to estimate force and current where no channel measures them.

    `mass` is everything that moves with the table, specimen included [kg], `stiffness` that of the suspension [N/m],
    and `force_constant` that of the coil [N/A].
    """

    mass: float
    stiffness: float
    force_constant: float


class Quantities:
    """Turns blocks of channel values into the magnitudes of what is watched.

    A table channel without a value counts as infinite: a converter at its rail says nothing but "more". A laser
    without a value says nothing here: the loss of a sensor is watched apart.
    """

    def __init__(
        self, channels: tuple[Channel, ...], sample_rate: float, heating_time: float, mover: Mover | None
    ) -> None:
        self._columns = {channel.name: column for column, channel in enumerate(channels)}
        self._mover = mover
        self._span = max(round(VELOCITY_WINDOW * sample_rate), 1)
        self._span_time = self._span / sample_rate
        self._tail = np.zeros(0)
        self._forget = float(np.exp(-1.0 / (heating_time * sample_rate)))
        self._heat = np.zeros(1)
        self._middle = {name: _middle(channels[column]) for name, column in self._columns.items() if name in LASERS}

    def of(self, values: Array) -> dict[str, Array]:
        """Magnitude of each quantity that the channels tell, shape (n,), by its key in `NAMES`."""
        found: dict[str, Array] = {}
        x, a = self._column(values, "table_displacement"), self._column(values, "table_acceleration")
        if x is not None:
            found["displacement"] = _magnitude(x)
            found["velocity"] = _magnitude(self._velocity(x))
        if a is not None:
            found["acceleration"] = _magnitude(a)
        self._add_load(found, values, x, a)
        if (place := self._laser_place(values)) is not None:
            found["laser_range"] = place
        return found

    def _add_load(self, found: dict[str, Array], values: Array, x: Array | None, a: Array | None) -> None:
        force, current = self._column(values, "table_force"), self._column(values, "coil_current")
        if self._mover is not None and a is not None:
            m = self._mover
            needed = m.mass * np.nan_to_num(a)
            if force is None:
                force = needed
            if current is None:
                springs = 0.0 if x is None else m.stiffness * np.nan_to_num(x)
                current = (needed + springs) / m.force_constant
        if force is not None:
            found["force"] = _magnitude(force)
        if current is not None:
            found["current"] = _magnitude(current)
            found["heating"] = self._heating(np.nan_to_num(current))

    def _heating(self, current: Array) -> Array:
        """Root of the square current's exponential mean: what the coil's temperature follows."""
        from scipy import signal

        mean, self._heat = signal.lfilter([1.0 - self._forget], [1.0, -self._forget], current**2, zi=self._heat)
        return np.sqrt(np.asarray(mean))

    def _velocity(self, x: Array) -> Array:
        long = filled(np.concatenate((self._tail, x)))
        speed = np.zeros(x.size)
        if long.size > self._span:
            differenced = (long[self._span :] - long[: -self._span]) / self._span_time
            speed[-min(differenced.size, x.size) :] = differenced[-x.size :]
        self._tail = long[-self._span :]
        return speed

    def _laser_place(self, values: Array) -> Array | None:
        places = [
            np.abs(np.nan_to_num((values[:, self._columns[name]] - middle) / half))
            for name, (middle, half) in self._middle.items()
        ]
        return np.maximum.reduce(places) if places else None

    def _column(self, values: Array, name: str) -> Array | None:
        column = self._columns.get(name)
        return None if column is None else values[:, column]


def filled(x: Array) -> Array:
    """Missing samples take the value of the last valid one."""
    missing = np.isnan(x)
    if not missing.any():
        return x
    last = np.maximum.accumulate(np.where(missing, 0, np.arange(x.size)))
    return np.nan_to_num(x[last])


def _magnitude(x: Array) -> Array:
    return np.where(np.isnan(x), np.inf, np.abs(x))


def _middle(channel: Channel) -> tuple[float, float]:
    low, high = channel.limits
    return 0.5 * (low + high), 0.5 * (high - low)
