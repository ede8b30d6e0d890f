"""Detection of a fallen block from the signal of the first storey alone."""

from collections import deque
from math import isfinite, pi, sin

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import U1
from sim.specimen import Specimen

FALLEN_TILT = 0.25
"""Tilt [rad] at which a block counts as fallen: about twice the critical angle of the default block."""


PERIODS = 2.0
"""Number of periods of the frame's first mode over which the first storey's drift u1 is averaged.

In violent rocking without a fall (30 simulated records, up to 3 times the uplift acceleration) the mean over one period
reaches 1.28 times the threshold, and the mean over two periods 0.68 times. Simulated falls were detected 0.2 to 0.9 s
after the tilt of the block had exceeded `FALLEN_TILT`.
"""


class FallWatch:
    """Detector of a fallen block, which deflects the frame permanently, by a mean u1 of k_C h1 sin(theta) / (k1 + k_C).

    The mean is taken over the last samples, at least `PERIODS` of the frame's first mode, which suppresses the forced
    motion and the motion in that mode; the threshold is half the offset at `FALLEN_TILT`.
    """

    def __init__(self, specimen: Specimen, sample_rate: float) -> None:
        frame, k_c = specimen.frame, specimen.k_c
        self._threshold = 0.5 * k_c * frame.h1 * sin(FALLEN_TILT) / (frame.k1 + k_c)
        self._span = PERIODS * 2.0 * pi / frame.natural_frequencies[0] * sample_rate
        self._sums: deque[tuple[int, int, float]] = deque()
        self._total = self._seen = 0

    @property
    def threshold(self) -> float:
        """Magnitude of the mean of u1 [m] above which the block counts as fallen."""
        return self._threshold

    def fallen(self, signals: NDArray[np.float64]) -> bool:
        """Process the next signals, shape (n, n_signals). Returns whether the rocking block has fallen."""
        if self._threshold == 0.0:
            return False
        u1 = signals[:, U1]
        seen, summed = u1.size, float(u1.sum())
        if not isfinite(summed):
            valid = np.isfinite(u1)
            seen, summed = int(np.count_nonzero(valid)), float(u1[valid].sum())
        self._sums.append((u1.size, seen, summed))
        self._total, self._seen = self._total + u1.size, self._seen + seen
        if self._total < self._span:
            return False
        seen, summed = self._seen, sum(each for _, _, each in self._sums)
        while self._total - self._sums[0][0] >= self._span:
            size, valid_samples, _ = self._sums.popleft()
            self._total, self._seen = self._total - size, self._seen - valid_samples
        # missing samples are handled by the guard; they give no information about the block
        return 2 * seen > self._total and abs(summed / seen) > self._threshold
