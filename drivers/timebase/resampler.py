"""The latest values of a sensor, and what it saw between two of them."""

import numpy as np
from numpy.typing import NDArray


class Resampler:
    """Keeps about the last `capacity` readings: index, second of the sensor's clock, counts or fault mark.

    Counts beyond +-`largest` are fault marks, `lost_mark` is the one of values that are not there.
    """

    def __init__(self, capacity: int, largest: int, lost_mark: int) -> None:
        self._capacity, self._largest, self._lost_mark = capacity, largest, lost_mark
        self._index = np.zeros(2 * capacity, dtype=np.int64)
        self._time = np.zeros(2 * capacity)
        self._counts = np.zeros(2 * capacity, dtype=np.int16)
        self._end = 0

    @property
    def last(self) -> tuple[int, float] | None:
        """Index and time of the newest reading."""
        return (int(self._index[self._end - 1]), float(self._time[self._end - 1])) if self._end else None

    def clear(self) -> None:
        """Forget all."""
        self._end = 0

    def add(self, index: NDArray[np.int64], time: NDArray[np.float64], counts: NDArray[np.int16]) -> None:
        """Append readings, shape (n,) each, with ascending times that are later than all before."""
        index, time, counts = index[-self._capacity :], time[-self._capacity :], counts[-self._capacity :]
        if self._end + time.size > self._time.size:
            begin, end = self._end - self._capacity + time.size, self._end
            for kept in (self._index, self._time, self._counts):
                kept[: end - begin] = kept[begin:end]
            self._end = end - begin
        new = slice(self._end, self._end + time.size)
        self._index[new], self._time[new], self._counts[new] = index, time, counts
        self._end = new.stop

    def at(self, times: NDArray[np.float64]) -> NDArray[np.int16]:
        """Counts at sensor times, shape (n,): on the straight line between the readings before and after.

        The mark of its fault where one of the two is no distance, the mark of lost values where one of the two is not
        there.
        """
        seen = np.full(times.shape, self._lost_mark, dtype=np.int16)
        if self._end < 2:
            return seen
        time, counts = self._time[: self._end], self._counts[: self._end]
        inside = np.flatnonzero((times >= time[0]) & (times <= time[-1]))
        before = np.clip(np.searchsorted(time, times[inside], side="right") - 1, 0, self._end - 2)
        whole = self._index[before + 1] - self._index[before] == 1
        inside, before = inside[whole], before[whole]
        first, second = counts[before], counts[before + 1]
        place = (times[inside] - time[before]) / (time[before + 1] - time[before])
        between = np.rint(first + place * (second - first.astype(np.float64))).astype(np.int16)
        values = np.where(np.abs(second.astype(np.int32)) > self._largest, second, between)
        seen[inside] = np.where(np.abs(first.astype(np.int32)) > self._largest, first, values)
        return seen
