"""Checks of the measurement itself: lost and stuck sensors, late blocks, and clocks that run at different rates."""

from collections import deque
from operator import lt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.guard.conversion import Extremes
from bench.guard.limits import Limits, Persistence, Violation
from drivers.rig import Channel, Counts

LATE, CLOCKS = "delay of a block of samples", "relative difference between the clocks"
TIMING = (LATE, CLOCKS)
"""Quantities whose limits concern the arrival of samples, which depends on the computer and its connection to the
device, not on the motion.
"""
_DRIVEN = 0.05
"""Drive change, relative to the drive voltage limit, above which the table is considered driven, so that all counts
must change.
"""


class SensorWatch:
    """Detects channels without valid samples, and channels whose counts are constant while the table is driven."""

    def __init__(self, channels: tuple[Channel, ...], sample_rate: float, limits: Limits) -> None:
        self._channels = channels
        self._limits = limits
        self._lost = [Persistence(round(limits.sensor_loss * sample_rate)) for _ in channels]
        self._needed = max(round(limits.stuck * sample_rate), 2)
        self._counting = False
        self._moving = np.zeros(len(channels), dtype=np.int64)
        self._still = self._moving
        self._last: NDArray[np.integer[Any]] = np.full(len(channels), np.iinfo(np.int32).min, dtype=np.int64)
        self._drives: deque[NDArray[np.float64]] = deque()
        self._driven_samples = 0

    def check(
        self,
        first: int,
        counts: Counts,
        values: NDArray[np.float64],
        drive: NDArray[np.float64],
        extremes: Extremes | None = None,
    ) -> list[Violation]:
        """Violations by sensors, from their counts and values, shape (n, n_channels), and the drive played [V], shape
        (n,).

        If `extremes` are given and all channels change, a block without missing samples is accepted without examining
        individual samples.
        """
        self._keep(drive)
        if extremes is not None and not self._counting and all(map(lt, extremes.low, extremes.high)):
            self._still, self._last = self._moving, counts[-1]
            return []
        found = [*self._losses(first, counts, values), *self._stuck(first, counts)]
        self._counting = any(each.counting for each in self._lost)
        return found

    def _losses(self, first: int, counts: Counts, values: NDArray[np.float64]) -> list[Violation]:
        found: list[Violation] = []
        invalid = np.isnan(values)
        for column, channel in enumerate(self._channels):
            at = self._lost[column].first(invalid[:, column])
            if at is not None:
                why = channel.faults.get(int(counts[at, column]))
                what = f"time without a valid sample from {channel.name}" + (f" ({why})" if why else "")
                found.append(Violation(what, self._limits.sensor_loss, self._limits.sensor_loss, "s", first + at))
        return found

    def _stuck(self, first: int, counts: Counts) -> list[Violation]:
        """Violations for channels with a constant count over the last `_needed` samples while the table was driven."""
        n = len(counts)
        same = (counts == counts[0]).all(axis=0) & (counts[0] == self._last)
        self._still = np.where(same, self._still + n, 0)
        self._last = counts[-1]
        if not (self._still >= self._needed).any() or not self._driven():
            return []
        limit = self._limits.stuck
        return [
            Violation(f"time with a constant count of {self._channels[column].name}", limit, limit, "s", first + n - 1)
            for column in np.flatnonzero(self._still >= self._needed)
        ]

    def _keep(self, drive: NDArray[np.float64]) -> None:
        """Keep the drive blocks that contain the last `_needed` samples."""
        self._drives.append(drive)
        self._driven_samples += drive.size
        while self._driven_samples - self._drives[0].size >= self._needed:
            self._driven_samples -= self._drives.popleft().size

    def _driven(self) -> bool:
        """Whether the drive changed by more than `_DRIVEN` times its limit in each half of the last `_needed` samples.

        Near its peaks, a slow drive hardly changes within a single block.
        """
        if self._driven_samples < self._needed:
            return False
        blocks, middle = list(self._drives), len(self._drives) // 2
        halves = (blocks[:middle], blocks[middle:]) if middle else (blocks,)
        least = min(float(np.ptp(np.concatenate(half))) for half in halves)
        return least > _DRIVEN * self._limits.drive_voltage


_SETTLED = 20.0
"""Time in a run before the two clocks are compared [s], long compared with the delay of a block."""
_STRETCH = 5.0
"""Length [s] of the windows at the start of a run and at its current end; the least delayed blocks of the two are
compared.
"""


class TimeWatch:
    """Check of the delay of each block, and of the difference in rate between sample clock and computer clock."""

    def __init__(self, sample_rate: float, limits: Limits) -> None:
        self._rate = sample_rate
        self._limits = limits
        self._origin: float | None = None
        self._first_end = 0
        self._early = (0.0, 0.0)
        self._recent: deque[tuple[float, float]] = deque()

    def check(self, now: float, end: int) -> list[Violation]:
        """Violations for a block that arrived at `now` [s] and contains the samples before index `end`."""
        if self._origin is None:
            self._origin, self._first_end = now, end
            return []
        sampled = (end - self._first_end) / self._rate
        late = now - self._origin - sampled
        # single blocks may be late, including the first one of a run
        if sampled <= _STRETCH:
            self._early = min(self._early, (late, sampled))
        self._recent.append((late, sampled))
        while self._recent[0][1] < sampled - _STRETCH:
            self._recent.popleft()
        limits, difference = self._limits, 0.0
        if sampled > _SETTLED:
            (before, then), (after, since) = self._early, min(self._recent)
            difference = (after - before) / (since - then)
            # an allowed difference of the clocks delays no block, however long the run
            late -= min(max(difference, -limits.clock), limits.clock) * sampled
        if late > limits.late:
            return [Violation(LATE, late, limits.late, "s", end - 1, timing=True)]
        if abs(difference) > limits.clock:
            return [Violation(CLOCKS, abs(difference), limits.clock, "1", end - 1, timing=True)]
        return []
