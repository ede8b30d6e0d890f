"""The stretch of a recording that is fitted: means over a few samples each, of every channel alike.

The mean is one linear filter on all channels: what leaves it obeys the same equations as what went in.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import floor

import numpy as np
from numpy.typing import NDArray

from sim.errors import RockbenchError

Array = NDArray[np.float64]

RATE = 200.0
"""Rate to which signals are reduced, if they are faster [1/s]: far above the modes and their harmonics."""

MOST_LOST = 0.02
"""Share of the samples of a sensor that may be missing."""


class Unusable(RockbenchError):
    """The recording does not show what the fit needs."""

    error_code = "not_measurable"


@dataclass(frozen=True, eq=False)
class Stretch:
    """`time`, shape (n,) [s], evenly spaced, from the first sample; `table` [m], shape (n,), what the table's sensor
    shows, and `seen` [m], shape (2, n), what the lasers show of storeys 1 and 2, NaN where nothing.

    `on_table` says that the lasers ride on the table and see the storeys relative to it.
    """

    time: Array
    table: Array
    seen: Array
    on_table: bool

    @property
    def step(self) -> float:
        """Time between samples [s]."""
        return float(self.time[1] - self.time[0])

    @cached_property
    def _course(self) -> tuple[Array, Array, Array]:
        """The table's motion such that straight lines between its samples are the motion, and its two derivatives.

        Straight lines take the share (omega step)^2 / 12 off a sine; the second difference puts it back.
        """
        course = self.table.copy()
        course[1:-1] -= np.diff(self.table, 2) / 12.0
        rate = np.gradient(course, self.step)
        return course, rate, np.gradient(rate, self.step)

    def driving(self, delay: float) -> tuple[Array, Array]:
        """Displacement [m] and velocity [m/s] of the table as they were `delay` [s] before, to its second order."""
        course, rate, bent = self._course
        return course - delay * rate + 0.5 * delay**2 * bent, rate

    def from_time(self, begin: float) -> "Stretch":
        """What comes at `begin` [s] and later."""
        kept = self.time >= begin
        return replace(self, time=self.time[kept], table=self.table[kept], seen=self.seen[:, kept])


def stretch_of(table: Array, seen: Array, sample_rate: float, *, on_table: bool) -> Stretch:
    """The stretch of raw signals: table displacement [m], shape (n,), and lasers [m], shape (2, n).

    Raises Unusable when more than `MOST_LOST` of the samples of a sensor are missing; of the table's sensor, which the
    whole response follows, the few that may be are replaced by straight lines.
    """
    for name, values in (("table_displacement", table), ("laser_1", seen[0]), ("laser_2", seen[1])):
        lost = float(np.mean(~np.isfinite(values)))
        if lost > MOST_LOST:
            raise Unusable(
                f"{name} gave no value for {100.0 * lost:.1f} % of the samples: see to its range and its wiring, or ask"
                " for less motion"
            )
    there = np.isfinite(table)
    index = np.arange(table.size)
    table = np.interp(index, index[there], table[there])
    many = max(floor(sample_rate / RATE), 1)
    rows = table.size // many
    reduced = seen[:, : rows * many].reshape(2, rows, many).mean(axis=2)
    time = np.asarray((np.arange(rows) + 0.5 * (many - 1) / many) * (many / sample_rate), np.float64)
    return Stretch(time, table[: rows * many].reshape(rows, many).mean(axis=1), reduced, on_table)
