"""Blocks of signals reduced to what a screen can show: extremes in bins of some milliseconds."""

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DISPLACEMENT, DRIFT, SIGNALS, U1
from bench.events import Acquired
from bench.link.messages import Traces
from drivers.clock import now

TRACES = ("drive", "acceleration", "displacement", "u1", "u2", "drift")
"""Columns of traces: drive [V], table acceleration [m/s2] and displacement [m], storeys and their difference [m],
the last three relative to the table. Channels besides follow, as in `bench.analysis.signals`."""

BIN = 0.002
"""Shortest bin [s]: finer than a pixel of every window of a second and more."""


def extremes(values: NDArray[np.float64], width: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Least and largest of every `width` rows of `values`, shape (n, m); of what is left, in the last one.

    NaN only where a bin holds nothing else.
    """
    starts = np.arange(0, len(values), width)
    low = np.fmin.reduceat(values, starts, axis=0)
    high = np.fmax.reduceat(values, starts, axis=0)
    return low.astype(np.float32), high.astype(np.float32)


class Reduction:
    """Turns the blocks of a rig into traces; knows nothing of who reads them."""

    def __init__(self, sample_rate: float) -> None:
        self._rate = sample_rate
        self._width = max(round(BIN * sample_rate), 1)
        self._run, self._origin = 0, 0.0

    def __call__(self, event: Acquired) -> Traces:
        """The traces of a block."""
        signals = event.signals
        if event.run != self._run:
            # the samples follow one another evenly; the moments at which blocks are read do not
            self._run, self._origin = event.run, event.time - (event.block.first + len(signals)) / self._rate
        chosen = np.column_stack(
            (
                event.drive,
                signals[:, [ACCELERATION, DISPLACEMENT, U1]],
                signals[:, U1] + signals[:, DRIFT],
                signals[:, DRIFT],
                signals[:, len(SIGNALS) :],
            )
        )
        low, high = extremes(chosen, self._width)
        begin = self._origin + event.block.first / self._rate
        return Traces(event.run, begin, self._width / self._rate, low, high, now(), self._origin)
