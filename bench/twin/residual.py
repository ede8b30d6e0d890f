"""How far the measured drift is from the model's, and how much of that the band does not explain."""

from collections import deque
from math import nan

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SPAN = 1.0
"""Time over which a residual is taken [s]."""


class Residual:
    """Root mean squares over the blocks that fill the last `SPAN`, over the largest of the measured drift so far.

    `least` [m] stands for a drift that has been smaller: what its sensors do not resolve is no residual.
    """

    def __init__(self, dt: float, least: float) -> None:
        self._span, self._least = round(SPAN / dt), least
        self._sums: deque[tuple[int, int, Array]] = deque()
        self._largest = 0.0

    def push(self, measured: Array, model: Array, low: Array, high: Array) -> tuple[float, float]:
        """Of measured minus model, and of what is outside the band, of the next samples [m], each shape (n,).

        NaN while the span is not full, or one of the values is missing in more than half of it.
        """
        parts = np.stack((measured, measured - model, np.maximum(np.maximum(measured - high, low - measured), 0.0)))
        known = np.isfinite(parts).all(axis=0)
        squares = np.square(parts[:, known]).sum(axis=1)
        self._sums.append((measured.size, int(np.count_nonzero(known)), squares))
        total = sum(size for size, *_ in self._sums)
        while total - self._sums[0][0] >= self._span:
            total -= self._sums.popleft()[0]
        seen = sum(n for _, n, _ in self._sums)
        if total < self._span or 2 * seen <= total:
            return nan, nan
        rms = np.sqrt(np.sum([part for *_, part in self._sums], axis=0) / seen)
        self._largest = max(self._largest, float(rms[0]))
        scale = max(self._largest, self._least)
        return float(rms[1]) / scale, float(rms[2]) / scale


class Limit:
    """A limit that a value must exceed for some time [s] before it counts, once."""

    def __init__(self, limit: float | None, persistence: float) -> None:
        self.limit = limit
        self._persistence = persistence
        self._since: float | None = None
        self._counted = False

    def exceeded(self, value: float, seconds: float) -> bool:
        """Whether `value`, as of `seconds` [s], is what makes the limit count; NaN is no value above it."""
        if self.limit is None or not value > self.limit:
            self._since = None
            return False
        self._since = seconds if self._since is None else self._since
        if self._counted or seconds - self._since < self._persistence:
            return False
        self._counted = True
        return True
