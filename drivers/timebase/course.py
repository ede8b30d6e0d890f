"""The time of a sensor along the samples of a run, as it is used: it follows what is known better and better, but
never in a step, which would be seen as a jolt of what moves."""

import numpy as np
from numpy.typing import NDArray

from drivers.timebase.line import Line

_SLEW = 50e-6
"""By how much the used line gains on the true one at most [s/s]: a drive of 1 m/s is seen 50 um/s wrong meanwhile."""
_FIRST_SLEW = 500e-6
"""The same in the first seconds, when the lines are known to a fraction of a millisecond only [s/s]."""
_FIRST = 10.0
"""How long that is [s]."""


class Course:
    """Second of the sensor's clock at seconds of the sample clock: continuous, and straight within each block."""

    def __init__(self) -> None:
        self._began = self._seconds = self._time = np.nan

    @property
    def time(self) -> float:
        """Second of the sensor's clock at the last sample that was asked for; NaN before the first."""
        return self._time

    def times(self, line: Line, seconds: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sensor times, shape (n,), at `seconds`, ascending, where `line` says what is known now; moves on."""
        end = float(seconds[-1])
        if not self._seconds < float(seconds[0]):
            # nothing was asked for before, or the past is: there is nothing to go on from
            self._began = self._seconds = float(seconds[0])
            self._time = line.time_at(self._seconds)
        passed = end - self._seconds
        final = self._after(line, passed)
        rate = (final - self._time) / passed if passed > 0.0 else 1.0 / line.rate
        times = self._time + rate * (seconds - self._seconds)
        self._seconds, self._time = end, final
        return times

    def reach(self, line: Line, time: float) -> float:
        """The last second of the sample clock for which `times` would give at most `time` [s]."""
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
        """The time `passed` seconds on: on the line, or as near to it as the slew allows."""
        free = self._time + passed / line.rate
        allowed = self._slew * passed
        return min(max(line.time_at(self._seconds + passed), free - allowed), free + allowed)

    @property
    def _slew(self) -> float:
        return _FIRST_SLEW if self._seconds - self._began < _FIRST else _SLEW
