"""Watches the sensors themselves: one that is lost or stuck says nothing of the motion."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from bench.guard.limits import Limits
from bench.guard.persistence import Persistence
from bench.guard.violation import Violation
from drivers.rig import Channel, Counts

_DRIVEN = 0.05
"""Share of the largest command by which the drive of a table that counts as driven changes: every sensor then moves."""


class SensorWatch:
    """Finds channels without valid samples, and channels whose counts stand still while the table is driven."""

    def __init__(self, channels: tuple[Channel, ...], sample_rate: float, limits: Limits) -> None:
        self._channels = channels
        self._limits = limits
        self._lost = [Persistence(round(limits.sensor_loss * sample_rate)) for _ in channels]
        self._needed = max(round(limits.stuck * sample_rate), 2)
        self._still = np.zeros(len(channels), dtype=np.int64)
        self._last = np.full(len(channels), np.iinfo(np.int32).min, dtype=np.int64)
        self._drives: deque[tuple[int, float, float]] = deque()

    def check(
        self, first: int, counts: Counts, values: NDArray[np.float64], drive: NDArray[np.float64]
    ) -> list[Violation]:
        """What is wrong with the sensors: counts and values of shape (n, n_channels), drive of shape (n,) [V]."""
        return [*self._losses(first, counts, values), *self._stuck(first, counts, drive)]

    def _losses(self, first: int, counts: Counts, values: NDArray[np.float64]) -> list[Violation]:
        found: list[Violation] = []
        invalid = np.isnan(values)
        for column, channel in enumerate(self._channels):
            at = self._lost[column].first(invalid[:, column])
            if at is not None:
                why = channel.faults.get(int(counts[at, column]))
                what = f"time without a valid sample of {channel.name}" + (f" ({why})" if why else "")
                found.append(Violation(what, self._limits.sensor_loss, self._limits.sensor_loss, "s", first + at))
        return found

    def _stuck(self, first: int, counts: Counts, drive: NDArray[np.float64]) -> list[Violation]:
        """Channels whose last `needed` counts are one and the same, taken while the table was driven."""
        n = len(counts)
        same = (counts == counts[0]).all(axis=0) & (counts[0] == self._last)
        self._still = np.where(same, self._still + n, 0)
        self._last = counts[-1].astype(np.int64)
        if not self._driven(drive):
            return []
        limit = self._limits.stuck
        return [
            Violation(f"time that {self._channels[column].name} has shown one count", limit, limit, "s", first + n - 1)
            for column in np.flatnonzero(self._still >= self._needed)
        ]

    def _driven(self, drive: NDArray[np.float64]) -> bool:
        """Whether the drive moved enough in both halves of the last `needed` samples, this block of it included.

        Over single blocks a slow drive hardly moves where it turns round.
        """
        drives = self._drives
        drives.append((drive.size, float(drive.min()), float(drive.max())))
        total = sum(size for size, _, _ in drives)
        while total - drives[0][0] >= self._needed:
            total -= drives.popleft()[0]
        if total < self._needed:
            return False
        blocks, middle = list(drives), len(drives) // 2
        halves = (blocks[:middle], blocks[middle:]) if middle else (blocks,)
        least = min(max(high for _, _, high in half) - min(low for _, low, _ in half) for half in halves)
        return least > _DRIVEN * self._limits.drive_voltage
