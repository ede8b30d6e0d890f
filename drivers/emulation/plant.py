"""What the emulated instruments are wired to: a bench that moves in real time.

All times are seconds of the machine's monotonic clock (`time.monotonic`), which every process on it shares.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.channel import Counts

Output = Callable[[int, int], NDArray[np.float64]]
"""Volts at the drive output at `n` ticks from tick `first` on: `output(first, n)`, shape (n,). Asked for each tick
once, in order; between tasks, and when samples run out, it holds its last value as a real output does."""


class Plant(Protocol):
    """The terminals of the bench: a converter's clock, its inputs, the wire to the amplifier."""

    @property
    def tick_rate(self) -> float:
        """Nominal ticks per second: samples are taken, and drive values take effect, at ticks."""
        ...

    @property
    def terminals(self) -> int:
        """How many inputs there are."""
        ...

    def tick(self) -> int:
        """The present: how many ticks have passed since the plant was switched on."""
        ...

    def time_of(self, tick: int) -> float:
        """When a tick passes or passed [s]; the clock of the plant has an error of its own."""
        ...

    def inputs(self, first: int, n: int) -> Counts:
        """Counts at all terminals at `n` ticks from `first` on, shape (n, terminals); they must have passed.

        The last 30 s are kept; InvalidInput for older ticks.
        """
        ...

    def wire(self, output: Output) -> None:
        """Connect the drive output; before, it is at zero."""
        ...

    def enable(self, closed: bool) -> None:
        """Open or close the enable relay of the amplifier; open, no drive moves the table."""
        ...


class Sight(Protocol):
    """What a laser of the emulated bench looks at."""

    def displacement(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement [m] from mid range, seen at `times` [s], shape (n,): within the last 30 s and not in the future.

        NaN where there is nothing to be seen.
        """
        ...
