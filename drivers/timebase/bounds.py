"""What many one-sided readings of a clock are worth: of each short stretch, the one that came with the least delay."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_STRETCH = 0.2
"""Length of a stretch [s]: clocks that differ by 50 ppm part by 10 us in it, and the best reading itself is kept."""
_KEPT = 120.0
"""How far back readings are kept [s]: over it the rate is known to a part in a million, and a quartz hardly drifts."""


@dataclass(frozen=True)
class Points:
    """Readings at `seconds` of a clock, ascending, that came `delay` later on another one: shape (n,) both [s]."""

    seconds: NDArray[np.float64]
    delay: NDArray[np.float64]

    def __len__(self) -> int:
        return int(self.seconds.size)


class Bounds:
    """The least delays of the last two minutes."""

    def __init__(self) -> None:
        self._points = Points(np.zeros(0), np.zeros(0))

    @property
    def points(self) -> Points:
        """What is kept: at most one reading per stretch, 600 in all."""
        return self._points

    def add(self, seconds: NDArray[np.float64], delay: NDArray[np.float64]) -> None:
        """Take readings, shape (n,) both [s]; none may be older than the stretch that was reached before."""
        kept = self._points
        if seconds.size == 0:
            return
        seconds = np.concatenate((kept.seconds[-1:], seconds))
        delay = np.concatenate((kept.delay[-1:], delay))
        stretch: NDArray[np.float64] = np.floor(seconds / _STRETCH)
        order: NDArray[np.intp] = np.lexsort((delay, stretch))
        in_order: NDArray[np.float64] = stretch[order]
        leads = np.ones(order.size, dtype=np.bool_)
        leads[1:] = np.greater(in_order[1:], in_order[:-1])
        best: NDArray[np.intp] = order[leads]
        seconds = np.concatenate((kept.seconds[:-1], seconds[best]))
        delay = np.concatenate((kept.delay[:-1], delay[best]))
        begin = int(np.searchsorted(seconds, float(seconds[-1]) - _KEPT))
        self._points = Points(seconds[begin:], delay[begin:])

    def forget(self) -> None:
        """Drop the older half."""
        half = len(self._points) // 2
        self._points = Points(self._points.seconds[half:], self._points.delay[half:])
