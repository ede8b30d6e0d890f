"""Sample clocks: whole fractions of the plant's tick rate."""

import threading
import time
from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from drivers.emulation.daqmx.errors import DaqmxFailure

_SOON = 5.0e-5
"""The clock's reading may lie a rounding error before the tick it promised [s]."""


def deadline_after(timeout: float) -> float:
    """When a call with this DAQmx time-out gives up (monotonic seconds); -1 waits for ever."""
    return float("inf") if timeout < 0.0 else time.monotonic() + timeout


def wait_until(changed: threading.Condition, instant: float, deadline: float) -> bool:
    """Let time pass until `instant`, `deadline` or a change; False when the deadline has passed before."""
    now = time.monotonic()
    if now >= deadline:
        return False
    remaining = min(max(instant - now, _SOON), deadline - now)
    changed.wait(None if remaining == float("inf") else remaining)
    return True


_SAME = 1.0e-9
"""Relative difference below which two rates are one."""


@dataclass(frozen=True)
class SampleClock:
    """One sample every `divider` ticks: `rate` samples per second. `samples` sizes the buffer, per channel.

    `error` is by how much the clock is faster than the plant's ticks, relative.
    """

    divider: int
    rate: float
    samples: int
    error: float = 0.0

    def ticks(self, first: int, samples: int) -> int:
        """The tick of sample number `samples` when sample 0 is taken at tick `first`."""
        return first + ceil(samples * self.divider / (1.0 + self.error))

    def passed(self, first: int, tick: int) -> int:
        """How many samples have their tick at `tick` or before when sample 0 has it at `first`."""
        return max(int(self.numbers(first, np.array([tick]))[0]) + 1, 0)

    def numbers(self, first: int, ticks: NDArray[np.int64]) -> NDArray[np.int64]:
        """Number of the sample that is the last at each of `ticks`, same shape, when sample 0 has its at `first`."""
        if self.error == 0.0:
            return (ticks - first) // self.divider
        return np.floor((ticks - first) * (1.0 + self.error) / self.divider).astype(np.int64)


def sample_clock(asked: float, highest: float, tick_rate: float, samples: int, error: float = 0.0) -> SampleClock:
    """The clock that a device makes when `asked` samples per second are wanted: the next higher rate that it has.

    All rates are a tick rate over an integer, at most `highest`, as with delta-sigma converters (NI 9239 data sheet).
    """
    if not 0.0 < asked <= highest * (1.0 + _SAME):
        raise DaqmxFailure(
            DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
            "Requested value is not a supported value for this property.\n\n"
            f"Property: SampClk.Rate\nRequested Value: {asked}\nMaximum Value: {highest}",
        )
    divider = max(floor(tick_rate / asked * (1.0 + _SAME)), ceil(tick_rate / highest * (1.0 - _SAME)), 1)
    return SampleClock(divider, tick_rate / divider, samples, error)
