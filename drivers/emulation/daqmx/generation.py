"""One run of a buffered output: each sample is played once, and the last one is held."""

import threading
from collections import deque
from collections.abc import Callable, Generator
from contextlib import contextmanager
from math import ceil

import numpy as np
from numpy.typing import NDArray

from drivers.emulation.daqmx.timing import SampleClock
from drivers.emulation.plant import History

Signal = Callable[[int, int], NDArray[np.float64]]
"""`signal(first, n)`: volts at `n` ticks from tick `first` on, shape (n,)."""

_PATIENCE = 10.0
"""Duration of the retained output [s]."""


class Generation:
    """Samples of all channels of an output task in one run, by index.

    The capacity is `buffer` samples before the start, and `buffer + memory` samples while running, where `memory` is
    the part of the device's memory in use.
    """

    def __init__(self, channels: int, clock: SampleClock, buffer: int, memory: int) -> None:
        self._clock = clock
        self._buffer = buffer
        self._memory = memory
        self._samples = History(buffer + memory + ceil(_PATIENCE * clock.rate), channels, np.float64)
        self._first: int | None = None

    @property
    def written(self) -> int:
        """Number of samples written so far."""
        return self._samples.end

    def begin(self, tick: int) -> None:
        """Play sample 0 at `tick`."""
        self._first = tick

    def played(self, tick: int) -> int:
        """Number of samples generated up to `tick`, at most those written."""
        return min(self._due(tick), self.written)

    def dry(self, tick: int) -> bool:
        """Whether more samples were due by `tick` than have been written."""
        return self._due(tick) > self.written

    def space(self, tick: int) -> int:
        """Free space at `tick` in samples."""
        capacity = self._buffer if self._first is None else self._buffer + self._memory
        return capacity - (self.written - self.played(tick))

    def tick_of_space(self, samples: int) -> int | None:
        """Tick at which there will be space for `samples` samples (at most the capacity); None while not running."""
        if self._first is None:
            return None
        capacity = self._buffer + self._memory
        return self._clock.ticks(self._first, self.written + min(samples, capacity) - capacity - 1)

    def append(self, samples: NDArray[np.float64]) -> None:
        """Append samples, shape (n, channels); the caller ensures that there is space for them."""
        self._samples.append(samples)

    def signal(self, channel: int) -> Signal:
        """Signal of a channel's terminal during the generation."""

        def volts(first: int, n: int) -> NDArray[np.float64]:
            assert self._first is not None
            numbers = self._clock.numbers(self._first, np.arange(first, first + n))
            return self._samples.at(np.minimum(numbers, self.written - 1))[:, channel]

        return volts

    def _due(self, tick: int) -> int:
        return 0 if self._first is None else self._clock.passed(self._first, tick)


class Instant:
    """Source of a common tick for everything that starts or changes simultaneously.

    `tick` is the plant's clock; it is read under the lock and must not block. The plant takes the same lock when it
    reads past ticks, so that a decision made under the lock precedes every read of the tick that it concerns.
    """

    def __init__(self, tick: Callable[[], int]) -> None:
        self._tick = tick
        self._next: int | None = None
        self.lock = threading.RLock()

    @property
    def now(self) -> int:
        """The latest tick."""
        return self._tick()

    @contextmanager
    def next(self) -> Generator[int]:
        """Context manager that provides the next tick; the plant cannot read this tick before the context ends. A
        context inside another one has the tick of the outer one.
        """
        with self.lock:
            outer = self._next
            self._next = tick = self._tick() + 1 if outer is None else outer
            try:
                yield tick
            finally:
                self._next = outer


class OutputTerminal:
    """Analogue output that holds a value or plays a signal; every change takes effect at a tick."""

    def __init__(self, instant: Instant) -> None:
        self._instant = instant
        self._changes: deque[tuple[int, Signal]] = deque([(0, _constant(0.0))])

    def __call__(self, first: int, n: int) -> NDArray[np.float64]:
        """Volts at `n` past ticks from `first` on, shape (n,). Ticks must be read in order, since earlier changes are
        discarded.
        """
        with self._instant.lock:
            while len(self._changes) > 1 and self._changes[1][0] <= first:
                self._changes.popleft()
            volts = np.empty(n)
            for start, signal in self._changes:
                start = max(start, first)
                if start < first + n:
                    volts[start - first :] = signal(start, first + n - start)
            return volts

    def hold(self, volts: float) -> None:
        """Output `volts` from the next tick on."""
        with self._instant.next() as tick:
            self.follow(tick, _constant(volts))

    def follow(self, tick: int, signal: Signal) -> None:
        """Play `signal` from `tick` on, which must be the next tick."""
        self._changes.append((tick, signal))

    def freeze(self) -> None:
        """Hold the present value."""
        with self._instant.next() as tick:
            self.hold(self.volts_at(tick - 1))

    def volts_at(self, tick: int) -> float:
        """Volts at `tick`, which must not precede the last tick read."""
        with self._instant.lock:
            signal = next(signal for start, signal in reversed(self._changes) if start <= tick)
            return float(signal(tick, 1)[0])


def _constant(volts: float) -> Signal:
    def signal(_: int, n: int) -> NDArray[np.float64]:
        return np.full(n, volts)

    return signal
