"""The sample clock of a DAQ against the machine's, from counts that were read between two looks at the latter."""

import numpy as np
from numpy.typing import NDArray

from drivers.timebase.bounds import Bounds, Points
from drivers.timebase.fit import bends, due, floor_below, rate_error

_TOLERANCE = 0.25
"""How far a history may keep away from one line, in sample periods, before its older half is forgotten: counts are
whole, so the bounds of a reader that keeps step with the clock wander by part of a period."""


class SampleClock:
    """Sample i of a run is at second i / `sample_rate` of its sample clock.

    Each look bounds the clock on both sides: by the last sample that had been taken, and by the one that had not. The
    clock is placed midway between the tightest bounds. Until a sample has been seen its seconds are NaN.
    """

    def __init__(self, sample_rate: float) -> None:
        self._sample_rate = sample_rate
        self._latest, self._earliest = Bounds(), Bounds()
        self._looks: list[tuple[float, int, float]] = []
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
        """Root mean square distance of the tightest bounds from the line midway [s]."""
        self._refresh()
        return self._residual

    def _refresh(self) -> None:
        history = self._now - self._began
        if not self._looks or not due(history, self._fitted):
            return
        self._fitted = history
        self._take_looks()
        self._slope = self._fitted_slope()
        tolerance = _TOLERANCE / self._sample_rate
        while bends(self._latest.points, self._slope, tolerance) or bends(
            self._earliest.points, -self._slope, tolerance
        ):
            self._latest.forget()
            self._earliest.forget()
            self._slope = self._fitted_slope()
        late, early = self._latest.points, self._earliest.points
        self._offset = 0.5 * (floor_below(late, self._slope) - floor_below(early, -self._slope))
        off = np.concatenate((self._off(late, 1.0), self._off(early, -1.0)))
        self._residual = float(np.sqrt(np.mean(off**2)))

    def _take_looks(self) -> None:
        before, count, after = np.array(self._looks, dtype=np.float64).T
        taken, coming = (count - 1.0) / self._sample_rate, count / self._sample_rate
        self._latest.add(taken, after - taken)
        self._earliest.add(coming, coming - before)
        self._looks.clear()

    def _fitted_slope(self) -> float:
        return rate_error([(self._latest.points, 1.0), (self._earliest.points, -1.0)])

    def _off(self, points: Points, sign: float) -> NDArray[np.float64]:
        return points.delay - sign * (self._offset + self._slope * points.seconds)
