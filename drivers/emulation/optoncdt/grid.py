"""When the sensor measures: on a clock of its own, which nobody sets."""

from math import floor

import numpy as np
from numpy.typing import NDArray

TICKS = 100_000
"""Ticks of the time stamp in a second of the sensor's clock (manual of the optoNCDT 1420, p. 66)."""


class Zero:
    """A count that can be set to zero: what was measured before keeps the zero it was measured with."""

    def __init__(self, now: float) -> None:
        self._before = self.now = now

    def reset(self, now: float) -> None:
        self._before, self.now = self.now, now

    def since(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far growing `values`, shape (n,) with n > 0, lie from their zero."""
        if values[0] >= self.now:
            return values - self.now
        return values - np.where(values < self.now, self._before, self.now)


class Grid:
    """Exposures at equal distances of the sensor's clock, which is wrong by `clock_error`. Host times in seconds.

    Exposures are numbered from power-up through every change of the rate.
    """

    def __init__(self, rate: float, clock_error: float, origin: float) -> None:
        self._pace = 1.0 + clock_error
        self.rate = rate * self._pace
        self._origin, self.first = origin, 0
        self.epoch = Zero(origin)
        self.count = Zero(0)

    def change(self, rate: float, now: float) -> None:
        """From `now` on measure `rate` times per second of the sensor's clock."""
        self.first = self.end(now)
        self.rate = rate * self._pace
        self._origin = now + 1.0 / self.rate

    def end(self, now: float) -> int:
        """Number of the first exposure after `now`."""
        return self.first + max(floor((now - self._origin) * self.rate) + 1, 0)

    def times(self, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
        """When the exposures of these numbers are taken [s]."""
        return self._origin + (numbers - self.first) / self.rate

    def counters(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """The counter of these exposures: 18 bits."""
        return self.count.since(numbers.astype(np.float64)).astype(np.int64) & 0x3FFFF

    def stamps(self, times: NDArray[np.float64]) -> NDArray[np.int64]:
        """Time stamps of exposures at these times, in ticks: 32 bits."""
        return np.floor(self.epoch.since(times) * (self._pace * TICKS)).astype(np.int64) & 0xFFFFFFFF
