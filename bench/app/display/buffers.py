"""Buffers of the live view: the last minute of traces, and the last 5 s of the block angle from the live twin."""

import numpy as np
from numpy.typing import NDArray

from bench.app.ipc.messages import Traces
from bench.live_values import TWIN_TRACE, TwinEstimate

_SECONDS, _THETA = (TWIN_TRACE.index(name) for name in ("seconds", "theta"))
STEP = 0.01
"""Interval between two stored angles of the twin [s]."""
KEPT = 500
"""Number of stored angles, which cover 5 s."""
BEHIND = 2.0
"""Largest lag of the twin [s] for which the display waits for its angle, in bench time. The twin lags behind the
measurement when a run is faster than real time.
"""
CAPACITY = 30_000
"""Number of stored bins: one minute at 2 ms per bin."""


class Ring:
    """Ring buffer of bins in order of arrival. A bin has the minimum and the maximum of each signal; a gap in time is
    one bin of NaN. The arrays have twice the capacity, so that the content is always contiguous.
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
        """Bench time at the end of the last bin [s]; NaN for an empty buffer."""
        return float(self._time[self._end - 1]) if self._size else float("nan")

    def clear(self) -> None:
        """Discard all bins."""
        self._end = self._size = 0

    def discard_before(self, time: float) -> None:
        """Discard the bins that end at or before bench time `time` [s]."""
        first = self._end - self._size
        self._size -= int(np.searchsorted(self._time[first : self._end], time, side="right"))

    def add(self, traces: Traces) -> None:
        """Append the bins of a block."""
        times = traces.begin + traces.step * np.arange(1.0, len(traces.low) + 1.0, dtype=np.float64)
        if self._size and abs(traces.begin - self.newest) > 0.75 * traces.step:
            gap = np.full((1, self._low.shape[1]), np.nan, dtype=np.float32)
            self._append(np.array([traces.begin]), gap, gap)
        self._append(times, traces.low, traces.high)

    def window(self, seconds: float, buckets: int) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
        """The last `seconds` as a line through the minimum and the maximum of each part of length `seconds / buckets`.

        Returns times relative to the newest sample [s], shape (n,), zero or negative, and values, shape (n, n_signals):
        the minimum, then the maximum of each part. Parts begin at multiples of their length in bench time,
        independently of the blocks, so that a scrolling line does not flicker. The interval therefore begins within a
        part, which is included: there are at most `buckets` + 1 parts.
        """
        if not self._size:
            return np.zeros(0), np.zeros((0, self._low.shape[1]), dtype=np.float32)
        first, length = self._end - self._size, seconds / buckets
        parts: NDArray[np.float64] = np.ceil(self._time[first : self._end] / length)
        # the first part is counted back from the newest: the start time may be rounded to either side of a boundary
        whole = int(np.searchsorted(parts, float(parts[-1]) - buckets))
        starts = np.flatnonzero(np.concatenate(([True], parts[whole + 1 :] > parts[whole:-1])))
        kept = slice(first + whole, self._end)
        values = np.empty((2 * starts.size, self._low.shape[1]), dtype=np.float32)
        values[0::2] = np.minimum.reduceat(self._low[kept], starts, axis=0)
        values[1::2] = np.maximum.reduceat(self._high[kept], starts, axis=0)
        return np.repeat(self._time[kept][starts] - self.newest, 2), values

    def newest_bins(self, seconds: float) -> tuple[NDArray[np.float64], NDArray[np.float32], NDArray[np.float32]]:
        """Bench times at the ends of the bins of the last `seconds` [s], shape (n,), and the minima and the maxima in
        these bins, each of shape (n, n_signals).
        """
        first = self._end - self._size
        first += int(np.searchsorted(self._time[first : self._end], self.newest - seconds)) if self._size else 0
        kept = slice(first, self._end)
        return self._time[kept], self._low[kept], self._high[kept]

    def at(self, time: float) -> NDArray[np.float64]:
        """Midpoint between minimum and maximum of each signal in the bin at bench time `time` [s], shape (n_signals,).
        A time outside the buffer selects the newest or the oldest bin; an empty buffer gives zeros.
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


class BlockAngle:
    """Angle of the block against bench time, as computed and published by the live twin."""

    def __init__(self) -> None:
        self._run, self._origin = 0, 0.0
        self._time, self._angle = np.zeros(0), np.zeros(0)

    def place(self, traces: Traces) -> None:
        """Store the bench time at which the run of these traces began, and discard the angles of an earlier run."""
        if traces.run != self._run:
            self._run, self._origin = traces.run, traces.origin
            self._time, self._angle = np.zeros(0), np.zeros(0)

    def add(self, estimate: TwinEstimate) -> None:
        """Append a part of the twin's trace; a part that belongs to another run is ignored."""
        if estimate.run != self._run:
            return
        stood = estimate.trace[np.isfinite(estimate.trace[:, _THETA])]
        self._time = np.append(self._time, self._origin + stood[:, _SECONDS])[-KEPT:]
        self._angle = np.append(self._angle, stood[:, _THETA])[-KEPT:]

    def nearest(self, time: float) -> float:
        """The latest bench time [s] up to `time` at which the angle is known, so that frame and block are shown at the
        same instant; `time` itself if no angle is known in the last `BEHIND` seconds.
        """
        newest = float(self._time[-1]) if self._time.size else float("-inf")
        return newest if time - BEHIND <= newest < time else time

    def at(self, time: float) -> tuple[float, float] | None:
        """Angle [rad] at a bench time [s], and time since the last impact [s], infinite before the first. None if no
        angle is available for that time.
        """
        times, angles = self._time, self._angle
        if not times.size or not times[0] <= time <= times[-1] + STEP:
            return None
        until = int(np.searchsorted(times, time, side="right"))
        sign = np.sign(angles[:until])
        struck = np.flatnonzero((sign[:-1] != 0.0) & (sign[1:] != sign[:-1]))
        ago = time - float(times[struck[-1] + 1]) if struck.size else float("inf")
        return float(angles[until - 1]), ago
