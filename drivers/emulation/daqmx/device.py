"""Properties of a DAQ device that a client can query."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntFlag
from types import MappingProxyType

import numpy as np
from nidaqmx.constants import DigitalWidthUnits, ProductCategory, TerminalConfiguration
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from drivers.emulation.daqmx.conversion import DeltaSigma
from drivers.emulation.daqmx.errors import DaqmxFailure
from sim.sensors import Converter

_STRAIGHT: Mapping[int, tuple[float, ...]] = MappingProxyType({})


Seen = NDArray[np.int16 | np.int32 | np.float64]
"""Counts of the plant; between two ticks, they are interpolated and therefore not integers."""
START, CLOCK = "StartTrigger", "SampleClock"
"""Signals of a timing engine."""


class Wirings(IntFlag):
    """Terminal configurations of an input, as the bits of the attribute AI.TermCfgs."""

    RSE = 1
    NRSE = 2
    DIFFERENTIAL = 4
    PSEUDODIFFERENTIAL = 8


@dataclass(frozen=True)
class AnalogInputs:
    """The inputs of a device. Input k reads terminal `first_terminal + k` of the plant, or 0 V beyond the last
    terminal.

    `ranges` are the largest magnitudes [V], widest first; rates are in 1/s. The converter has `resolution` bits in raw
    samples of `raw_bits`. `polynomials` contains, by input, the coefficients [V] of a calibration polynomial in the
    counts for the widest range, in ascending order; other inputs are linear, with their rails at the ends of the range.
    `delta_sigma` describes converters of that type; `conversion` is the shortest conversion time of a multiplexed
    converter [s], None for simultaneously sampled inputs.
    """

    count: int
    ranges: tuple[float, ...]
    rate: float
    total_rate: float
    simultaneous: bool
    wirings: Wirings
    resolution: int = 16
    raw_bits: int = 16
    delta_sigma: DeltaSigma | None = None
    conversion: float | None = None
    first_terminal: int = 0
    polynomials: Mapping[int, tuple[float, ...]] = field(default_factory=lambda: _STRAIGHT)


@dataclass(frozen=True)
class AnalogOutputs:
    """The outputs of a device: largest magnitudes [V], highest rate [1/s], and samples in its onboard memory.

    `transfer_condition`: whether the condition of transfers to that memory can be set.
    """

    count: int
    ranges: tuple[float, ...]
    rate: float
    memory: int
    transfer_condition: bool = True


@dataclass(frozen=True)
class DeviceModel:
    """A device, a chassis, or a module in a `chassis`.

    `lines` is the number of lines at port 0 that can be outputs, `input_lines` the number that can be inputs; groups of
    `direction_group` consecutive lines share one direction. `watchdog` is the longest time-out [s] of its watchdog,
    None if it has none; the watchdog of a chassis acts on the outputs of its modules. `input_engines` and
    `output_engines` are the timing engines of analogue inputs and outputs, in the order of their numbers; a module has
    the engines of its chassis.
    """

    name: str
    product: str
    category: ProductCategory = ProductCategory.UNKNOWN
    serial: int = 0
    simulated: bool = False
    chassis: str | None = None
    modules: tuple[str, ...] = ()
    inputs: AnalogInputs | None = None
    outputs: AnalogOutputs | None = None
    lines: int = 0
    input_lines: int = 0
    direction_group: int = 1
    watchdog: float | None = None
    counters: int = 0
    input_engines: tuple[str, ...] = ("ai",)
    output_engines: tuple[str, ...] = ("ao",)

    @property
    def input_names(self) -> tuple[str, ...]:
        """Physical channels of the inputs."""
        return tuple(f"{self.name}/ai{k}" for k in range(self.inputs.count if self.inputs else 0))

    @property
    def output_names(self) -> tuple[str, ...]:
        """Physical channels of the outputs."""
        return tuple(f"{self.name}/ao{k}" for k in range(self.outputs.count if self.outputs else 0))

    @property
    def counter_names(self) -> tuple[str, ...]:
        """Counters that can generate pulses."""
        return tuple(f"{self.name}/ctr{k}" for k in range(self.counters))

    @property
    def line_names(self) -> tuple[str, ...]:
        """Digital output lines."""
        return tuple(f"{self.name}/port0/line{k}" for k in range(self.lines))

    @property
    def input_line_names(self) -> tuple[str, ...]:
        """Digital input lines."""
        return tuple(f"{self.name}/port0/line{k}" for k in range(self.input_lines))

    def direction_of(self, k: int) -> str:
        """Name of the range of lines that share the direction of line `k`."""
        first = k // self.direction_group * self.direction_group
        return f"{self.name}/port0/line{first}:{first + self.direction_group - 1}"

    @property
    def clockwork(self) -> str:
        """Device that generates clocks and triggers: the chassis, if any."""
        return self.chassis or self.name

    @property
    def terminals(self) -> tuple[str, ...]:
        """Every terminal that may serve as trigger or clock source."""
        return tuple(
            f"/{self.clockwork}/{engine}/{signal}"
            for engine in (*self.input_engines, *self.output_engines)
            for signal in (START, CLOCK)
        )


_NEWTON_STEPS = 3
"""Number of Newton steps that invert an almost linear calibration polynomial to a fraction of a count."""


class InputConverter:
    """Input `k` of a device, set to `range` [V].

    `source` is the converter that produces the plant's counts.

    volts = coefficients[0] + coefficients[1] * raw + coefficients[2] * raw**2 + ...
    """

    def __init__(self, inputs: AnalogInputs, k: int, range: float, source: Converter) -> None:
        widest = inputs.ranges[0]
        straight = (0.0, 2.0 * widest / 2**inputs.resolution)
        self.range = range
        self.coefficients = tuple(c * range / widest for c in inputs.polynomials.get(k, straight))
        self._rails = -(2 ** (inputs.resolution - 1)), 2 ** (inputs.resolution - 1) - 1
        self._dtype = np.int16 if inputs.raw_bits == 16 else np.int32
        self._source = source
        self._same = self.coefficients == (0.0, source.lsb) and self._rails == source.codes

    def is_like(self, other: "InputConverter") -> bool:
        """Whether both converters produce the same raw counts."""
        return self.coefficients == other.coefficients and self._rails == other._rails

    def raw(self, counts: Seen) -> NDArray[np.int16 | np.int32]:
        """Raw counts for the plant's counts, same shape; saturated where the plant's converter is."""
        if self._same:
            return np.rint(counts).astype(self._dtype)
        volts = counts.astype(np.float64) * self._source.lsb
        raw = (volts - self.coefficients[0]) / self.coefficients[1]
        if len(self.coefficients) > 2:
            for _ in range(_NEWTON_STEPS):
                raw -= (_polynomial(self.coefficients, raw) - volts) / self._slope(raw)
        lowest, highest = self._rails
        raw = np.clip(np.rint(raw), lowest, highest)
        raw[counts <= self._source.codes[0]] = lowest
        raw[counts >= self._source.codes[1]] = highest
        return raw.astype(self._dtype)

    def volts(self, raw: NDArray[np.int16 | np.int32]) -> NDArray[np.float64]:
        """Scaled values [V] of raw counts, same shape."""
        return _polynomial(self.coefficients, raw.astype(np.float64))

    def _slope(self, raw: NDArray[np.float64]) -> NDArray[np.float64]:
        return _polynomial([power * c for power, c in enumerate(self.coefficients)][1:], raw)


def _polynomial(coefficients: Sequence[float], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """coefficients[0] + coefficients[1] x + coefficients[2] x^2 + ..., by Horner's rule."""
    value = np.zeros_like(x)
    for c in reversed(coefficients):
        value = value * x + c
    return value


