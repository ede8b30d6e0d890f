"""Relation of a sensor's clock to the sample clock, followed continuously during a run."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


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
