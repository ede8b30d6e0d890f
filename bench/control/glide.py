"""Complex shares of a waveform's harmonics that go smoothly from one set of values to the next."""

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import HARMONICS


class Glide:
    """Share k belongs to harmonic k + 1. They begin as a pure sine, (1, 0, 0, ...), and change along a smoothstep."""

    def __init__(self) -> None:
        self._from = self._to = _pure()
        self._length, self._done = 1, 1

    def to(self, shares: tuple[complex, ...], samples: int) -> None:
        """Be at `shares` after `samples` more samples; harmonics that are not named go to zero."""
        target = np.zeros(HARMONICS, dtype=np.complex128)
        target[: len(shares)] = shares
        self._from, self._to = self._at(np.array([self._done]))[0], target
        self._length, self._done = max(samples, 1), 0

    def to_pure(self, samples: int) -> None:
        """Be a pure sine after `samples` more samples."""
        if not np.array_equal(self._to, _pure()):
            self.to((1.0,), samples)

    def next(self, n: int) -> NDArray[np.complex128]:
        """Shares at the next `n` samples, shape (n, HARMONICS), or (1, HARMONICS) while they rest."""
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
