"""Sample clocks, in ticks of the plant, and waiting for their samples."""

import threading
import time
from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from drivers.emulation.daqmx.errors import DaqmxFailure

_SOON = 5.0e-5
"""Shortest wait [s], needed if a clock reading precedes the expected tick because of rounding."""


def deadline_after(timeout: float) -> float:
    """Deadline [s of the monotonic clock] of a call with this DAQmx time-out [s]; infinite for a negative time-out."""
    return float("inf") if timeout < 0.0 else time.monotonic() + timeout


def wait_until(changed: threading.Condition, instant: float, deadline: float) -> bool:
    """Wait until `instant`, `deadline` or a notification; returns False at once if the deadline has passed."""
    now = time.monotonic()
    if now >= deadline:
        return False
    remaining = min(max(instant - now, _SOON), deadline - now)
    changed.wait(None if remaining == float("inf") else remaining)
    return True


_SAME = 1.0e-9
"""Relative difference below which two rates are equal."""


@dataclass(frozen=True)
class SampleClock:
    """One sample every `divider` ticks: `rate` samples per second. `samples` is the requested buffer size per channel.

    `error` is the relative error of the clock with respect to the plant's ticks; a positive one makes it fast.
    """

    divider: int
    rate: float
    samples: int
    error: float = 0.0

    def is_whole(self, tick_rate: float) -> bool:
        """Whether every sample coincides with a tick of the plant at `tick_rate` [1/s]."""
        return abs(self.divider * self.rate - tick_rate) <= _SAME * tick_rate

    def ticks(self, first: int, samples: int) -> int:
        """The tick of sample number `samples` if sample 0 is at tick `first`."""
        return first + ceil(samples * self.divider / (1.0 + self.error))

    def passed(self, first: int, tick: int) -> int:
        """Number of samples up to and including `tick` if sample 0 is at tick `first`."""
        return max(int(self.numbers(first, np.array([tick]))[0]) + 1, 0)

    def numbers(self, first: int, ticks: NDArray[np.int64]) -> NDArray[np.int64]:
        """Number of the latest sample at each of `ticks`, same shape, if sample 0 is at tick `first`."""
        if self.error == 0.0:
            return (ticks - first) // self.divider
        return np.floor((ticks - first) * (1.0 + self.error) / self.divider).astype(np.int64)


def sample_clock(asked: float, highest: float, tick_rate: float, samples: int, error: float = 0.0) -> SampleClock:
    """Sample clock with the lowest supported rate not below `asked` [1/s]. Raises DaqmxFailure above `highest` [1/s].

    The supported rates are `tick_rate` [1/s] divided by an integer, as with delta-sigma converters (NI 9239 data
    sheet).
    """
    if not 0.0 < asked <= highest * (1.0 + _SAME):
        raise DaqmxFailure(
            DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
            "Requested value is not a supported value for this property.\n\n"
            f"Property: SampClk.Rate\nRequested Value: {asked}\nMaximum Value: {highest}",
        )
    divider = max(floor(tick_rate / asked * (1.0 + _SAME)), ceil(tick_rate / highest * (1.0 - _SAME)), 1)
    return SampleClock(divider, tick_rate / divider, samples, error)
