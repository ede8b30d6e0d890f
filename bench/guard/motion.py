"""Checks of every block against the limits of table motion, shaker load and specimen, sample by sample."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import DRIFT
from bench.guard.conversion import Extremes
from bench.guard.limits import Limits, Persistence, Violation
from bench.guard.quantities import WatchedQuantities, largest
from bench.guard.shaker import ShakerModel
from drivers.rig import Channel
from sim.channel import COIL_CURRENT, TABLE_ACCELERATION, TABLE_DISPLACEMENT, TABLE_FORCE
from sim.errors import InvalidInput

Array = NDArray[np.float64]

WATCHED = {
    "displacement": ("table displacement", "m"),
    "velocity": ("table velocity", "m/s"),
    "acceleration": ("table acceleration", "m/s2"),
    "force": ("force on the table", "N"),
    "current": ("coil current", "A"),
    "heating": ("coil heating", "A"),
    "laser_range": ("share of the laser's range", "1"),
    "drift": ("drift", "m"),
}
"""Label and unit of each limited quantity of table, shaker, lasers and specimen."""


_MEASURED_BY = {
    "displacement": TABLE_DISPLACEMENT,
    "acceleration": TABLE_ACCELERATION,
    "force": TABLE_FORCE,
    "current": COIL_CURRENT,
}
"""Channel that measures each quantity directly; a limit beyond its range could never trip."""

_OF_TABLE = frozenset({"displacement", "velocity", "acceleration", "force", "current"})
"""Quantities of the table itself, which should vanish once the drive is zero."""


@dataclass(frozen=True)
class ChannelLimit:
    """Limit on the magnitude of a further channel's signal, in `column` of the signals, relative to its zero at rest.

    `warning` is the fraction of the limit at which the operator is warned, `debounce` the time for which the limit must
    be exceeded before it trips [s].
    """

    name: str
    unit: str
    column: int
    limit: float
    warning: float
    debounce: float


class MotionWatch:
    """Check of blocks of values against the limits. Channels are found by name; absent ones are not checked.

    `further` are the limits on the signals of further channels, `laser_ranges` those of `WatchedQuantities`. Raises
    InvalidInput for a limit that its channel cannot measure.
    """

    def __init__(
        self,
        channels: tuple[Channel, ...],
        sample_rate: float,
        limits: Limits,
        shaker: ShakerModel | None = None,
        further: Sequence[ChannelLimit] = (),
        laser_ranges: Sequence[float] | None = None,
    ) -> None:
        _check_reach(channels, limits, further)
        self._quantities = WatchedQuantities(channels, sample_rate, limits.heating_time, shaker, laser_ranges)
        self._limits = {key: float(getattr(limits, key)) for key in WATCHED}
        self._warn_at = {key: limit * float(getattr(limits.warning, key)) for key, limit in self._limits.items()}
        debounce = {key: round(float(getattr(limits.debounce, key)) * sample_rate) for key in WATCHED}
        self._names = dict(WATCHED)
        self._further = further
        for each in further:
            self._names[each.name] = each.name, each.unit
            self._limits[each.name], self._warn_at[each.name] = each.limit, each.warning * each.limit
            debounce[each.name] = round(each.debounce * sample_rate)
        self._cut = frozenset[str](limits.cut)
        self._over = {key: Persistence(samples) for key, samples in debounce.items()}
        self._near = {key: Persistence(samples) for key, samples in debounce.items()}
        self._quiet_below = {key: min(limit, self._warn_at[key]) for key, limit in self._limits.items()}
        self._counting = False
        self._warned: set[str] = set()
        self._latest: tuple[NDArray[np.float64], Mapping[str, float]] | None = None
        self.drift_watched = False
        """Whether the drift is tared and the lasers are aimed at their storeys."""

    @property
    def heat(self) -> float:
        """Exponential mean of the squared current [A2] up to the last block; 0 for an unknown shaker."""
        return self._quantities.heat

    def warm(self, heat: float) -> None:
        """Set the exponential mean of the squared current before the first block to `heat` [A2]."""
        self._quantities.warm(heat)

    def magnitudes(self) -> dict[str, float]:
        """Largest magnitudes in the last block, by key in `WATCHED`; for each laser and further channel, by name.

        They are computed on request, because most blocks are not displayed.
        """
        return {} if self._latest is None else self._quantities.displayed(*self._latest)

    def check(
        self,
        first: int,
        values: NDArray[np.float64],
        signals: NDArray[np.float64],
        extremes: Extremes | None = None,
    ) -> tuple[list[Violation], list[Violation]]:
        """Return the limits that a block exceeds, and those whose warning level it reaches for the first time.

        Values have shape (n, n_channels), signals (n, n_signals). If `extremes` are given, a block below all warning
        levels is accepted on their basis alone, unless the debounce count of an earlier condition is above zero.
        """
        if extremes is not None and not self._counting and self._quiet(values, signals, extremes):
            return [], []
        exceeded: list[Violation] = []
        near: list[Violation] = []
        sizes = self._quantities.of(values)
        if self.drift_watched:
            sizes["drift"] = np.abs(np.nan_to_num(signals[:, DRIFT]))
        for each in self._further:
            # a missing value counts as beyond every limit, because the converter is then probably saturated
            sizes[each.name] = np.nan_to_num(np.abs(signals[:, each.column]), nan=np.inf)
        peaks = {key: float(np.max(size, initial=0.0)) for key, size in sizes.items()}
        self._latest = values, peaks
        for key, size in sizes.items():
            at = self._over[key].first(size > self._limits[key])
            if at is not None:
                exceeded.append(self._violation(key, size, self._limits[key], first, at))
            elif key not in self._warned and (at := self._near[key].first(size > self._warn_at[key])) is not None:
                self._warned.add(key)
                near.append(self._violation(key, size, self._limits[key], first, at))
        self._counting = any(
            over.counting or (self._near[key].counting and key not in self._warned) for key, over in self._over.items()
        )
        return exceeded, near

    def _quiet(self, values: NDArray[np.float64], signals: NDArray[np.float64], extremes: Extremes) -> bool:
        """Whether a block is below all warning levels; if so, the block is skipped."""
        bounds = self._quantities.bounds(values, extremes)
        if self.drift_watched:
            bounds["drift"] = largest(signals[:, DRIFT])
        for each in self._further:
            bounds[each.name] = largest(signals[:, each.column])
        for key, bound in bounds.items():
            # a comparison with NaN is false, so a block with NaN is not quiet
            if not bound <= self._quiet_below[key]:
                return False
        self._quantities.skip(values, bounds)
        self._latest = values, bounds
        return True

    def _violation(self, key: str, size: NDArray[np.float64], limit: float, first: int, at: int) -> Violation:
        name, unit = self._names[key]
        return Violation(name, float(size[at]), limit, unit, first + at, key in _OF_TABLE, cuts=key in self._cut)


def _check_reach(channels: tuple[Channel, ...], limits: Limits, further: Sequence[ChannelLimit]) -> None:
    by_name = {channel.name: channel for channel in channels}
    for each in further:
        reach = min(-by_name[each.name].limits[0], by_name[each.name].limits[1])
        if each.limit > reach:
            allowed = f"the channel {each.name} measures only up to {reach:.4g} {each.unit}"
            raise InvalidInput(f"channels.{each.name}.limit", each.limit, allowed)
    for key, name in _MEASURED_BY.items():
        if (channel := by_name.get(name)) is None:
            continue
        limit, reach = float(getattr(limits, key)), min(-channel.limits[0], channel.limits[1])
        if limit > reach:
            allowed = f"the channel {name} measures only up to {reach:.4g} {channel.unit}"
            raise InvalidInput(f"limits.{key}", limit, allowed)