_WIRING_OF = {
    TerminalConfiguration.RSE.value: Wirings.RSE,
    TerminalConfiguration.NRSE.value: Wirings.NRSE,
    TerminalConfiguration.DIFF.value: Wirings.DIFFERENTIAL,
    TerminalConfiguration.PSEUDO_DIFF.value: Wirings.PSEUDODIFFERENTIAL,
}


@dataclass
class FilterDelay:
    """Settings of a converter that reports its delay: whether the device removes the whole samples of the delay, and
    the unit in which the delay is reported.
    """

    removed: bool = True
    units: int = DigitalWidthUnits.SAMPLE_CLOCK_PERIODS.value


@dataclass(frozen=True)
class InputChannel:
    """One channel of an input task."""

    name: str
    device: DeviceModel
    inputs: AnalogInputs
    terminal: int
    minimum: float
    maximum: float
    converter: InputConverter
    filter: FilterDelay = field(default_factory=FilterDelay)


def require_wiring(inputs: AnalogInputs, wiring: int) -> None:
    """Raise DaqmxFailure for an unsupported wiring of an input."""
    if wiring != TerminalConfiguration.DEFAULT.value and not inputs.wirings & _WIRING_OF.get(wiring, Wirings(0)):
        raise DaqmxFailure(
            DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
            "Requested value is not a supported value for this property.\n\n"
            f"Property: AI.TermCfg\nRequested Value: {wiring}",
        )
