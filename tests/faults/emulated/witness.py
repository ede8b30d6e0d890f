"""Sees what really happens in an emulated laboratory, tick by tick, and spoils the cables of its sensors."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.emulation.bench import EmulatedBench
from sim.channel import Counts

Array = NDArray[np.float64]
Cable = Callable[[NDArray[np.int16]], NDArray[np.int16]]
"""What a cable makes of the counts of its channel, shape (n,)."""


@dataclass(frozen=True)
class Truth:
    """Every tick since the witness came, arrays of shape (n,): volts at the output stage, volts that the amplifier
    listened to, and x [m], v [m/s], a [m/s2] of the table. `first` is the number of the first tick."""

    first: int
    output: Array
    amplifier: Array
    x: Array
    v: Array
    a: Array


class Witness:
    """Stands in for the virtual bench inside `bench`, and at the wire from the output stage to the amplifier."""

    def __init__(self, bench: EmulatedBench) -> None:
        hidden: Any = bench
        self._bench = hidden
        self.cables: dict[int, Cable] = {}
        self._rows: list[Array] = []
        with hidden.lock:
            self.virtual, self._wire = hidden._bench, hidden._output
            self._first = hidden._counts.end
            self._lock = hidden.lock
            hidden._bench, hidden._output = self, self._output

    def __getattr__(self, name: str) -> Any:
        return getattr(self.virtual, name)

    def run(self, volts: Array) -> Counts:
        """Play what the amplifier hears."""
        counts = self.virtual.run(volts)
        truth = self.virtual.truth
        self._rows.append(np.column_stack((self._played, volts, truth.x, truth.v, truth.a)))
        for column, cable in self.cables.items():
            counts[:, column] = cable(counts[:, column])
        return counts

    def forget(self) -> None:
        """Begin anew with the next tick."""
        with self._lock:
            self._rows.clear()
            self._first = self._bench._counts.end

    def told(self) -> Truth:
        """All of it until now."""
        with self._lock:
            rows = np.concatenate([np.zeros((0, 5)), *self._rows])
        return Truth(self._first, *rows.T)

    def _output(self, first: int, n: int) -> Array:
        self._played = self._wire(first, n)
        return self._played


def frozen() -> Cable:
    """The first count for ever."""
    held: list[np.int16] = []

    def cable(counts: NDArray[np.int16]) -> NDArray[np.int16]:
        held.extend(counts[:1] if not held else ())
        return np.full_like(counts, held[0])

    return cable


def rail(counts: NDArray[np.int16]) -> NDArray[np.int16]:
    """A broken cable: the input drifts to its end, which is no measurement."""
    return np.full_like(counts, np.iinfo(np.int16).max)
