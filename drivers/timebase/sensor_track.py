"""Values of a sensor with a free-running clock, interpolated to the sample clock."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivers.rig import Alignment
from drivers.timebase.clocks import SampleClock, SensorClock
from drivers.timebase.course import Course, Line
from drivers.timebase.marking import Mark, Pulses, Rate, marked_point, pulse_rate
from drivers.timebase.resampling import Marks, Plausibility, Resampler

_KEPT = 10.0
"""Duration held by the buffer of values [s]."""
_LEAST_HISTORY = 1.0
"""Shortest history of the sensor's clock with which its values are aligned to the sample clock [s]."""
_FIRST_SPREAD = 40e-6
"""Standard uncertainty of the rate from the arrivals in the first second of a run, on a busy computer [1]."""
_SETTLED = 60.0
"""Time after the pulses at the beginning of a run up to which the lateness of the arrivals is estimated again [s]: half
the history of the clocks.
"""
_FLOOR = 0.25
"""Standard uncertainty of the line below the arrivals, as a fraction of their root mean square distance from it: the
shortest delays vary with the load of the machine.
"""
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
        self._observed: tuple[Rate, float] | None = None
        self._marked_until = -np.inf
        self._lateness = 0.0
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

    @property
    def history(self) -> float:
        """Time for which the sensor's clock has been observed [s]."""
        return self._sensor.history

    def reach(self, clock: SampleClock) -> float:
        """Time on the sample clock up to which values are available [s]; minus infinity if no value can be aligned."""
        line, last = self._line(clock), self._resampler.last
        if line is None or last is None:
            return -np.inf
        return self._course.reach(line, last[1])

    def observe_pulses(self, spacing: float) -> None:
        """Measure the rate of the sensor's clock by pulses `spacing` [s] apart that have switched its beam off since
        the last run; to be called before `begin`. The rate known so far is kept if too few pulses are found.
        """
        last = self._resampler.last
        if last is None or self._sensor.history < _LEAST_HISTORY:
            return
        time, is_lit = self._resampler.values(np.fmax(self._course.time, self._marked_until))
        known = self._known_rate(last[1])
        rate = pulse_rate(spacing, time, is_lit, self._sensor.rate if known is None else known.value)
        if rate is not None:
            self._observed = rate if known is None else rate.combined(known), last[1]

    def mark(self, clock: SampleClock, pulses: Pulses) -> bool:
        """Align the sensor's clock by pulses that have switched its beam off. Returns False if too few pulses are found
        in the values, or if the relation of the clocks is still unknown.
        """
        self._mark = None
        line = self._line(clock)
        if line is None:
            return False
        self._marked_until = line.time
        # times relative to the newest reading, to avoid rounding errors on clocks that have run for weeks
        begin = line.time_at(0.0)
        time, is_lit = self._resampler.values(begin)
        rate = self._known_rate(line.time) or Rate(line.rate, _FIRST_SPREAD)
        mark = marked_point(pulses, time - line.time, is_lit, rate, line.seconds - self._delay)
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
        if line is not None and self._mark is not None:
            # one line for the whole run, from the pulses to the present
            rise = line.seconds - self._delay - self._mark.seconds
            line = replace(line, rate=rise / (line.time - self._mark.time))
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
            self._observed, self._marked_until = None, -np.inf
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
        arrival = self._sensor.offset + self._sensor.rate * last[1]
        seconds = float(clock.seconds(np.array([arrival]))[0])
        if np.isnan(seconds):
            return None
        line = Line(last[1], seconds, self._sensor.rate * clock.rate)
        if self._mark is not None:
            line = self._marked_line(self._mark, line, float(np.hypot(self._sensor.residual, clock.residual)))
        return replace(line, seconds=line.seconds + self._delay)

    def _marked_line(self, mark: Mark, arrived: Line, residual: float) -> Line:
        """The line through the mark: its rate is that from the pulses between the runs, until the drift of the clocks
        may exceed the scatter of the arrivals, and from then on that of `arrived`, the line from the arrivals with the
        given residual.
        """
        passed = arrived.time - mark.time
        if passed < _SETTLED:
            self._lateness = arrived.seconds_at(mark.time) - mark.seconds
        seconds = arrived.seconds - self._lateness
        known = self._known_rate(arrived.time)
        if known is None:
            return replace(arrived, seconds=seconds)
        drift = mark.uncertainty**2 + (known.uncertainty * passed) ** 2
        scatter = 2.0 * (_FLOOR * residual) ** 2
        share = scatter / (drift + scatter)
        marked = mark.seconds + known.value * passed
        return Line(
            arrived.time, seconds + share * (marked - seconds), arrived.rate + share * (known.value - arrived.rate)
        )

    def _known_rate(self, time: float) -> Rate | None:
        """The rate from the pulses between the runs at the sensor's `time` [s]; None without such pulses."""
        if self._observed is None:
            return None
        rate, observed = self._observed
        return rate.aged(time - observed)
