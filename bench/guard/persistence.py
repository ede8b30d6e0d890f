"""Debounce: how long something must be so before it counts."""

import numpy as np
from numpy.typing import NDArray


class Persistence:
    """A count that rises by one with each bad sample and falls by one with each good one, never below zero.

    A condition that is interrupted now and then still reaches the limit; a single spike does not.
    """

    def __init__(self, samples: int) -> None:
        self._needed = max(samples, 1)
        self._level = 0

    def first(self, bad: NDArray[np.bool_]) -> int | None:
        """Index of the sample at which the count reaches the limit, or None."""
        if self._level == 0 and not bad.any():
            return None
        walk = self._level + np.cumsum(np.where(bad, 1, -1))
        level = walk - np.minimum(np.minimum.accumulate(walk), 0)
        self._level = min(int(level[-1]), self._needed)
        reached = np.flatnonzero(level >= self._needed)
        return int(reached[0]) if reached.size else None
