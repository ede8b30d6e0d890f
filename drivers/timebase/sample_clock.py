"""The sample clock of a DAQ against the machine's, from counts that were read between two looks at the latter."""

import numpy as np
from numpy.typing import NDArray

from drivers.timebase.bounds import Bounds, Points
from drivers.timebase.fit import bends, due, floor_below, rate_error

_TOLERANCE = 0.25
"""How far a history may keep away from one line, in sample periods, before its older half is forgotten: counts are
whole, so the bounds of a reader that keeps step with the clock wander by part of a period."""
_RECENT = 2.0
"""For how long two bounds can be compared without knowing the rate [s],"""
_CONTRADICTION = 200e-6
"""and by how much they must then exclude one another [s]: clocks that differ by 50 ppm part by 100 us meanwhile."""


class SampleClock:
    """Sample i of a run is at second i / `sample_rate` of its sample clock.

    Each look bounds the clock on both sides: by the last sample that had been taken, and by the one that had not. The
    clock is placed midway between the tightest bounds. Until a sample has been seen its seconds are NaN.

    Where samples reach the machine in packets, as over USB, the count lags, and a sample that is not counted may have
    been taken: the bounds then exclude one another. For the rest of the run the clock is placed by the last sample
    that had been taken alone, late by the shortest transfer: a constant, part of the delay that a check measures.
    """

    def __init__(self, sample_rate: float) -> None:
        self._sample_rate = sample_rate
        self._latest, self._earliest = Bounds(), Bounds()
        self._looks: list[tuple[float, int, float]] = []
        self._counts_lag = False
        self._began = self._now = 0.0
        self._fitted = -np.inf
        self._slope = self._offset = self._residual = np.nan

    def observe(self, before: float, count: int, after: float) -> None:
        """At some moment between `before` and `after` [s of the machine's clock] `count` samples had been taken."""
        if count < 1:
            return
        if np.isinf(self._fitted) and not self._looks:
            self._began = after
        self._looks.append((before, count, after))
        self._now = after

    def seconds(self, host: NDArray[np.float64]) -> NDArray[np.float64]:
        """Seconds of the sample clock at `host` [s of the machine's clock], same shape."""
        self._refresh()
        return (host - self._offset) / (1.0 + self._slope)

    @property
    def rate(self) -> float:
        """Seconds of the sample clock per second of the machine's."""
        self._refresh()
        return 1.0 / (1.0 + self._slope)

    @property
    def residual(self) -> float:
        """Root mean square distance of the tightest bounds from the line that is used [s]."""
        self._refresh()
        return self._residual

    def _refresh(self) -> None:
        history = self._now - self._began
        if not self._looks or not due(history, self._fitted):
            return
        self._fitted = history
        self._take_looks()
        self._slope = rate_error(self._sides())
        tolerance = _TOLERANCE / self._sample_rate
        while any(bends(points, sign * self._slope, tolerance) for points, sign in self._sides()):
            self._latest.forget()
            self._earliest.forget()
            self._slope = rate_error(self._sides())
        sides = self._sides()
        self._offset = float(np.mean([sign * floor_below(points, sign * self._slope) for points, sign in sides]))
        off = np.concatenate([self._off(points, sign) for points, sign in sides])
        self._residual = float(np.sqrt(np.mean(off**2)))

    def _sides(self) -> list[tuple[Points, float]]:
        """The bounds that hold, each with the sign by which its delays grow with the slope."""
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
    """The least delay of the last moments [s]."""
    return float(points.delay[points.seconds >= points.seconds[-1] - _RECENT].min())
