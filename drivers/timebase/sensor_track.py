"""Values of a sensor with a free-running clock, interpolated to the sample clock."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.rig import Alignment
from drivers.timebase.clocks import SampleClock, SensorClock


class Resampler:
    """Interpolates about the last `capacity` readings: index, second of the sensor's clock, counts or fault mark.

    Counts beyond +-`largest` are fault marks, `lost_mark` is that of missing values.
    """

    def __init__(self, capacity: int, largest: int, lost_mark: int, late_mark: int) -> None:
        self._capacity, self._largest, self._lost_mark, self._late_mark = capacity, largest, lost_mark, late_mark
        self._index = np.zeros(2 * capacity, dtype=np.int64)
        self._time = np.zeros(2 * capacity)
        self._counts = np.zeros(2 * capacity, dtype=np.int16)
        self._end = 0

    @property
    def last(self) -> tuple[int, float] | None:
        """Index and time of the newest reading."""
        return (int(self._index[self._end - 1]), float(self._time[self._end - 1])) if self._end else None

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

        The fault mark where one of the two is not a distance, the mark of lost values where one of the two is missing.
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


@dataclass(frozen=True)
class Line:
    """Linear relation of clocks: second `time` of one is second `seconds` of another, which runs `rate` times as fast.

    The point is near the present, to avoid rounding errors on clocks that have run for weeks.
    """

    time: float
    seconds: float
    rate: float

    def seconds_at(self, time: float) -> float:
        """Second of the second clock at `time` of the first [s]."""
        return self.seconds + self.rate * (time - self.time)

    def time_at(self, seconds: float) -> float:
        """Second of the first clock at `seconds` of the second [s]."""
        return self.time + (seconds - self.seconds) / self.rate


_SLEW = 50e-6
"""Largest slew rate of the clock relation [s/s]: at 1 m/s it causes an error of 50 um/s."""
_FIRST_SLEW = 500e-6
"""The same in the first seconds [s/s], when the lines are known only to a fraction of a millisecond."""
_FIRST = 10.0
"""Duration of the first phase [s]."""


class Course:
    """Sensor's clock as a function of the sample clock: continuous, and linear within each block."""

    def __init__(self) -> None:
        self._began = self._seconds = self._time = np.nan

    @property
    def time(self) -> float:
        """Second of the sensor's clock at the last requested sample; NaN before the first."""
        return self._time

    def times(self, line: Line, seconds: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sensor times, shape (n,), at `seconds`, ascending, from the present `line`; advances to the last of them."""
        end = float(seconds[-1])
        if not self._seconds < float(seconds[0]):
            # the first request, or a request for the past: no point to continue from
            self._began = self._seconds = float(seconds[0])
            self._time = line.time_at(self._seconds)
        passed = end - self._seconds
        final = self._after(line, passed)
        rate = (final - self._time) / passed if passed > 0.0 else 1.0 / line.rate
        times = self._time + rate * (seconds - self._seconds)
        self._seconds, self._time = end, final
        return times

    def reach(self, line: Line, time: float) -> float:
        """The last second of the sample clock for which `times` would return at most `time` [s]."""
        known = line.seconds_at(time)
        if np.isnan(self._seconds):
            return known
        ahead = time - self._time
        if ahead < 0.0:
            return self._seconds + ahead * line.rate
        early = self._seconds + ahead / (1.0 / line.rate + self._slew)
        late = self._seconds + ahead / (1.0 / line.rate - self._slew)
        return min(max(known, early), late)

    def _after(self, line: Line, passed: float) -> float:
        """The time after `passed` seconds: on the line, or as close to it as the slew limit allows."""
        free = self._time + passed / line.rate
        allowed = self._slew * passed
        return min(max(line.time_at(self._seconds + passed), free - allowed), free + allowed)

    @property
    def _slew(self) -> float:
        return _FIRST_SLEW if self._seconds - self._began < _FIRST else _SLEW


_KEPT = 10.0
"""Length of the buffer of values [s]."""
_LEAST_HISTORY = 1.0
"""Shortest history of a clock for placing values [s]."""
RARE, RECOVERY = 3.0, 0.05
"""Number of implausible values within a short time above which they are no faults of single values, and the decrease of
that number with each plausible one.
"""
_BACK = 0.25
"""Age relative to the newest value [s] above which a value is no repetition: the sensor's clock was restarted."""


@dataclass(frozen=True)
class Marks:
    """Counts of samples without a value: lost between two values, not arrived in time, implausible."""

    lost: int
    late: int
    implausible: int


class SensorTrack:
    """Resamples the values of the sensor `name` on the grid of the sample clock.

    `rate` is its measuring rate [1/s]; `delay` [s] is added to the times found from arrivals. `marked` converts its
    codes to counts up to +-`largest`, and its error words to fault marks outside that range; `lost_mark` marks missing
    values. A restart of the sensor's clock begins a new history.
    """

    def __init__(
        self,
        name: str,
        rate: float,
        delay: float,
        marked: Callable[[NDArray[np.int32]], NDArray[np.int16]],
        largest: int,
        marks: Marks,
        largest_step: float = np.inf,
    ) -> None:
        self._name, self._rate, self._delay, self._marked = name, rate, delay, marked
        self._resampler = Resampler(round(_KEPT * rate), largest, marks.lost, marks.late)
        self._largest, self._marks, self._largest_step = largest, marks, largest_step
        self._before: tuple[int, int] | None = None
        self._doubt = 0.0
        self._sensor = SensorClock()
        self._course = Course()
        self._values = self._lost = self._late = self._implausible = 0
        self._asked = 0.0

    def begin(self) -> None:
        """Begin a run: restart the count of values, keep the history of the sensor's clock."""
        self._course = Course()
        self._values = self._lost = self._late = self._implausible = 0
        self._asked = 0.0

    def add(
        self,
        index: NDArray[np.int64],
        time: NDArray[np.float64],
        code: NDArray[np.int32],
        arrival: NDArray[np.float64],
    ) -> None:
        """Add readings in order, shape (n,) each: index, second of the sensor's clock, code, and arrival [s of the
        machine's clock]. Repeated ones are dropped."""
        restarts = np.flatnonzero(np.diff(time) < -_BACK) + 1
        for part in np.split(np.arange(time.size), restarts):
            self._add(index[part], time[part], code[part], arrival[part])

    def reach(self, clock: SampleClock) -> float:
        """Second of the sample clock up to which values are available; minus infinity if none can be placed."""
        line, last = self._line(clock), self._resampler.last
        if line is None or last is None:
            return -np.inf
        return self._course.reach(line, last[1])

    def counts(self, clock: SampleClock, first: int, n: int, sample_rate: float) -> NDArray[np.int16]:
        """Counts at `n` samples from `first` on, shape (n,), interpolated between two values, or the fault mark of one
        of them. Blocks must be requested in order.
        """
        self._asked = (first + n) / sample_rate
        line = self._line(clock)
        if line is None:
            times = np.full(n, np.nan)
        else:
            times = self._course.times(line, np.arange(first, first + n) / sample_rate)
        counts = self._resampler.at(times)
        self._late += int(np.count_nonzero(counts == self._marks.late))
        return counts

    def alignment(self, clock: SampleClock) -> Alignment:
        """Alignment of the values in this run; NaN where not yet known."""
        line, last = self._line(clock), self._resampler.last
        behind = self._asked if last is None else self._course.time - last[1]
        return Alignment(
            sensor=self._name,
            offset=np.nan if line is None else line.seconds_at(0.0) - self._delay,
            rate=np.nan if line is None else line.rate,
            residual=float(np.hypot(self._sensor.residual, clock.residual)),
            delay=self._delay,
            values=self._values,
            lost=self._lost + (int(behind * self._rate) if behind > 0.0 else 0),
            late=self._late,
            implausible=self._implausible,
        )

    def _add(
        self,
        index: NDArray[np.int64],
        time: NDArray[np.float64],
        code: NDArray[np.int32],
        arrival: NDArray[np.float64],
    ) -> None:
        """Add readings without a restart of the sensor's clock."""
        if time.size == 0:
            return
        last = self._resampler.last
        if last is not None and time[0] < last[1] - _BACK:
            self._resampler.clear()
            self._before, self._doubt = None, 0.0
            self._sensor, self._course = SensorClock(), Course()
            last = None
        newest = np.maximum.accumulate(np.concatenate(([-np.inf if last is None else last[1]], time[:-1])))
        fresh = np.flatnonzero(time > newest)
        if fresh.size == 0:
            return
        index, time, arrival = index[fresh], time[fresh], arrival[fresh]
        missing = np.diff(index, prepend=index[0] - 1 if last is None else last[0]) - 1
        self._lost += int(missing[missing > 0].sum())
        self._values += fresh.size
        self._resampler.add(index, time, self._plausible(index, self._marked(code[fresh])))
        self._sensor.add(time, arrival)

    def _plausible(self, index: NDArray[np.int64], counts: NDArray[np.int16]) -> NDArray[np.int16]:
        """The counts, with the mark of implausible values where they are farther from the last plausible one than the
        largest step allows in the time between them: a flipped bit gives a valid distance elsewhere. Only rare single
        values are marked.
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
                # jumps that are frequent, or that last, are a motion, which the guard must judge
                before, value = place, one
                self._doubt = RARE + 1.0
            else:
                good[k] = False
                self._doubt += 1.0
        self._before = before, value
        self._implausible += int(np.count_nonzero(~good))
        marked = counts.copy()
        marked[np.flatnonzero(is_value)[~good]] = self._marks.implausible
        return marked

    def _line(self, clock: SampleClock) -> Line | None:
        """Time on the sample clock [s] as a function of the sensor's, delay included; None while either is unknown."""
        last = self._resampler.last
        if last is None or self._sensor.history < _LEAST_HISTORY:
            return None
        arrival = self._sensor.offset + self._sensor.rate * last[1]
        seconds = float(clock.seconds(np.array([arrival]))[0]) + self._delay
        return None if np.isnan(seconds) else Line(last[1], seconds, self._sensor.rate * clock.rate)
