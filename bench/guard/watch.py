"""Watches the measured motion of the table, sample by sample, for anything beyond its limits."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.guard.limits import Limits
from drivers.rig import Channel

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
    """How long a condition has held, carried from block to block."""

    def __init__(self, samples: int) -> None:
        self._needed = max(samples, 1)
        self._held = 0

    def first(self, condition: NDArray[np.bool_]) -> int | None:
        """Index of the sample at which the condition has held long enough, or None."""
        if not condition.any():
            self._held = 0
            return None
        n = condition.size
        last_false = np.maximum.accumulate(np.where(condition, -1 - self._held, np.arange(n)))
        held = np.arange(n) - last_false
        self._held = int(held[-1])
        reached = np.flatnonzero(held >= self._needed)
        return int(reached[0]) if reached.size else None


class MotionWatch:
    """Checks blocks of values against the limits. Channels are found by name; absent ones are not watched."""

    def __init__(self, channels: tuple[Channel, ...], sample_rate: float, limits: Limits) -> None:
        names = [channel.name for channel in channels]
        self._names = names
        self._limits = limits
        self._displacement = names.index("table_displacement") if "table_displacement" in names else None
        self._acceleration = names.index("table_acceleration") if "table_acceleration" in names else None
        self._span = max(round(VELOCITY_WINDOW * sample_rate), 1)
        self._span_time = self._span / sample_rate
        self._tail = np.zeros(0)
        debounce = round(limits.debounce * sample_rate)
        self._over = {key: _Persistence(debounce) for key in ("displacement", "velocity", "acceleration")}
        self._lost = [_Persistence(round(limits.sensor_loss * sample_rate)) for _ in names]

    def check(self, first: int, values: NDArray[np.float64]) -> Violation | None:
        """The first violation in a block of values, shape (n, n_channels), or None."""
        found = self._motion(values)
        invalid = np.isnan(values)
        if invalid.any():
            for column, name in enumerate(self._names):
                at = self._lost[column].first(invalid[:, column])
                if at is not None:
                    loss = self._limits.sensor_loss
                    found.append(Violation(f"time without a valid sample of {name}", loss, loss, "s", at))
        else:
            for lost in self._lost:
                lost.first(invalid[:, 0])
        if not found:
            return None
        worst = min(found, key=lambda violation: violation.sample)
        return Violation(worst.quantity, worst.value, worst.limit, worst.unit, first + worst.sample)

    def _motion(self, values: NDArray[np.float64]) -> list[Violation]:
        found: list[Violation] = []
        if self._displacement is not None:
            x = values[:, self._displacement]
            self._compare("displacement", x, self._limits.displacement, "m", found)
            long = np.concatenate((self._tail, x))
            if long.size > self._span:
                speed = (long[self._span :] - long[: -self._span]) / self._span_time
                self._compare("velocity", speed[-x.size :], self._limits.velocity, "m/s", found)
            self._tail = long[-self._span :]
        if self._acceleration is not None:
            self._compare("acceleration", values[:, self._acceleration], self._limits.acceleration, "m/s2", found)
        return found

    def _compare(self, key: str, values: NDArray[np.float64], limit: float, unit: str, found: list[Violation]) -> None:
        at = self._over[key].first(np.abs(values) > limit)
        if at is not None:
            found.append(Violation(f"table {key}", float(abs(values[at])), limit, unit, at))
