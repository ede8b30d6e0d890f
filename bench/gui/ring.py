"""The last minute of traces in fixed memory, and what of it a plot of so many pixels needs."""

import numpy as np
from numpy.typing import NDArray

from bench.link.messages import Traces

CAPACITY = 30_000
"""Bins that are kept: a minute at two milliseconds."""


class Ring:
    """Bins in the order of their coming; a gap in time is one empty (NaN) bin.

    Written twice as long as it is, so that what is kept always lies in one piece.
    """

    def __init__(self, n_signals: int, capacity: int = CAPACITY) -> None:
        self._capacity, self._end, self._size = capacity, 0, 0
        self._time = np.zeros(2 * capacity)
        self._low = np.zeros((2 * capacity, n_signals), dtype=np.float32)
        self._high = np.zeros((2 * capacity, n_signals), dtype=np.float32)

    def __len__(self) -> int:
        return self._size

    @property
    def newest(self) -> float:
        """Bench time of the end of the last bin [s]; NaN while there is none."""
        return float(self._time[self._end - 1]) if self._size else float("nan")

    def clear(self) -> None:
        """Forget everything."""
        self._end = self._size = 0

    def add(self, traces: Traces) -> None:
        """Append the bins of a block."""
        times = traces.begin + traces.step * np.arange(1.0, len(traces.low) + 1.0, dtype=np.float64)
        if self._size and abs(traces.begin - self.newest) > 0.75 * traces.step:
            gap = np.full((1, self._low.shape[1]), np.nan, dtype=np.float32)
            self._append(np.array([traces.begin]), gap, gap)
        self._append(times, traces.low, traces.high)

    def window(self, seconds: float, buckets: int) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
        """The last `seconds` as a line through the extremes of parts of equal length, `buckets` of them
        and the one in which they begin, which is drawn whole.

        Times before the newest sample [s], shape (n,), not above zero; values of shape (n, n_signals), least and
        largest of each part in turn. Parts begin at multiples of their length in bench time, whatever the blocks were:
        a line that scrolls does not flicker.
        """
        if not self._size:
            return np.zeros(0), np.zeros((0, self._low.shape[1]), dtype=np.float32)
        first, length = self._end - self._size, seconds / buckets
        parts: NDArray[np.float64] = np.ceil(self._time[first : self._end] / length)
        # counted back from the newest part: the time at which the window begins rounds to either side of a boundary
        whole = int(np.searchsorted(parts, float(parts[-1]) - buckets))
        starts = np.flatnonzero(np.concatenate(([True], parts[whole + 1 :] > parts[whole:-1])))
        kept = slice(first + whole, self._end)
        values = np.empty((2 * starts.size, self._low.shape[1]), dtype=np.float32)
        values[0::2] = np.minimum.reduceat(self._low[kept], starts, axis=0)
        values[1::2] = np.maximum.reduceat(self._high[kept], starts, axis=0)
        return np.repeat(self._time[kept][starts] - self.newest, 2), values

    def at(self, time: float) -> NDArray[np.float64]:
        """The middle of the bin at bench time `time` [s], shape (n_signals,): the newest one after it, the oldest
        before all of them, zero while there is none.
        """
        if not self._size:
            return np.zeros(self._low.shape[1])
        first = self._end - self._size
        place = first + int(np.searchsorted(self._time[first : self._end], time))
        place = min(place, self._end - 1)
        return 0.5 * (self._low[place].astype(np.float64) + self._high[place])

    def _append(self, time: NDArray[np.float64], low: NDArray[np.float32], high: NDArray[np.float32]) -> None:
        n = len(time)
        if n > self._capacity:
            time, low, high, n = (
                time[-self._capacity :],
                low[-self._capacity :],
                high[-self._capacity :],
                self._capacity,
            )
        if self._end + n > 2 * self._capacity:
            keep = min(self._size, self._capacity - n)
            for held in (self._time, self._low, self._high):
                held[:keep] = held[self._end - keep : self._end].copy()
            self._end = self._size = keep
        place = slice(self._end, self._end + n)
        self._time[place], self._low[place], self._high[place] = time, low, high
        self._end += n
        self._size = min(self._size + n, self._capacity)
