"""Meters of the limited quantities: present magnitude, limit, peak, planned value, and time to the limit."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, nan

from bench.app.display import texts
from bench.app.display.typography import in_screen_unit
from bench.config.model import BenchConfiguration
from bench.preflight.margins import Margin, bounds
from sim.channel import STOREYS

SPAN = 2.0
"""Length [s] of each of the two consecutive windows whose peaks give the growth of a quantity."""
GROWTH, NEAR = 0.02, 0.3
"""Smallest relative growth between the windows, and smallest fraction of the limit, for which a time to the limit is
stated.
"""
SOON = 60.0
"""Longest stated time to a limit [s]."""
WARNED = 0.9
"""Fraction of its limit at or above which a quantity without a declared warning level is marked."""
HIDDEN = ("drive_voltage", "drive_slew")
"""Limits without a meter: they apply to the command, which is checked before output, not to a measured signal."""


@dataclass
class Meter:
    """Magnitude of a quantity and its `limit`, both in SI units.

    warning : share of the limit at or above which the quantity is marked.
    planned : share of the limit below which 95 % of the specimens are predicted to stay; NaN if not predicted.
    """

    key: str
    name: str
    unit: str
    limit: float
    warning: float = WARNED
    planned: float = nan
    value: float = nan
    peak: float = 0.0
    _past: deque[tuple[float, float]] = field(default_factory=lambda: deque[tuple[float, float]]())

    def add(self, time: float, value: float) -> None:
        """Add the largest magnitude of a block at bench time `time` [s]."""
        if self._past and time < self._past[-1][0]:
            self._past.clear()
        self.value, self.peak = value, max(self.peak, value)
        self._past.append((time, value))
        while self._past[0][0] < time - 2.0 * SPAN:
            self._past.popleft()

    @property
    def time_to_limit(self) -> float:
        """Time [s] in which the quantity reaches its limit at the present rate of growth; infinite if it grows by less
        than `GROWTH`, is below `NEAR` times its limit, or has been recorded for less than 1.5 `SPAN`.
        """
        if not self._past:
            return inf
        newest = self._past[-1][0]
        if newest - self._past[0][0] < 1.5 * SPAN:
            return inf
        late = max((value for time, value in self._past if time > newest - SPAN), default=nan)
        early = max((value for time, value in self._past if time <= newest - SPAN), default=nan)
        if not late > (1.0 + GROWTH) * early or late < NEAR * self.limit:
            return inf
        return max(self.limit - late, 0.0) * SPAN / (late - early)

    @property
    def level(self) -> str:
        """Level (colour) of the meter for the present magnitude."""
        share = self.value / self.limit
        return "alarm" if share >= 1.0 else "wait" if share >= self.warning else "good"

    @property
    def text(self) -> str:
        """Magnitude and limit in the displayed unit."""
        factor, unit = (100.0, "%") if self.unit == "1" else in_screen_unit(self.unit)
        value = f"{factor * self.value:.3g}" if isfinite(self.value) else texts.NO_VALUE
        return f"{value} / {factor * self.limit:.3g} {unit}"

    @property
    def explanation(self) -> str:
        """All numbers of the meter, for its tooltip."""
        factor, unit = (100.0, "%") if self.unit == "1" else in_screen_unit(self.unit)
        planned = texts.NO_VALUE if not isfinite(self.planned) else f"{factor * self.planned * self.limit:.3g} {unit}"
        peak = f"{factor * self.peak:.3g} {unit}"
        return texts.METER_TIP.format(name=self.name, text=self.text, peak=peak, planned=planned)


def meters_of(configuration: BenchConfiguration, margins: Sequence[Margin] = ()) -> list[Meter]:
    """Meters of a bench; `margins` are those of the planned run, and determine the planned values."""
    likely = {each.bound.quantity: each.demand.likely for each in margins if each.demand.likely is not None}
    found = [
        Meter(
            key,
            texts.METERS.get(key, bound.name),
            bound.unit,
            bound.limit,
            float(getattr(configuration.limits.warning, "laser_range" if key in STOREYS else key, WARNED)),
            likely[key] / bound.limit if key in likely else nan,
        )
        for key, bound in bounds(configuration).items()
        if key not in HIDDEN
    ]
    further = [
        Meter(channel.name, channel.name.replace("_", " "), channel.unit, channel.limit)
        for channel in configuration.channels
        if channel.limit is not None
    ]
    return [*found, *further]
