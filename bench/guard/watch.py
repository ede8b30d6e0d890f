"""Watches the measured motion of the table, sample by sample, for anything beyond its limits."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.guard.limits import Limits
from drivers.rig import Channel
from sim.errors import InvalidInput

VELOCITY_WINDOW = 0.02
"""Time over which the table's velocity is differenced [s]: long against the noise, short against the motion."""


@dataclass(frozen=True)
class Violation:
    """`quantity` reached `value` where `limit` is allowed, in `unit`; the sample's index since arming."""

    quantity: str
    value: float
    limit: float
    unit: str
    sample: int

    def __str__(self) -> str:
        return f"{self.quantity} {self.value:.4g} {self.unit} exceeds {self.limit:.4g} {self.unit}"


class _Persistence:
    """A count that rises by one with each bad sample and falls by one with each good one, never below zero.

    A condition that is interrupted now and then still reaches the limit; a single spike does not.
    """

    def __init__(self, samples: int) -> None:
        self._needed = max(samples, 1)
        self._level = 0

    def first(self, bad: NDArray[np.bool_]) -> int | None:
        """Index of the sample at which the count reaches the limit, or None."""
        if self._level == 0 and not bad.any():
            return None
        walk = self._level + np.cumsum(np.where(bad, 1, -1))
        level = walk - np.minimum(np.minimum.accumulate(walk), 0)
        self._level = min(int(level[-1]), self._needed)
        reached = np.flatnonzero(level >= self._needed)
        return int(reached[0]) if reached.size else None


class MotionWatch:
    """Checks blocks of values against the limits. Channels are found by name; absent ones are not watched.

    A table channel without a value counts as beyond its limit: a converter at its rail says nothing but "more".
    Raises InvalidInput for a limit that its channel cannot measure.
    """

    def __init__(self, channels: tuple[Channel, ...], sample_rate: float, limits: Limits) -> None:
        self._names = [channel.name for channel in channels]
        self._limits = limits
        self._displacement = _column(channels, "table_displacement", limits.displacement, "limits.displacement")
        self._acceleration = _column(channels, "table_acceleration", limits.acceleration, "limits.acceleration")
        self._span = max(round(VELOCITY_WINDOW * sample_rate), 1)
        self._span_time = self._span / sample_rate
        self._tail = np.zeros(0)
        debounce = round(limits.debounce * sample_rate)
        self._over = {key: _Persistence(debounce) for key in ("displacement", "velocity", "acceleration")}
        self._lost = [_Persistence(round(limits.sensor_loss * sample_rate)) for _ in channels]

    def check(self, first: int, values: NDArray[np.float64]) -> Violation | None:
        """The first violation in a block of values, shape (n, n_channels), or None."""
        found = self._motion(values)
        invalid = np.isnan(values)
        for column, name in enumerate(self._names):
            at = self._lost[column].first(invalid[:, column])
            if at is not None:
                loss = self._limits.sensor_loss
                found.append(Violation(f"time without a valid sample of {name}", loss, loss, "s", at))
        if not found:
            return None
        worst = min(found, key=lambda violation: violation.sample)
        return Violation(worst.quantity, worst.value, worst.limit, worst.unit, first + worst.sample)

    def _motion(self, values: NDArray[np.float64]) -> list[Violation]:
        found: list[Violation] = []
        if self._displacement is not None:
            x = values[:, self._displacement]
            self._compare("displacement", x, self._limits.displacement, "m", found)
            long = _filled(np.concatenate((self._tail, x)))
            if long.size > self._span:
                speed = (long[self._span :] - long[: -self._span]) / self._span_time
                self._compare("velocity", speed[-x.size :], self._limits.velocity, "m/s", found)
            self._tail = long[-self._span :]
        if self._acceleration is not None:
            self._compare("acceleration", values[:, self._acceleration], self._limits.acceleration, "m/s2", found)
        return found

    def _compare(self, key: str, values: NDArray[np.float64], limit: float, unit: str, found: list[Violation]) -> None:
        size = np.where(np.isnan(values), np.inf, np.abs(values))
        at = self._over[key].first(size > limit)
        if at is not None:
            found.append(Violation(f"table {key}", float(size[at]), limit, unit, at))


def _column(channels: tuple[Channel, ...], name: str, limit: float, item: str) -> int | None:
    for column, channel in enumerate(channels):
        if channel.name == name:
            reach = min(-channel.limits[0], channel.limits[1])
            if limit > reach:
                raise InvalidInput(item, limit, f"the channel {name} measures up to {reach:.4g} {channel.unit} only")
            return column
    return None


def _filled(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Missing samples take the value of the last valid one."""
    missing = np.isnan(x)
    if not missing.any():
        return x
    last = np.maximum.accumulate(np.where(missing, 0, np.arange(x.size)))
    return np.nan_to_num(x[last])
