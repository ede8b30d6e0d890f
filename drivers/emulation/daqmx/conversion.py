"""Sampling times of the converters of an input task: rates, filter delays and multiplexers."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import floor

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.errors import DaqmxFailure

_SAME = 1.0e-9
"""Relative difference below which two rates are equal."""
_LARGEST_DIVISOR = 31
"""Largest divisor of the rate of a delta-sigma module (NI 9144 User Guide, p. 57, "Clock Divisor")."""
_OVERSAMPLING = 256.0
"""Ticks of the master timebase per sample at the highest rate (NI-9234 Specifications, "Data Rate Range")."""
_PADDING = 10.0e-6
"""Settling time between two channels of a multiplexer [s] (cDAQ-9183 User Manual, "AI Convert Clock Signal Behavior for
Analog Input Modules", "Scanned Modules"; M and X Series alike)."""


@dataclass(frozen=True)
class DeltaSigma:
    """A delta-sigma converter: master timebase [1/s], and input delay of `samples` samples and `seconds`.

    The delay is caused by the digital filter (NI knowledge base, kA00Z0000004A0YSAU, "Calculate the Input Delay").
    `readable`: whether the device has the properties AI.FilterDelay and AI.RemoveFilterDelay. Without them, the driver
    does not remove the delay; a client must correct the difference between modules (NI-DAQmx help, "cdaqmultidevice").
    """

    timebase: float
    samples: float
    seconds: float
    readable: bool = False

    def delay(self, rate: float) -> float:
        """Input delay at `rate` samples per second [s]."""
        return self.samples / rate + self.seconds


def delta_sigma_rate(asked: float, converters: Sequence[DeltaSigma]) -> float:
    """Sample rate [1/s] of a task with these converters: the lowest supported rate not below `asked`.

    All share the fastest timebase f (NI cDAQ-9172 User Guide, p. 18, "Sigma-Delta"), and rates are f / 256 / n for n
    from 1 to 31; other rates are coerced to the next higher one (NI knowledge base, 593CC07F76B1405A862570DE005F6836).
    Raises DaqmxFailure above the highest rate.
    """
    highest = max(one.timebase for one in converters) / _OVERSAMPLING
    if not 0.0 < asked <= highest * (1.0 + _SAME):
        raise DaqmxFailure(
            DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
            "Requested value is not a supported value for this property.\n\n"
            f"Property: SampClk.Rate\nRequested Value: {asked}\nMaximum Value: {highest}",
        )
    return highest / min(floor(highest / asked * (1.0 + _SAME)), _LARGEST_DIVISOR)


def conversion_period(fastest: float, channels: int, rate: float) -> float:
    """Time between the conversions of two channels of a multiplexer [s]: the shortest conversion time `fastest` [s]
    plus the settling time, or, at sample rates too high for this, an equal share of the sample period.
    """
    return min(fastest + (_PADDING if channels > 1 else 0.0), 1.0 / (rate * channels))
