"""Interpolation of a sensor's values on the grid of another clock, and the check of their plausibility."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.rig import Alignment, RawValues


@dataclass(frozen=True)
class Marks:
    """Counts that mark samples without a valid value: lost, not received in time, or implausible."""

    lost: int
    late: int
    implausible: int


class Resampler:
    """Interpolates between readings, of which at least the last `capacity` are kept. A reading consists of its index,
    its time on the sensor's clock [s], and counts or a fault mark.

    Counts beyond +-`largest` are fault marks; `lost_mark` marks missing values, `late_mark` values not yet received.
    """

    def __init__(self, capacity: int, largest: int, lost_mark: int, late_mark: int) -> None:
        self._capacity, self._largest, self._lost_mark, self._late_mark = capacity, largest, lost_mark, late_mark
        self._index = np.zeros(2 * capacity, dtype=np.int64)
        self._time = np.zeros(2 * capacity)
        self._counts = np.zeros(2 * capacity, dtype=np.int16)
        self._end = 0

    @property
    def last(self) -> tuple[int, float] | None:
        """Index and time [s] of the newest reading; None without readings."""
        return (int(self._index[self._end - 1]), float(self._time[self._end - 1])) if self._end else None

    def values(self, begin: float) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Times [s] of the readings from the time `begin` [s] on, and a mask that is False for fault marks, shape (n,)
        each.
        """
        first = int(np.searchsorted(self._time[: self._end], begin))
        kept = slice(first, self._end)
        return self._time[kept].copy(), np.abs(self._counts[kept].astype(np.int32)) <= self._largest

    def clear(self) -> None:
        """Discard all readings."""
        self._end = 0

    def add(self, index: NDArray[np.int64], time: NDArray[np.float64], counts: NDArray[np.int16]) -> None:
        """Append readings, shape (n,) each, with ascending times later than all previous ones."""
        index, time, counts = index[-self._capacity :], time[-self._capacity :], counts[-self._capacity :]
        if self._end + time.size > self._time.size:
            begin, end = self._end - self._capacity + time.size, self._end
            for kept in (self._index, self._time, self._counts):
                kept[: end - begin] = kept[begin:end]
            self._end = end - begin
        new = slice(self._end, self._end + time.size)
        self._index[new], self._time[new], self._counts[new] = index, time, counts
        self._end = new.stop

    def at(self, times: NDArray[np.float64]) -> NDArray[np.int16]:
        """Counts at sensor times, shape (n,), by linear interpolation between readings.

        Where one of the two readings is a fault mark, that mark is returned; where a reading is missing, and before the
        first one, the mark of lost values; after the last reading, at a time that is NaN, and if there are fewer than
        two readings, the mark of late values.
        """
        seen = np.full(times.shape, self._late_mark, dtype=np.int16)
        if self._end < 2:
            return seen
        time, counts = self._time[: self._end], self._counts[: self._end]
        seen[times <= time[-1]] = self._lost_mark
        inside = np.flatnonzero((times >= time[0]) & (times <= time[-1]))
        before = np.clip(np.searchsorted(time, times[inside], side="right") - 1, 0, self._end - 2)
        whole = self._index[before + 1] - self._index[before] == 1
        inside, before = inside[whole], before[whole]
        first, second = counts[before], counts[before + 1]
        place = (times[inside] - time[before]) / (time[before + 1] - time[before])
        between = np.rint(first + place * (second - first.astype(np.float64))).astype(np.int16)
        values = np.where(np.abs(second.astype(np.int32)) > self._largest, second, between)
        seen[inside] = np.where(np.abs(first.astype(np.int32)) > self._largest, first, values)
        return seen


RARE, RECOVERY = 3.0, 0.05
"""Number of implausible values at which further ones are no longer considered single faults, and the decrease of that
number per plausible value.
"""


class Plausibility:
    """Marks single values that differ from the last plausible one by more than `largest_step` per measurement since
    then, as when a flipped bit gives another valid distance. Counts beyond +-`largest` are fault marks and are left
    unchanged.

    Only rare jumps are marked: frequent or lasting ones are treated as motion, which the guard must judge.
    """

    def __init__(self, largest: int, largest_step: float, mark: int) -> None:
        self._largest, self._largest_step, self._mark = largest, largest_step, mark
        self.count = 0
        """Number of marked values."""
        self.restart()

    def restart(self) -> None:
        """Discard the history, as after a restart of the sensor; the number of marked values is kept."""
        self._before: tuple[int, int] | None = None
        self._doubt = 0.0

    def marked(self, index: NDArray[np.int64], counts: NDArray[np.int16]) -> NDArray[np.int16]:
        """The counts of the next measurements `index`, both of shape (n,), with implausible values replaced by the
        mark.
        """
        is_value = np.abs(counts.astype(np.int32)) <= self._largest
        places, values = index[is_value], counts[is_value].astype(np.int64)
        if not values.size or not np.isfinite(self._largest_step):
            return counts
        before, value = self._before or (int(places[0]), int(values[0]))
        gaps = np.diff(places, prepend=before)
        if (np.abs(np.diff(values, prepend=value)) <= self._largest_step * np.maximum(gaps, 1)).all():
            self._before = int(places[-1]), int(values[-1])
            self._doubt = max(self._doubt - RECOVERY * values.size, 0.0)
            return counts
        good = np.ones(values.size, dtype=np.bool_)
        for k, (place, one) in enumerate(zip(places.tolist(), values.tolist(), strict=True)):
            if abs(one - value) <= self._largest_step * max(place - before, 1):
                before, value = place, one
                self._doubt = max(self._doubt - RECOVERY, 0.0)
            elif self._doubt >= RARE:
                before, value = place, one
                self._doubt = RARE + 1.0
            else:
                good[k] = False
                self._doubt += 1.0
        self._before = before, value
        self.count += int(np.count_nonzero(~good))
        marked = counts.copy()
        marked[np.flatnonzero(is_value)[~good]] = self._mark
        return marked


def resampled(
    raw: RawValues,
    alignment: Alignment,
    marked: Callable[[NDArray[np.int64]], NDArray[np.int16]],
    largest: int,
    marks: Marks,
    samples: NDArray[np.int64],
    sample_rate: float,
) -> NDArray[np.int16]:
    """Counts at the ascending sample numbers `samples` of a run, shape (n,), from all values received in the run, with
    times according to its `alignment`.

    Values that arrived too late for their block are included. `marked` converts the words of the sensor to counts of at
    most +-`largest`, or to fault marks outside that range.
    """
    # of repeated values, the first one is used
    order = np.flatnonzero(raw.time > np.maximum.accumulate(np.concatenate(([-1], raw.time[:-1]))))
    resampler = Resampler(max(order.size, 2), largest, marks.lost, marks.late)
    resampler.add(raw.index[order], np.multiply(1e-6, raw.time[order], dtype=np.float64), marked(raw.code[order]))
    seconds = samples / sample_rate
    return resampler.at((seconds - alignment.delay - alignment.offset) / alignment.rate)
