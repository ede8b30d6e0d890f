"""A sensor that measures by its own clock, placed on the samples of the DAQ."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.rig import Alignment
from drivers.timebase.course import Course
from drivers.timebase.line import Line
from drivers.timebase.resampler import Resampler
from drivers.timebase.sample_clock import SampleClock
from drivers.timebase.sensor_clock import SensorClock

_KEPT = 10.0
"""How long values wait to be asked for [s]."""
_LEAST_HISTORY = 1.0
"""How long a clock is watched before values are placed by it [s]."""
_BACK = 0.25
"""A value that is older than the newest by more than this [s] is no repetition: the sensor's clock was restarted."""


class SensorTrack:
    """Takes what the sensor `name` sends, and gives it on the grid of the sample clock.

    `rate` is how many values it takes per second, `delay` by how much later than their arrival says its values are
    placed [s]. `marked` turns its codes into counts up to +-`largest` and its error words into fault marks beyond;
    `lost_mark` stands for values that are not there. A sensor whose clock starts again begins a new history.
    """

    def __init__(
        self,
        name: str,
        rate: float,
        delay: float,
        marked: Callable[[NDArray[np.int32]], NDArray[np.int16]],
        largest: int,
        lost_mark: int,
    ) -> None:
        self._name, self._rate, self._delay, self._marked = name, rate, delay, marked
        self._resampler = Resampler(round(_KEPT * rate), largest, lost_mark)
        self._sensor = SensorClock()
        self._course = Course()
        self._values = self._lost = 0
        self._asked = 0.0

    def begin(self) -> None:
        """A run begins: its values are counted from here, and what is known of the sensor's clock stays."""
        self._course = Course()
        self._values = self._lost = 0
        self._asked = 0.0

    def add(
        self,
        index: NDArray[np.int64],
        time: NDArray[np.float64],
        code: NDArray[np.int32],
        arrival: NDArray[np.float64],
    ) -> None:
        """Take readings in their order, shape (n,) each: number, second of the sensor's clock, code, and when the
        machine got it [s of its clock]. Repeated ones are dropped."""
        restarts = np.flatnonzero(np.diff(time) < -_BACK) + 1
        for part in np.split(np.arange(time.size), restarts):
            self._add(index[part], time[part], code[part], arrival[part])

    def reach(self, clock: SampleClock) -> float:
        """Seconds of the sample clock up to which values are there; minus infinity when none can be placed."""
        line, last = self._line(clock), self._resampler.last
        if line is None or last is None:
            return -np.inf
        return self._course.reach(line, last[1])

    def counts(self, clock: SampleClock, first: int, n: int, sample_rate: float) -> NDArray[np.int16]:
        """Counts at `n` samples from `first` on, shape (n,): on the straight line between two values, or the mark of
        what is wrong with one of them. Blocks are asked for in their order."""
        self._asked = (first + n) / sample_rate
        line = self._line(clock)
        if line is None:
            return self._resampler.at(np.full(n, np.nan))
        return self._resampler.at(self._course.times(line, np.arange(first, first + n) / sample_rate))

    def alignment(self, clock: SampleClock) -> Alignment:
        """How the values were placed in this run; NaN for what is not known yet."""
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
        )

    def _add(
        self,
        index: NDArray[np.int64],
        time: NDArray[np.float64],
        code: NDArray[np.int32],
        arrival: NDArray[np.float64],
    ) -> None:
        """Take readings among which the sensor's clock does not start again."""
        if time.size == 0:
            return
        last = self._resampler.last
        if last is not None and time[0] < last[1] - _BACK:
            self._resampler.clear()
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
        self._resampler.add(index, time, self._marked(code[fresh]))
        self._sensor.add(time, arrival)

    def _line(self, clock: SampleClock) -> Line | None:
        """Seconds of the sample clock over the sensor's, with the delay; None while one of the two is not known."""
        last = self._resampler.last
        if last is None or self._sensor.history < _LEAST_HISTORY:
            return None
        arrival = self._sensor.offset + self._sensor.rate * last[1]
        seconds = float(clock.seconds(np.array([arrival]))[0]) + self._delay
        return None if np.isnan(seconds) else Line(last[1], seconds, self._sensor.rate * clock.rate)
