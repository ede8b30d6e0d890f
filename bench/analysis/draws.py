"""Random draws of sensor errors for uncertainty evaluations (GUM Supplement 1)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Draws:
    """Draws of sensor errors from one generator, `n` per call, in the order of the calls."""

    def __init__(self, random: np.random.Generator, n: int) -> None:
        self._random, self.n = random, n

    def uniform(self, low: float, high: float) -> Array:
        """Uniform numbers, shape (n,)."""
        return self._random.uniform(low, high, self.n)

    def normal(self, *rows: int) -> Array:
        """Standard normal numbers, shape (*rows, n)."""
        return self._random.standard_normal((*rows, self.n))


class SharedDraws(Draws):
    """Draws that are generated once and are the same for every pair of peaks."""

    def __init__(self, seed: int, n: int) -> None:
        super().__init__(np.random.default_rng(seed), n)
        self._asked: tuple[tuple[str, tuple[Any, ...]], ...] = ()
        self._kept: dict[object, Array] = {}
        self._states: dict[object, Any] = {(): self._random.bit_generator.state}

    def again(self) -> "SharedDraws":
        """Restart the draws from the first one. Returns this object."""
        self._asked = ()
        return self

    def uniform(self, low: float, high: float) -> Array:
        return self._repeated("uniform", low, high, self.n)

    def normal(self, *rows: int) -> Array:
        return self._repeated("standard_normal", (*rows, self.n))

    def _repeated(self, kind: str, *arguments: Any) -> Array:
        before = self._asked
        self._asked = asked = (*before, (kind, arguments))
        if asked not in self._kept:
            # the calls differ from the earlier ones: for example, a zero at rest needs draws that a mean over a cycle
            # does not need; they go on from the last call that was the same
            self._random.bit_generator.state = self._states[before]
            self._kept[asked] = getattr(self._random, kind)(*arguments)
            self._states[asked] = self._random.bit_generator.state
        return self._kept[asked]
