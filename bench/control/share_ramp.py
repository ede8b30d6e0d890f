"""Shares of a drive's harmonics, with smooth changes that begin at given samples."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import HARMONICS


class ShareRamp:
    """Shares of the harmonics, fundamental first: initially a pure sine, (1, 0, 0, ...); changes follow a
    smoothstep.
    """

    def __init__(self) -> None:
        self._from = self._to = _pure()
        self._length, self._done = 1, 1
        self._waiting: deque[tuple[int, tuple[complex, ...], int]] = deque()
        self._played = 0

    def to(self, shares: tuple[complex, ...], samples: int, wait: int = 0) -> None:
        """Change to `shares` over `samples` samples, beginning after `wait` samples; all other harmonics change to
        zero.

        Pending changes that are due at the same sample as this one or later are cancelled.
        """
        due = self._played + wait
        while self._waiting and self._waiting[-1][0] >= due:
            self._waiting.pop()
        if wait > 0:
            self._waiting.append((due, shares, samples))
            return
        target = np.zeros(HARMONICS, dtype=np.complex128)
        target[: len(shares)] = shares
        self._from, self._to = self._at(np.array([self._done]))[0], target
        self._length, self._done = max(samples, 1), 0

    def to_pure(self, samples: int) -> None:
        """Change to a pure sine within the next `samples` samples."""
        if self._waiting or not np.array_equal(self._to, _pure()):
            self.to((1.0,), samples)

    @property
    def constant(self) -> bool:
        """Whether the shares remain as they are until the next command."""
        return not self._waiting and self._done >= self._length

    def next(self, n: int) -> NDArray[np.complex128]:
        """Shares at the next `n` samples, shape (n, HARMONICS), or (1, HARMONICS) while they are constant."""
        if not self._waiting or self._waiting[0][0] >= self._played + n:
            return self._follow(n)
        pieces = list[NDArray[np.complex128]]()
        while n > 0:
            here = min(n, self._waiting[0][0] - self._played) if self._waiting else n
            if here > 0:
                pieces.append(np.broadcast_to(self._follow(here), (here, HARMONICS)))
                n -= here
            if self._waiting and self._waiting[0][0] == self._played:
                _, shares, samples = self._waiting.popleft()
                waiting, self._waiting = self._waiting, deque()
                self.to(shares, samples)
                self._waiting = waiting
        return np.concatenate(pieces)

    def _follow(self, n: int) -> NDArray[np.complex128]:
        self._played += n
        if self._done >= self._length:
            return self._to[None, :]
        found = self._at(self._done + np.arange(1, n + 1))
        self._done += n
        return found

    def _at(self, done: NDArray[np.int_]) -> NDArray[np.complex128]:
        x = np.minimum(done / self._length, 1.0)[:, None]
        return self._from + (self._to - self._from) * (x * x * (3.0 - 2.0 * x))


def _pure() -> NDArray[np.complex128]:
    shares = np.zeros(HARMONICS, dtype=np.complex128)
    shares[0] = 1.0
    return shares
