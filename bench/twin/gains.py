"""alpha_2 of the models while the measured one becomes known: Eq. (10) under the motion that the table really made.

Under a sine, the peak of the coupled drift over the last cycles, over that of the bare frame in the steady state at the
achieved amplitude, which is known exactly (`sim.linear`). Under a record, the peaks since it began; the bare frame runs
beside, under the same motion.
"""

from collections import deque
from dataclasses import dataclass
from math import tau

import numpy as np
from numpy.typing import NDArray

from bench.twin.ensemble import Candidates, Ensemble
from sim.linear import steady_peaks

Array = NDArray[np.float64]

_CYCLES = 5.0
"""Cycles of a sine over which peak and amplitude are taken."""


@dataclass(frozen=True)
class Measured:
    """The gain that a protocol has just stated: under a sine of `omega` [rad/s], or under a record (None)."""

    alpha_2: float
    omega: float | None


class Gains:
    """Of all candidates, in one run."""

    def __init__(self, those: Candidates, dt: float) -> None:
        self._those, self._dt = those, dt
        self._coupled = those.specimens[0].beta is not None
        self._peaks = np.zeros(len(those.specimens))
        self._bare_peaks = np.zeros(len(those.specimens))
        self._bare: Ensemble | None = None
        self._bare_per_unit: tuple[float, Array] | None = None
        # accelerations and largest drifts that are still needed: all, while it is not known what kind of test this is
        self._held: deque[tuple[Array, Array]] = deque()

    def push(self, acceleration: Array, drift: Array, measured: Measured | None) -> Array:
        """alpha_2 of the candidates that go on, shape (k,), from the next accelerations [m/s2], shape (n,), and their
        drifts [m], shape (k, n). NaN where a block has fallen, and while nothing has been `measured`.
        """
        k = len(drift)
        if not self._coupled:
            return np.full(k, np.nan)
        largest = np.abs(drift).max(axis=1, initial=0.0)
        self._peaks = np.maximum(self._peaks[:k], largest)
        self._held.append((acceleration, largest))
        if measured is None:
            return np.full(k, np.nan)
        return self._under_record(k) if measured.omega is None else self._under_sine(measured.omega, k)

    def _under_sine(self, omega: float, k: int) -> Array:
        needed = round(_CYCLES * tau / omega / self._dt)
        held = sum(part.size for part, _ in self._held)
        while held - self._held[0][0].size >= needed:
            held -= self._held.popleft()[0].size
        if held < needed:
            return np.full(k, np.nan)
        acceleration = np.concatenate([part for part, _ in self._held])[-needed:]
        phase = omega * self._dt * np.arange(needed)
        waves = np.column_stack((np.cos(phase), np.sin(phase), np.ones(needed)))
        amplitude = float(np.hypot(*np.linalg.lstsq(waves, acceleration)[0][:2]))
        if self._bare_per_unit is None or self._bare_per_unit[0] != omega:
            drifts = [steady_peaks(specimen.bare(), omega, 1.0).drift for specimen in self._those.specimens]
            self._bare_per_unit = omega, np.array(drifts)
        bare = amplitude * (self._those.scales * self._bare_per_unit[1])[:k]
        return _ratio(np.array([largest[:k] for _, largest in self._held]).max(axis=0), bare)

    def _under_record(self, k: int) -> Array:
        if self._bare is None:
            self._bare = Ensemble(self._those.bare(), self._dt)
        self._bare.keep(k)
        u1, u2, _ = self._bare.feed(np.concatenate([part for part, _ in self._held]))
        self._held.clear()
        self._bare_peaks = np.maximum(self._bare_peaks[:k], np.abs(u2 - u1).max(axis=1, initial=0.0))
        return _ratio(self._peaks, self._bare_peaks)


def _ratio(coupled: Array, bare: Array) -> Array:
    return np.divide(coupled, bare, out=np.full(len(coupled), np.nan), where=bare > 0.0)
