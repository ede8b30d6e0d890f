"""The largest magnitude that a signal has reached, block after block."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class RunningPeak:
    """Takes a signal in blocks of any size; samples without a value say nothing."""

    def __init__(self) -> None:
        self._largest = np.nan
        self._seen = 0

    @property
    def samples(self) -> int:
        """How many samples were taken."""
        return self._seen

    def push(self, block: Array) -> float:
        """The largest magnitude up to the end of `block`, shape (n,); NaN until there is a value."""
        self._seen += block.size
        self._largest = float(np.fmax.reduce(np.abs(block), initial=self._largest))
        return self._largest


def running_peak(signal: Array) -> Array:
    """The largest magnitude up to each sample, shape (n,); NaN before the first value."""
    return np.fmax.accumulate(np.abs(signal))
