"""A sensor and a DAQ whose clocks are known exactly, seen through a machine that is late now and then.

The machine's clock is the true time. What it sees is late by at least `FLOOR` and by an exponential tail, values come
in bursts of 1 to 16 ms, and now and then the scheduler stalls for up to 50 ms.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FLOOR = 1.0e-3
"""Least delay of a value [s]."""
_TAIL = 0.5e-3
"""Mean of the delay's exponential tail [s]."""
_STALLS = 0.002
"""Share of the bursts that meet a stall."""
_LONGEST_STALL = 0.05

SWITCHED_ON = 5000.0
"""When the sensor's clock began [s of the machine's clock]."""


@dataclass(frozen=True)
class Stream:
    """What a sensor sends, and when each value was truly taken."""

    index: NDArray[np.int64]
    time: NDArray[np.float64]
    arrival: NDArray[np.float64]
    taken: NDArray[np.float64]

    def between(self, begin: float, end: float) -> slice:
        """What arrives from `begin` until `end` [s of the machine's clock]."""
        return slice(*np.searchsorted(self.arrival, [begin, end]))


def stream(seed: int, duration: float, error: float, rate: float = 4000.0, turn: float | None = None) -> Stream:
    """A sensor whose clock is slow by `error` [1]; from second `turn` on it is fast by as much."""
    rng = np.random.default_rng(seed)
    index = np.arange(round(duration * rate))
    time = index / rate
    taken = SWITCHED_ON + time * (1.0 + error)
    if turn is not None:
        taken -= 2.0 * error * np.maximum(time - turn, 0.0)
    ends = taken[0] + np.cumsum(rng.uniform(0.001, 0.016, round(duration / 0.001)))
    burst = np.searchsorted(ends, taken)
    late = FLOOR + rng.exponential(_TAIL, burst[-1] + 1)
    late += (rng.uniform(size=late.size) < _STALLS) * rng.uniform(0.0, _LONGEST_STALL, late.size)
    arrival = np.maximum.accumulate(ends[: late.size] + late)[burst]
    return Stream(index, time, arrival, taken)


class Daq:
    """A sample clock that starts at `started` and is fast by `error` [1]; it is asked over a network."""

    def __init__(self, seed: int, started: float, error: float, sample_rate: float = 2000.0) -> None:
        self.started, self.sample_rate = started, sample_rate
        self._rng = np.random.default_rng(seed)
        self._true_rate = sample_rate * (1.0 + error)
        self.now = started

    def moment(self, sample: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """When samples are truly taken [s of the machine's clock]."""
        return self.started + np.asarray(sample) / self._true_rate

    def wait_for(self, sample: int) -> None:
        """Return when a sample has been taken and fetched."""
        self.now = max(self.now, float(self.moment(sample)) + self._way())
        if self._rng.uniform() < _STALLS:
            self.now += self._rng.uniform(0.0, _LONGEST_STALL)

    def look(self) -> tuple[float, int, float]:
        """Time before, samples taken, time after; both ways of the question take equally long on average."""
        before = self.now
        asked = before + self._way()
        self.now = asked + self._way()
        return before, int((asked - self.started) * self._true_rate) + 1, self.now

    def _way(self) -> float:
        return 1.5e-4 + self._rng.exponential(1.5e-4)
