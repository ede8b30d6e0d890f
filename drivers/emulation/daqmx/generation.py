"""One run of a buffered output: samples wait, are played once each, and the last one is held."""

from math import ceil

import numpy as np
from numpy.typing import NDArray

from drivers.emulation.daqmx.terminals import Signal
from drivers.emulation.daqmx.timing import SampleClock
from drivers.emulation.history import History

_PATIENCE = 10.0
"""How late the plant may ask for what was played [s]."""


class Generation:
    """Samples of all channels of an output task, by number. `buffer` samples fit before the start; when it runs, the
    `memory` on the device comes on top."""

    def __init__(self, channels: int, clock: SampleClock, buffer: int, memory: int) -> None:
        self._clock = clock
        self._buffer = buffer
        self._memory = memory
        self._samples = History(buffer + memory + ceil(_PATIENCE * clock.rate), channels, np.float64)
        self._first: int | None = None

    @property
    def written(self) -> int:
        """How many samples were written so far."""
        return self._samples.end

    def begin(self, tick: int) -> None:
        """Sample 0 leaves at `tick`."""
        self._first = tick

    def played(self, tick: int) -> int:
        """How many samples have left when `tick` has come; it stops at the last one that was there."""
        return min(self._due(tick), self.written)

    def dry(self, tick: int) -> bool:
        """Whether more samples were due at `tick` than were there."""
        return self._due(tick) > self.written

    def space(self, tick: int) -> int:
        """How many samples can be written at `tick`."""
        capacity = self._buffer if self._first is None else self._buffer + self._memory
        return capacity - (self.written - self.played(tick))

    def tick_of_space(self, samples: int) -> int | None:
        """The tick at which there will be room for `samples`, or as many as ever fit; None when it does not run."""
        if self._first is None:
            return None
        capacity = self._buffer + self._memory
        return self._clock.ticks(self._first, self.written + min(samples, capacity) - capacity - 1)

    def append(self, samples: NDArray[np.float64]) -> None:
        """Add samples, shape (n, channels), that have room."""
        self._samples.append(samples)

    def signal(self, channel: int) -> Signal:
        """What the terminal of a channel follows while this runs."""

        def volts(first: int, n: int) -> NDArray[np.float64]:
            assert self._first is not None
            numbers = self._clock.numbers(self._first, np.arange(first, first + n))
            return self._samples.at(np.minimum(numbers, self.written - 1))[:, channel]

        return volts

    def _due(self, tick: int) -> int:
        return 0 if self._first is None else self._clock.passed(self._first, tick)
