"""Bench time of every row, for the axis of plots."""

import numpy as np
from numpy.typing import NDArray


class Timeline:
    """Times that rise by one sample period within a run, and jump where samples are missing.

    A run is placed by its first block, which had been read when its last sample was taken; the delay of that reading
    is in all times of the run alike.
    """

    def __init__(self, sample_rate: float) -> None:
        self._rate = sample_rate
        self._run: int | None = None
        self._origin = 0.0
        self._last = -np.inf

    def seconds(self, time: float, run: int, first: int, n: int) -> NDArray[np.float64]:
        """Times [s], shape (n,), of a block from sample `first` of `run` that had been read at `time` [s]."""
        if run != self._run:
            # a whole microsecond compresses better; runs never overlap, whatever the clock of the bench says
            begin = max(time - n / self._rate, self._last + 1.0 / self._rate)
            self._run, self._origin = run, round(begin - first / self._rate, 6)
        times = self._origin + np.arange(first, first + n) / self._rate
        self._last = float(times[-1]) if n else self._last
        return times
