"""What leaves the analogue outputs, tick by tick."""

import threading
from collections import deque
from collections.abc import Callable, Generator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

Signal = Callable[[int, int], NDArray[np.float64]]
"""Volts at `n` ticks from tick `first` on: `signal(first, n)`, shape (n,)."""


class Instant:
    """Where now becomes one tick for everything that starts or changes together.

    `tick` is the plant's clock; it is read under the lock and must not wait for anything. The plant, which asks for
    ticks that have passed, takes the same lock: what is decided here is decided before anybody looks at it.
    """

    def __init__(self, tick: Callable[[], int]) -> None:
        self._tick = tick
        self.lock = threading.RLock()

    @property
    def now(self) -> int:
        """The last tick that has come."""
        return self._tick()

    @contextmanager
    def next(self) -> Generator[int]:
        """The next tick: nothing of it has been asked for while this context lasts."""
        with self.lock:
            yield self._tick() + 1


class OutputTerminal:
    """One analogue output. It holds a value, or follows a signal; both change from one tick to the next."""

    def __init__(self, instant: Instant) -> None:
        self._instant = instant
        self._changes: deque[tuple[int, Signal]] = deque([(0, _constant(0.0))])

    def __call__(self, first: int, n: int) -> NDArray[np.float64]:
        """Volts at `n` passed ticks from `first` on, shape (n,); asked for in order, so the past is forgotten."""
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
        """Go to `volts` at the next tick and stay there."""
        with self._instant.next() as tick:
            self.follow(tick, _constant(volts))

    def follow(self, tick: int, signal: Signal) -> None:
        """Play `signal` from `tick` on, which is the next one."""
        self._changes.append((tick, signal))

    def freeze(self) -> None:
        """Stay at the present value."""
        with self._instant.next() as tick:
            self.hold(self.volts_at(tick - 1))

    def volts_at(self, tick: int) -> float:
        """Volts at one tick that was not asked for yet, or is the last that was."""
        with self._instant.lock:
            signal = next(signal for start, signal in reversed(self._changes) if start <= tick)
            return float(signal(tick, 1)[0])


def _constant(volts: float) -> Signal:
    def signal(_: int, n: int) -> NDArray[np.float64]:
        return np.full(n, volts)

    return signal
