"""From the rate of the bench to that of the model: low-pass, whole-number decimation, and a delay for each signal."""

from collections.abc import Sequence
from math import ceil

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bench.analysis.transient_base import MODEL_RATE

Array = NDArray[np.float64]

_CUTOFF = 0.35
"""Middle of the transition band, as a share of the model's rate. The filter cards end the motion far below it."""
_HALF_WIDTH = 6
"""Half the length of the impulse response, in samples of the model."""
_KAISER = 5.65
"""beta of the window for 60 dB (Kaiser, 1974); with that length the transition takes 0.3 of the model's rate."""


class Resampler:
    """A linear-phase low-pass for signals in blocks of any size: the same samples go out however they are cut.

    Every signal is delayed by `latency` [s], and by its own of the `delays` [s] (0 or more) besides, of which fractions
    of a sample are interpolated. Samples go out every `dt` [s]; before the first block everything was zero.
    """

    def __init__(self, sample_rate: float, delays: Sequence[float]) -> None:
        self.every = max(round(sample_rate / MODEL_RATE), 1)
        self.dt = self.every / sample_rate
        half = _HALF_WIDTH * self.every
        self.latency = half / sample_rate
        late = np.array(delays) * sample_rate
        length = 2 * half + 1 + ceil(float(late.max()))
        # of the newest sample last, as they lie in a window
        places = (np.arange(length)[::-1] - half - late[:, None]) / self.every
        window = np.i0(_KAISER * np.sqrt(np.maximum(1.0 - (places / _HALF_WIDTH) ** 2, 0.0)))
        taps = np.sinc(2.0 * _CUTOFF * places) * np.where(np.abs(places) <= _HALF_WIDTH, window, 0.0)
        self._taps = taps / taps.sum(axis=1, keepdims=True)
        self._kept = np.zeros((length - 1, len(late)))
        self._skip = 0

    def push(self, block: Array) -> tuple[Array, int]:
        """The samples, shape (m, n_signals), that a block of shape (n, n_signals) completes; NaN where one was within
        the filter's reach. And by how many of the block's samples its last one is newer than the last of them.
        """
        line = np.concatenate((self._kept, block))
        chosen = sliding_window_view(line, self._taps.shape[1], axis=0)[self._skip :: self.every]
        self._kept = line[len(block) :]
        self._skip = (self._skip - len(block)) % self.every
        return np.einsum("nct,ct->nc", chosen, self._taps), self.every - 1 - self._skip
