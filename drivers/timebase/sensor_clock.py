"""The clock of a sensor against the machine's, from values that arrive some time after they were taken."""

import numpy as np
from numpy.typing import NDArray

from drivers.timebase.bounds import Bounds
from drivers.timebase.fit import bends, due, floor_below, rate_error, typical

_TOLERANCE = 100e-6
"""How far a history may keep away from one line [s] before its older half is forgotten."""


class SensorClock:
    """Second t of the sensor is at second `offset + rate * t` of the machine's clock.

    The line is the earliest that the arrivals allow, so the least delay that ever occurs is part of `offset`. What
    changes is followed: the older half of a history that one line does not describe is forgotten. Before the first
    reading all is NaN.
    """

    def __init__(self) -> None:
        self._bounds = Bounds()
        self._fitted = -np.inf
        self._first = np.inf
        self._last = -np.inf
        self._slope = self._offset = self._residual = np.nan

    def add(self, time: NDArray[np.float64], arrival: NDArray[np.float64]) -> None:
        """Take readings, shape (n,): second of the sensor's clock, ascending, and of the machine's at arrival."""
        if time.size == 0:
            return
        # of values that came together the last one waited least
        last = np.flatnonzero(np.diff(arrival, append=np.inf))
        self._bounds.add(time[last], arrival[last] - time[last])
        self._first, self._last = min(self._first, float(time[0])), float(time[-1])

    @property
    def history(self) -> float:
        """For how long the sensor has been listened to, in seconds of its clock."""
        return max(self._last - self._first, 0.0)

    @property
    def offset(self) -> float:
        """Second of the machine's clock at second 0 of the sensor [s]."""
        self._refresh()
        return self._offset

    @property
    def rate(self) -> float:
        """Seconds of the machine's clock per second of the sensor."""
        self._refresh()
        return 1.0 + self._slope

    @property
    def residual(self) -> float:
        """Root mean square of how much later than this line the best readings came [s]."""
        self._refresh()
        return self._residual

    def _refresh(self) -> None:
        if not len(self._bounds.points) or not due(self.history, self._fitted):
            return
        self._fitted = self.history
        self._slope = rate_error([(self._bounds.points, 1.0)])
        while bends(self._bounds.points, self._slope, _TOLERANCE):
            self._bounds.forget()
            self._slope = rate_error([(self._bounds.points, 1.0)])
        points = self._bounds.points
        floor = floor_below(points, self._slope)
        delay = points.delay - self._slope * points.seconds - floor
        # two delays that add up, of burst and scheduler, are both short seldom: the least of n is not zero yet
        self._offset = floor - typical(delay) / np.sqrt(len(points))
        self._residual = float(np.sqrt(np.mean(delay**2)))
