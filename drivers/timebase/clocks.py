"""Estimators of the DAQ's sample clock and of a sensor's clock relative to the machine's clock."""

import numpy as np
from numpy.typing import NDArray

from drivers.timebase.fit import Bounds, Points, Prior, bends, floor_below, needs_refit, rate_error, typical

_TOLERANCE = 0.25
"""Deviation of the history from a line, in sample periods, beyond which the older half of the history is discarded.
Since counts are integers, the bounds drift by a fraction of a period if the readings are synchronous with the clock.
"""
_RECENT = 2.0
"""Longest time over which two bounds can be compared without knowing the clock rate [s]."""
_CONTRADICTION = 200e-6
"""Overlap of two bounds above which they contradict each other [s]: clocks that differ by 50 ppm drift apart by 100 us
in `_RECENT`.
"""
_WANDER = 1e-6
"""Standard deviation of the change of the rate between two runs [1]."""
_CERTAIN = 1e-9
"""Smallest standard uncertainty of a rate [1]."""


class SampleClock:
    """Estimator of the sample clock, on which sample i of a run is taken at i / `sample_rate` [s].

    Each reading bounds the clock on both sides: by the last sample taken and by the next one. The estimate is midway
    between the tightest bounds, and NaN before the first sample. With packet transfer, as over USB, the count lags
    behind the samples taken, and the bounds may contradict each other. The bound from the next sample is then ignored
    for the rest of the run; the estimate is late by the shortest transfer time, a constant that is part of the delay
    measured by the loop check.

    `previous` is the clock of the previous run, whose rate is taken over with its uncertainty.
    """

    def __init__(self, sample_rate: float, previous: "SampleClock | None" = None) -> None:
        self._sample_rate = sample_rate
        self._prior = Prior() if previous is None else previous.expected
        self._latest, self._earliest = Bounds(), Bounds()
        self._looks: list[tuple[float, int, float]] = []
        self._counts_lag = False
        self._began = self._now = 0.0
        self._fitted = -np.inf
        self._slope = self._offset = self._residual = np.nan

    def observe(self, before: float, count: int, after: float) -> None:
        """Add a reading: at some instant between `before` and `after` [s of the machine's clock], `count` samples had
        been taken.
        """
        if count < 1:
            return
        if np.isinf(self._fitted) and not self._looks:
            self._began = after
        self._looks.append((before, count, after))
        self._now = after

    def seconds(self, host: NDArray[np.float64]) -> NDArray[np.float64]:
        """Times on the sample clock [s] at the times `host` of the machine's clock [s], same shape."""
        self._refresh()
        return (host - self._offset) / (1.0 + self._slope)

    @property
    def rate(self) -> float:
        """Seconds of the sample clock per second of the machine's clock."""
        self._refresh()
        return 1.0 / (1.0 + self._slope)

    @property
    def expected(self) -> Prior:
        """The slope that is expected in a later run. The shortest delays change with the load of the machine, so that
        the fitted line may turn by as much as they scatter, however many they are.
        """
        self._refresh()
        points = self._latest.points
        if len(points) < 2:
            return self._prior
        turn = max(self._residual / float(points.seconds[-1] - points.seconds[0]), _CERTAIN)
        spread = (turn**-2 + self._prior.spread**-2) ** -0.5
        return Prior(self._slope, float(np.hypot(spread, _WANDER)))

    @property
    def residual(self) -> float:
        """Root mean square distance [s] of the bounds in the history from the fitted line."""
        self._refresh()
        return self._residual

    def _refresh(self) -> None:
        history = self._now - self._began
        if not self._looks or not needs_refit(history, self._fitted):
            return
        self._fitted = history
        self._take_looks()
        self._slope = rate_error(self._sides(), self._prior)
        tolerance = _TOLERANCE / self._sample_rate
        while any(bends(points, sign * self._slope, tolerance) for points, sign in self._sides()):
            self._latest.forget()
            self._earliest.forget()
            self._slope = rate_error(self._sides(), self._prior)
        sides = self._sides()
        self._offset = float(np.mean([sign * floor_below(points, sign * self._slope) for points, sign in sides]))
        off = np.concatenate([self._off(points, sign) for points, sign in sides])
        self._residual = float(np.sqrt(np.mean(off**2)))

    def _sides(self) -> list[tuple[Points, float]]:
        """The bounds in use, each with the sign, +1 or -1, by which the slope enters its delays."""
        latest = (self._latest.points, 1.0)
        return [latest] if self._counts_lag else [latest, (self._earliest.points, -1.0)]

    def _take_looks(self) -> None:
        before, count, after = np.array(self._looks, dtype=np.float64).T
        taken, coming = (count - 1.0) / self._sample_rate, count / self._sample_rate
        self._latest.add(taken, after - taken)
        self._earliest.add(coming, coming - before)
        self._looks.clear()
        self._counts_lag |= _least(self._latest.points) + _least(self._earliest.points) < -_CONTRADICTION

    def _off(self, points: Points, sign: float) -> NDArray[np.float64]:
        return points.delay - sign * (self._offset + self._slope * points.seconds)


