"""Watches every block of measured values, sample by sample, for anything beyond its limit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import DRIFT
from bench.guard.limits import Limits
from bench.guard.persistence import Persistence
from bench.guard.quantities import NAMES, Mover, Quantities
from bench.guard.violation import Violation
from drivers.rig import Channel
from sim.errors import InvalidInput

_MEASURED_BY = {
    "displacement": "table_displacement",
    "acceleration": "table_acceleration",
    "force": "table_force",
    "current": "coil_current",
}
"""Quantities that are a channel's own: a limit beyond what it can measure would never be seen."""

_OF_TABLE = frozenset({"displacement", "velocity", "acceleration", "force", "current"})
"""Quantities that a drive of zero brings to zero at once."""


@dataclass(frozen=True)
class ChannelLimit:
    """The largest magnitude of a further channel's signal, in `column` of the signals, from its zero at rest.

    `warning` is the share of it from which the operator is warned, `debounce` how long it must be exceeded [s].
    """

    name: str
    unit: str
    column: int
    limit: float
    warning: float
    debounce: float


class MotionWatch:
    """Checks blocks of values against the limits. Channels are found by name; absent ones are not watched.

    `further` are the limits of the signals with these columns. Raises InvalidInput for a limit that its channel cannot
    measure.
    """

    def __init__(
        self,
        channels: tuple[Channel, ...],
        sample_rate: float,
        limits: Limits,
        mover: Mover | None = None,
        further: Sequence[ChannelLimit] = (),
    ) -> None:
        _check_reach(channels, limits, further)
        self._quantities = Quantities(channels, sample_rate, limits.heating_time, mover)
        self._limits = {key: float(getattr(limits, key)) for key in NAMES}
        self._warn_at = {key: limit * float(getattr(limits.warning, key)) for key, limit in self._limits.items()}
        debounce = {key: round(float(getattr(limits.debounce, key)) * sample_rate) for key in NAMES}
        self._names = dict(NAMES)
        self._further = further
        for each in further:
            self._names[each.name] = each.name, each.unit
            self._limits[each.name], self._warn_at[each.name] = each.limit, each.warning * each.limit
            debounce[each.name] = round(each.debounce * sample_rate)
        self._over = {key: Persistence(samples) for key, samples in debounce.items()}
        self._near = {key: Persistence(samples) for key, samples in debounce.items()}
        self._warned: set[str] = set()
        self.drift_watched = False
        """Whether the drift has a zero, and is one."""

    def check(
        self, first: int, values: NDArray[np.float64], signals: NDArray[np.float64]
    ) -> tuple[list[Violation], list[Violation]]:
        """Limits that a block exceeds, and those it comes near for the first time.

        Values have shape (n, n_channels), signals (n, n_signals).
        """
        exceeded: list[Violation] = []
        near: list[Violation] = []
        sizes = self._quantities.of(values)
        if self.drift_watched:
            sizes["drift"] = np.abs(np.nan_to_num(signals[:, DRIFT]))
        for each in self._further:
            # a converter at its rail says nothing but "more"
            sizes[each.name] = np.nan_to_num(np.abs(signals[:, each.column]), nan=np.inf)
        for key, size in sizes.items():
            at = self._over[key].first(size > self._limits[key])
            if at is not None:
                exceeded.append(self._violation(key, size, self._limits[key], first, at))
            elif key not in self._warned and (at := self._near[key].first(size > self._warn_at[key])) is not None:
                self._warned.add(key)
                near.append(self._violation(key, size, self._limits[key], first, at))
        return exceeded, near

    def _violation(self, key: str, size: NDArray[np.float64], limit: float, first: int, at: int) -> Violation:
        name, unit = self._names[key]
        return Violation(name, float(size[at]), limit, unit, first + at, key in _OF_TABLE)


def _check_reach(channels: tuple[Channel, ...], limits: Limits, further: Sequence[ChannelLimit]) -> None:
    by_name = {channel.name: channel for channel in channels}
    for each in further:
        reach = min(-by_name[each.name].limits[0], by_name[each.name].limits[1])
        if each.limit > reach:
            allowed = f"the channel {each.name} measures up to {reach:.4g} {each.unit} only"
            raise InvalidInput(f"channels.{each.name}.limit", each.limit, allowed)
    for key, name in _MEASURED_BY.items():
        if (channel := by_name.get(name)) is None:
            continue
        limit, reach = float(getattr(limits, key)), min(-channel.limits[0], channel.limits[1])
        if limit > reach:
            allowed = f"the channel {name} measures up to {reach:.4g} {channel.unit} only"
            raise InvalidInput(f"limits.{key}", limit, allowed)
