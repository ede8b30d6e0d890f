"""The fitted section of a recording, reduced to means over a few samples.

Averaging is the same linear filter for all channels, so the means obey the same equations as the samples.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import floor

import numpy as np
from numpy.typing import NDArray

from sim.channel import STOREYS, TABLE_DISPLACEMENT
from sim.errors import RockbenchError

Array = NDArray[np.float64]

RATE = 200.0
"""Lowest sample rate to which samples are averaged [1/s]: far above the frequencies of the frame's modes."""

MOST_LOST = 0.02
"""Largest permitted fraction of missing samples of a sensor."""


class Unusable(RockbenchError):
    """Error: the recording is not sufficient for the fit."""

    error_code = "not_measurable"


@dataclass(frozen=True, eq=False)
class Stretch:
    """Section of a recording: `time` [s], shape (n,), evenly spaced, since the first sample of the recording; `table`
    [m], shape (n,), the displacement of the table; `readings` [m], shape (2, n), the readings of the lasers on storeys
    1 and 2, NaN where invalid.

    If `on_table`, the lasers are fixed to the table and measure relative to it.
    """

    time: Array
    table: Array
    readings: Array
    on_table: bool

    @property
    def step(self) -> float:
        """Time between samples [s]."""
        return float(self.time[1] - self.time[0])

    @cached_property
    def _course(self) -> tuple[Array, Array, Array]:
        """Displacement [m] of the table, corrected for linear interpolation, velocity [m/s] and acceleration [m/s2].

        Linear interpolation reduces a sine by the fraction (omega step)^2 / 12; the second difference restores it.
        """
        course = self.table.copy()
        course[1:-1] -= np.diff(self.table, 2) / 12.0
        rate = np.gradient(course, self.step)
        return course, rate, np.gradient(rate, self.step)

    def driving(self, delay: float) -> tuple[Array, Array]:
        """Displacement [m] of the table `delay` [s] before each sample, to second order in the delay, and velocity
        [m/s] at the sample.
        """
        course, rate, bent = self._course
        return course - delay * rate + 0.5 * delay**2 * bent, rate

    def from_time(self, begin: float) -> "Stretch":
        """The section from `begin` [s] on."""
        kept = self.time >= begin
        return replace(self, time=self.time[kept], table=self.table[kept], readings=self.readings[:, kept])


def stretch_of(table: Array, readings: Array, sample_rate: float, *, on_table: bool) -> Stretch:
    """The section from raw signals: table displacement [m], shape (n,), and lasers [m], shape (2, n).

    Raises Unusable if more than the fraction `MOST_LOST` of a sensor's samples is missing; fewer missing samples of the
    table's sensor are interpolated linearly.
    """
    for name, values in zip((TABLE_DISPLACEMENT, *STOREYS), (table, *readings), strict=True):
        lost = float(np.mean(~np.isfinite(values)))
        if lost > MOST_LOST:
            raise Unusable(
                f"{name} has no value for {100.0 * lost:.1f} % of the samples: check its range and its wiring, "
                "or request a smaller motion"
            )
    there = np.isfinite(table)
    index = np.arange(table.size)
    table = np.interp(index, index[there], table[there])
    many = max(floor(sample_rate / RATE), 1)
    rows = table.size // many
    reduced = readings[:, : rows * many].reshape(2, rows, many).mean(axis=2)
    time = np.asarray((np.arange(rows) + 0.5 * (many - 1) / many) * (many / sample_rate), np.float64)
    return Stretch(time, table[: rows * many].reshape(rows, many).mean(axis=1), reduced, on_table)
