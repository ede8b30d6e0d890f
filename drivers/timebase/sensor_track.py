"""Values of a sensor with a free-running clock, interpolated to the sample clock."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivers.rig import Alignment
from drivers.timebase.clocks import SampleClock, SensorClock
from drivers.timebase.marking import Mark, Pulses, marked_point
from drivers.timebase.resampling import Marks, Plausibility, Resampler


@dataclass(frozen=True)
class Line:
    """Linear relation of two clocks: `time` [s] on the first is `seconds` [s] on the second, which advances by `rate`
    per second of the first.

    The point (`time`, `seconds`) is close to the present, to avoid rounding errors on clocks that have run for weeks.
    """

    time: float
    seconds: float
    rate: float

    def seconds_at(self, time: float) -> float:
        """Time on the second clock at `time` on the first [s]."""
        return self.seconds + self.rate * (time - self.time)

    def time_at(self, seconds: float) -> float:
        """Time on the first clock at `seconds` on the second [s]."""
        return self.time + (seconds - self.seconds) / self.rate


_SLEW = 50e-6
"""Largest slew rate of the clock relation [s/s]: if the target moves at 1 m/s, its position error changes by at most
50 um per second.
"""
_FIRST_SLEW = 500e-6
"""Largest slew rate in the first phase of a run [s/s], when the clock relation is only known to a fraction of a
millisecond.
"""
_FIRST = 10.0
"""Duration of the first phase of a run [s]."""


class Course:
    """Time on the sensor's clock as a function of the sample clock: continuous, and linear within each block."""

    def __init__(self) -> None:
        self._began = self._seconds = self._time = np.nan

    @property
    def time(self) -> float:
        """Time on the sensor's clock at the last requested sample [s]; NaN before the first request."""
        return self._time

    def times(self, line: Line, seconds: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sensor times [s], shape (n,), at ascending `seconds` of the sample clock, following the present `line`; the
        next request continues from the last one.
        """
        end = float(seconds[-1])
        if not self._seconds < float(seconds[0]):
            # the first request, and a request for an earlier time, do not continue a previous one
            self._began = self._seconds = float(seconds[0])
            self._time = line.time_at(self._seconds)
        passed = end - self._seconds
        final = self._after(line, passed)
        rate = (final - self._time) / passed if passed > 0.0 else 1.0 / line.rate
        times = self._time + rate * (seconds - self._seconds)
        self._seconds, self._time = end, final
        return times

    def reach(self, line: Line, time: float) -> float:
        """Latest time on the sample clock [s] for which `times` would return at most `time` [s]."""
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
        """Sensor time [s] after a further `passed` [s]: on the line, or as close to it as the slew limit allows."""
        free = self._time + passed / line.rate
        allowed = self._slew * passed
        return min(max(line.time_at(self._seconds + passed), free - allowed), free + allowed)

    @property
    def _slew(self) -> float:
        return _FIRST_SLEW if self._seconds - self._began < _FIRST else _SLEW


_KEPT = 10.0
"""Duration held by the buffer of values [s]."""
_LEAST_HISTORY = 1.0
"""Shortest history of the sensor's clock with which its values are aligned to the sample clock [s]."""
_BACK = 0.25
"""Backward step of the sensor's time [s] above which a value is not a repetition but follows a restart of the sensor's
clock.
"""


class SensorTrack:
    """Resamples the values of the sensor `name` on the grid of the sample clock.

    `rate` is its measuring rate [1/s]; `delay` [s] is added to the estimated times of its values. `marked` converts its
    codes to counts up to +-`largest`, and its error words to fault marks outside that range; `marks` are the fault
    marks of missing, late and implausible values. Values that change by more than `largest_step` counts per measurement
    are implausible (see `Plausibility`). A restart of the sensor's clock begins a new history.
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
        self._plausibility = Plausibility(largest, largest_step, marks.implausible)
        self._marks = marks
        self._sensor = SensorClock()
        self._course = Course()
        self._mark: Mark | None = None
        self._values = self._lost = self._late = 0
        self._asked = 0.0

    def begin(self) -> None:
        """Begin a run: reset the counts of values and faults, but keep the history of the sensor's clock."""
        self._course = Course()
        self._mark = None
        self._values = self._lost = self._late = 0
        self._plausibility.count = 0
        self._asked = 0.0

    def add(
        self,
        index: NDArray[np.int64],
        time: NDArray[np.float64],
        code: NDArray[np.int32],
        arrival: NDArray[np.float64],
    ) -> None:
        """Add readings in order, shape (n,) each: index, time on the sensor's clock [s], code, and arrival [s of the
        machine's clock]. Repeated readings are dropped.
        """
        restarts = np.flatnonzero(np.diff(time) < -_BACK) + 1
        for part in np.split(np.arange(time.size), restarts):
            self._add(index[part], time[part], code[part], arrival[part])

    def reach(self, clock: SampleClock) -> float:
        """Time on the sample clock up to which values are available [s]; minus infinity if no value can be aligned."""
        line, last = self._line(clock), self._resampler.last
        if line is None or last is None:
            return -np.inf
        return self._course.reach(line, last[1])

    def mark(self, clock: SampleClock, pulses: Pulses) -> bool:
        """Align the sensor's clock by pulses that have switched its beam off. Returns False if too few pulses are found
        in the values, or if the relation of the clocks is still unknown.
        """
        self._mark = None
        line = self._line(clock)
        if line is None:
            return False
        # times relative to the newest reading, to avoid rounding errors on clocks that have run for weeks
        begin = line.time_at(0.0)
        time, is_lit = self._resampler.values(begin)
        mark = marked_point(pulses, time - line.time, is_lit, line.rate, line.seconds - self._delay)
        self._mark = None if mark is None else replace(mark, time=line.time + mark.time)
        return mark is not None

    def counts(self, clock: SampleClock, first: int, n: int, sample_rate: float) -> NDArray[np.int16]:
        """Counts at `n` samples from `first` on, shape (n,), interpolated between two values; fault marks where this is
        not possible. Blocks must be requested in order.
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
        """Alignment of the sensor's clock in this run; `offset`, `rate` and `residual` are NaN while unknown."""
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
            implausible=self._plausibility.count,
            mark_uncertainty=np.inf if self._mark is None else self._mark.uncertainty,
        )

    def _add(
        self,
        index: NDArray[np.int64],
        time: NDArray[np.float64],
        code: NDArray[np.int32],
        arrival: NDArray[np.float64],
    ) -> None:
        """Add readings among which the sensor's clock does not restart."""
        if time.size == 0:
            return
        last = self._resampler.last
        if last is not None and time[0] < last[1] - _BACK:
            self._resampler.clear()
            self._plausibility.restart()
            self._sensor, self._course, self._mark = SensorClock(), Course(), None
            last = None
        newest = np.maximum.accumulate(np.concatenate(([-np.inf if last is None else last[1]], time[:-1])))
        fresh = np.flatnonzero(time > newest)
        if fresh.size == 0:
            return
        index, time, arrival = index[fresh], time[fresh], arrival[fresh]
        missing = np.diff(index, prepend=index[0] - 1 if last is None else last[0]) - 1
        self._lost += int(missing[missing > 0].sum())
        self._values += fresh.size
        self._resampler.add(index, time, self._plausibility.marked(index, self._marked(code[fresh])))
        self._sensor.add(time, arrival)

    def _line(self, clock: SampleClock) -> Line | None:
        """Sample clock as a function of the sensor's clock, including the delay; None while either clock is unknown."""
        last = self._resampler.last
        if last is None or self._sensor.history < _LEAST_HISTORY:
            return None
        if self._mark is not None:
            mark, rate = self._mark, self._sensor.rate * clock.rate
            return Line(last[1], mark.seconds + rate * (last[1] - mark.time) + self._delay, rate)
        arrival = self._sensor.offset + self._sensor.rate * last[1]
        seconds = float(clock.seconds(np.array([arrival]))[0]) + self._delay
        return None if np.isnan(seconds) else Line(last[1], seconds, self._sensor.rate * clock.rate)
