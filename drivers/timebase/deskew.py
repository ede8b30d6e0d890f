"""Correction of the inputs' samples for their known delays."""

from collections.abc import Sequence

import numpy as np

from sim.channel import Counts

_NODES = 4
"""Number of samples used for an interpolated value."""
_WHOLE = 1.0e-4
"""Distance from a whole number of samples below which a shift is not interpolated [samples]."""


class Deskew:
    """Aligns samples with the edges of the sample clock: sample i of the result is the value of every signal at edge i.

    Input k is delayed by `delays[k]` [s]; `rate` is the sample rate [1/s]. Values between samples are interpolated by a
    cubic through four samples; the error is below 1e-4 of the amplitude at frequencies up to 0.02 of the sample rate.
    Between two counts, one of which is outside `valid`, the result is that count. `latency` is the number of samples
    that must have been acquired beyond those returned. Before the first sample, signals are assumed constant.
    """

    def __init__(self, delays: Sequence[float], rate: float, valid: Sequence[tuple[int, int]]) -> None:
        shifts = np.array(delays) * rate
        nearest = np.rint(shifts)
        shifts = np.where(np.abs(shifts - nearest) < _WHOLE, nearest, shifts)
        self.latency = max(int(np.ceil(shifts.max(initial=0.0))), 0)
        self._columns = [_Column(shift, self.latency, valid[k]) for k, shift in enumerate(shifts)]
        self._before = max(0, *(-column.first for column in self._columns))
        self._is_needed = bool(shifts.any())
        self._kept: Counts | None = None

    def begin(self) -> None:
        """Discard the samples of the previous run."""
        self._kept = None

    def missing(self, n: int) -> int:
        """Number of samples to read before the next `n` can be returned."""
        return n + (self.latency if self._kept is None else 0)

    def moved(self, raw: Counts) -> Counts:
        """The next samples, shape (n, channels), from those read, shape (missing(n), channels)."""
        if not self._is_needed:
            return raw
        kept = np.repeat(raw[:1], self._before, axis=0) if self._kept is None else self._kept
        rows = np.concatenate((kept, raw))
        n = len(rows) - self._before - self.latency
        self._kept = rows[n:]
        moved = np.empty((n, raw.shape[1]), raw.dtype)
        for k, column in enumerate(self._columns):
            column.move(rows[:, k], self._before, moved[:, k])
        return moved


class _Column:
    """Interpolation of one input at `shift` samples after the returned ones."""

    def __init__(self, shift: float, latency: int, valid: tuple[int, int]) -> None:
        whole = int(np.floor(shift))
        self._valid = valid
        self._is_whole = shift == whole
        self._bracket = whole
        self.first = whole if self._is_whole else min(whole - 1, latency - _NODES + 1)
        nodes = self.first + np.arange(_NODES)
        self._weights = [
            float(np.prod([(shift - other) / (node - other) for other in nodes if other != node])) for node in nodes
        ]

    def move(self, column: Counts, before: int, into: Counts) -> None:
        n = into.size

        def at(offset: int) -> Counts:
            return column[before + offset : before + offset + n]

        if self._is_whole:
            into[:] = at(self._bracket)
            return
        value = np.zeros(n)
        for j, weight in enumerate(self._weights):
            value += weight * at(self.first + j)
        lowest, highest = self._valid
        into[:] = np.clip(np.rint(value), lowest, highest)
        for node in (at(self._bracket), at(self._bracket + 1)):
            rail = (node < lowest) | (node > highest)
            into[rail] = node[rail]
