"""Interface of the real-time bench to which the emulated instruments are wired.

All times are seconds of the machine's monotonic clock (`time.monotonic`), which all processes on the machine share.
"""

from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from sim.channel import Counts
from sim.errors import InvalidInput

Output = Callable[[int, int], NDArray[np.float64]]
"""`output(first, n)`: volts at the drive output at `n` ticks from tick `first` on, shape (n,). Each tick is read once,
in order. Between tasks and after an underflow the output holds its last value, like a real output.
"""


class Plant(Protocol):
    """Terminals of the bench: converter clock, inputs, and connection to the amplifier."""

    @property
    def tick_rate(self) -> float:
        """Nominal ticks per second. Samples are taken and drive values take effect at ticks."""
        ...

    @property
    def terminals(self) -> int:
        """Number of inputs."""
        ...

    def tick(self) -> int:
        """Number of ticks since the plant was switched on."""
        ...

    def time_of(self, tick: int) -> float:
        """Time of a tick [s], including the plant's clock error."""
        ...

    def inputs(self, first: int, n: int) -> Counts:
        """Counts at all terminals at `n` ticks from `first` on, shape (n, terminals); the ticks must have passed.

        The last 30 s are kept; raises InvalidInput for older ticks.
        """
        ...

    def wire(self, output: Output) -> None:
        """Connect the drive output; until then the drive is zero."""
        ...

    def enable(self, closed: bool) -> None:
        """Open or close the amplifier's enable relay; while it is open, the drive does not move the table."""
        ...


class Sight(Protocol):
    """Target of a laser of the emulated bench."""

    def displacement(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement [m] from mid range at `times` [s], shape (n,), within the last 30 s.

        NaN where there is no target.
        """
        ...


T = TypeVar("T", bound=np.generic)


class History(Generic[T]):
    """The newest `capacity` rows of a growing array, addressed by their row numbers; rows never change."""

    def __init__(self, capacity: int, columns: int, dtype: type[T]) -> None:
        self._rows: NDArray[T] = np.zeros((capacity, columns), dtype=dtype)
        self._end = 0

    @property
    def end(self) -> int:
        """Number of rows appended so far: the index of the next row."""
        return self._end

    def append(self, rows: NDArray[T]) -> None:
        """Add `rows`, shape (n, columns)."""
        capacity = self._rows.shape[0]
        kept = rows[-capacity:]
        places = np.arange(self._end + len(rows) - len(kept), self._end + len(rows)) % capacity
        self._rows[places] = kept
        self._end += len(rows)

    def at(self, numbers: NDArray[np.int64]) -> NDArray[T]:
        """The rows `numbers`, shape (n, columns). Raises InvalidInput for rows discarded or not yet appended."""
        if numbers.size and not (self._end - self._rows.shape[0] <= numbers.min() and numbers.max() < self._end):
            allowed = f"rows {max(self._end - self._rows.shape[0], 0)} to {self._end - 1} are kept"
            raise InvalidInput("row", (int(numbers.min()), int(numbers.max())), allowed)
        return self._rows[numbers % self._rows.shape[0]]
