"""Delay of each input relative to the sample clock, needed to align the signals in time.

The filter of a delta-sigma converter delays its input by about 40 samples; a multiplexer samples its inputs one after
the other. Inputs on different modules therefore record the same motion at different times.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sqrt

from nidaqmx.constants import DigitalWidthUnits
from nidaqmx.errors import DaqError

from drivers.daqmx import library
from drivers.daqmx.errors import is_unsupported
from drivers.daqmx.library import InputChannel


@dataclass(frozen=True)
class InputDelay:
    """Delay of an input: its sample i is the value of the signal `seconds` before edge i of the sample clock, or after
    the edge if `seconds` is negative.

    `uncertainty` is the standard uncertainty [s], infinite if the delay is unknown; `source` names the source of the
    value.
    """

    seconds: float
    uncertainty: float
    source: str


@dataclass(frozen=True)
class Connected:
    """The device of an input: name, product, and whether its inputs are sampled simultaneously."""

    name: str
    product: str
    simultaneous: bool


_SAMPLES = 40.0 + 5.0 / 512.0
_FIGURE = 1.0e-6
"""Standard uncertainty of a delay from specifications [s]: rounding to two digits and tolerance of analogue filters."""
_KNOWN = {"9234": (2.6e-6, 5.0e-6), "9237": (4.5e-6, _FIGURE), "9239": (3.3e-6, _FIGURE)}
"""Input delay, by model, of delta-sigma modules that do not report it: time [s] in addition to (40 + 5/512) samples,
and its standard uncertainty [s], from their specifications and NI's knowledge base, kA00Z0000004A0YSAU. No NI document
was found that gives this time for the NI 9234; a value between those of related modules is assumed."""
_CLOCKED = 1.0e-7
"""Standard uncertainty of a time determined by the device's clock [s], a few ticks."""
_DELTA_SIGMA_BITS = 24
"""Lowest resolution [bits] at which a converter is assumed to be of the delta-sigma type."""


def input_delays(
    task: library.Task, channels: Sequence[InputChannel], devices: Sequence[Connected], rate: float
) -> tuple[InputDelay, ...]:
    """The delay of each input of a task clocked at `rate` [1/s].

    The delay of a filter is read from the device or, if the device does not report it, tabulated; the uncertainty of an
    unknown one is infinite. The delay of a multiplexed input follows from the convert rate. `devices` are the devices
    of the channels, in order. Removal of filter delays by the device is switched off, so that they are corrected only
    once.
    """
    several = len({device.name for device in devices}) > 1
    steps: dict[str, float | None] = {}
    numbers = dict.fromkeys((device.name for device in devices), 0)
    found: list[InputDelay] = []
    for channel, device in zip(channels, devices, strict=True):
        if device.simultaneous:
            found.append(_filter_delay(channel, device, rate))
            continue
        total = sum(other.name == device.name for other in devices)
        if device.name not in steps:
            steps[device.name] = _step(task, device.name, several=several) if total > 1 else 0.0
        found.append(_multiplexed(numbers[device.name], total, steps[device.name], rate))
        numbers[device.name] += 1
    return tuple(found)


def _multiplexed(number: int, total: int, step: float | None, rate: float) -> InputDelay:
    if number == 0:
        return InputDelay(0.0, _CLOCKED, "first input of its multiplexer")
    if step is not None:
        return InputDelay(-number * step, _CLOCKED, "AI.ConvRate")
    # the time between two inputs is at most the sample period divided by the number of inputs
    return InputDelay(
        0.0,
        number / (total * rate) / sqrt(3.0),
        "multiplexer without AI.ConvRate: unknown, less than one sample period",
    )


def _step(task: library.Task, device: str, *, several: bool) -> float | None:
    """Time between two inputs of a multiplexer [s]; None when the device does not report it."""
    try:
        timing = task.timing[device] if several else task.timing
        return 1.0 / float(timing.ai_conv_rate)
    except DaqError as error:
        if is_unsupported(error):
            return None
        raise


def _filter_delay(channel: InputChannel, device: Connected, rate: float) -> InputDelay:
    try:
        channel.ai_remove_filter_delay = False
        channel.ai_filter_delay_units = DigitalWidthUnits.SECONDS
        return InputDelay(float(channel.ai_filter_delay), _CLOCKED, "AI.FilterDelay")
    except DaqError as error:
        if not is_unsupported(error):
            raise
    model = re.search(r"\bNI[ -]?(\d{4})", device.product)
    if model is not None and (constant := _KNOWN.get(model[1])) is not None:
        seconds, uncertainty = constant
        source = "specifications" if uncertainty == _FIGURE else "assumed from related modules"
        return InputDelay(_SAMPLES / rate + seconds, uncertainty, f"{source} of the {device.product}")
    if channel.ai_resolution >= _DELTA_SIGMA_BITS:
        return InputDelay(0.0, inf, f"unknown for {device.product}")
    return InputDelay(0.0, _CLOCKED, "simultaneous inputs")