def _least(points: Points) -> float:
    """The smallest recent delay [s]."""
    return float(points.delay[points.seconds >= points.seconds[-1] - _RECENT].min())


_SENSOR_TOLERANCE = 100e-6
"""Deviation of the history from a line [s] beyond which the older half of the history is discarded."""


class SensorClock:
    """Estimator of a sensor's clock: time t on it is `offset + rate * t` on the machine's clock [s].

    The line is a lower bound of the arrivals, so `offset` includes the smallest transfer delay. To track changes, the
    older half of a history that no single line fits is discarded. `offset`, `rate` and `residual` are NaN before the
    first reading.
    """

    def __init__(self) -> None:
        self._bounds = Bounds()
        self._fitted = -np.inf
        self._first = np.inf
        self._last = -np.inf
        self._slope = self._offset = self._residual = np.nan

    def add(self, time: NDArray[np.float64], arrival: NDArray[np.float64]) -> None:
        """Add readings, shape (n,) each: ascending times on the sensor's clock, and arrivals on the machine's [s]."""
        if time.size == 0:
            return
        # of values that arrive together, the last one has the smallest delay
        last = np.flatnonzero(np.diff(arrival, append=np.inf))
        self._bounds.add(time[last], arrival[last] - time[last])
        self._first, self._last = min(self._first, float(time[0])), float(time[-1])

    @property
    def history(self) -> float:
        """Time from the first to the last reading, in seconds of the sensor's clock; 0 before the first reading."""
        return max(self._last - self._first, 0.0)

    @property
    def offset(self) -> float:
        """Time on the machine's clock at which the sensor's clock reads 0 [s]."""
        self._refresh()
        return self._offset

    @property
    def rate(self) -> float:
        """Seconds of the machine's clock per second of the sensor's clock."""
        self._refresh()
        return 1.0 + self._slope

    @property
    def residual(self) -> float:
        """Root mean square delay [s] of the best readings relative to the line."""
        self._refresh()
        return self._residual

    def _refresh(self) -> None:
        if not len(self._bounds.points) or not needs_refit(self.history, self._fitted):
            return
        self._fitted = self.history
        self._slope = rate_error([(self._bounds.points, 1.0)], Prior())
        while bends(self._bounds.points, self._slope, _SENSOR_TOLERANCE):
            self._bounds.forget()
            self._slope = rate_error([(self._bounds.points, 1.0)], Prior())
        points = self._bounds.points
        floor = floor_below(points, self._slope)
        delay = points.delay - self._slope * points.seconds - floor
        # a delay is the sum of those due to bursts and to the scheduler, which are rarely both short: the smallest of n
        # delays remains above zero
        self._offset = floor - typical(delay) / np.sqrt(len(points))
        self._residual = float(np.sqrt(np.mean(delay**2)))
