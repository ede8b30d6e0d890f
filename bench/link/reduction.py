"""Blocks of samples to what a screen can show: signals in SI units, extremes in bins of some milliseconds."""

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DISPLACEMENT, DRIFT, U1, SignalMap
from bench.events import Acquired
from bench.link.messages import Traces
from drivers.clock import now
from drivers.rig import Channel

TRACES = ("drive", "acceleration", "displacement", "u1", "u2", "drift")
"""Columns of traces: drive [V], table acceleration [m/s2] and displacement [m], storeys and their difference [m],
the last three relative to the table."""

BIN = 0.002
"""Shortest bin [s]: finer than a pixel of every window of a second and more."""
REST = 0.5
"""Share of a second at the start of a run from which the zero of the signals is taken: the table is silent then."""


def extremes(values: NDArray[np.float64], width: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Least and largest of every `width` rows of `values`, shape (n, m); of what is left, in the last one.

    NaN only where a bin holds nothing else.
    """
    starts = np.arange(0, len(values), width)
    low = np.fmin.reduceat(values, starts, axis=0)
    high = np.fmax.reduceat(values, starts, axis=0)
    return low.astype(np.float32), high.astype(np.float32)


class Reduction:
    """Turns the blocks of a rig with these `channels` into traces; knows nothing of who reads them."""

    def __init__(self, channels: tuple[Channel, ...], sample_rate: float, signals: SignalMap) -> None:
        self._channels, self._rate, self._signals = channels, sample_rate, signals
        self._width = max(round(BIN * sample_rate), 1)
        self._run, self._origin = 0, 0.0
        self._rest: list[NDArray[np.float64]] = []

    def __call__(self, event: Acquired) -> Traces:
        """The traces of a block."""
        values = np.column_stack(
            [channel.to_unit(event.block.counts[:, k]) for k, channel in enumerate(self._channels)]
        )
        if event.run != self._run:
            # the samples follow one another evenly; the moments at which blocks are read do not
            self._origin = event.time - (event.block.first + len(values)) / self._rate
        self._tare(event.run, values)
        signals = self._signals.of(values)
        chosen = np.column_stack(
            (
                event.drive,
                signals[:, [ACCELERATION, DISPLACEMENT, U1]],
                signals[:, U1] + signals[:, DRIFT],
                signals[:, DRIFT],
            )
        )
        low, high = extremes(chosen, self._width)
        begin = self._origin + event.block.first / self._rate
        return Traces(event.run, begin, self._width / self._rate, low, high, now())

    def _tare(self, run: int, values: NDArray[np.float64]) -> None:
        """Take the zero anew while a run is in its first moments."""
        if run != self._run:
            self._run, self._rest = run, []
        if sum(map(len, self._rest)) < REST * self._rate:
            self._rest.append(values)
            self._signals.tare(np.concatenate(self._rest))
