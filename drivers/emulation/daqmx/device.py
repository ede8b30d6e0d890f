"""What a DAQ device is: the numbers that a client can ask for."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntFlag
from types import MappingProxyType

from nidaqmx.constants import ProductCategory

_STRAIGHT: Mapping[int, tuple[float, ...]] = MappingProxyType({})


class Wirings(IntFlag):
    """Terminal configurations of an input, as the bits of the attribute AI.TermCfgs."""

    RSE = 1
    NRSE = 2
    DIFFERENTIAL = 4
    PSEUDODIFFERENTIAL = 8


@dataclass(frozen=True)
class AnalogInputs:
    """The inputs of a device. Input k is terminal `first_terminal + k` of the plant; beyond its last it reads 0 V.

    `ranges` are the largest magnitudes [V], widest first; rates are per second. The converter has `resolution` bits
    in raw samples of `raw_bits`. `polynomials` are, for single inputs, volts per power of the counts in the widest
    range; the others are straight, with their rails at the ends of the range.
    """

    count: int
    ranges: tuple[float, ...]
    rate: float
    total_rate: float
    simultaneous: bool
    wirings: Wirings
    resolution: int = 16
    raw_bits: int = 16
    first_terminal: int = 0
    polynomials: Mapping[int, tuple[float, ...]] = field(default_factory=lambda: _STRAIGHT)


@dataclass(frozen=True)
class AnalogOutputs:
    """The outputs of a device: largest magnitudes [V], samples per second, samples that its own memory holds."""

    count: int
    ranges: tuple[float, ...]
    rate: float
    memory: int


@dataclass(frozen=True)
class DeviceModel:
    """One device, chassis, or module in a `chassis`.

    `lines` is the number of lines at port 0 that can be outputs, `input_lines` of those that can be inputs; `watchdog`
    the longest time-out [s] of the watchdog on them, None where there is none.
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
    watchdog: float | None = None

    @property
    def input_names(self) -> tuple[str, ...]:
        """Physical channels of the inputs."""
        return tuple(f"{self.name}/ai{k}" for k in range(self.inputs.count if self.inputs else 0))

    @property
    def output_names(self) -> tuple[str, ...]:
        """Physical channels of the outputs."""
        return tuple(f"{self.name}/ao{k}" for k in range(self.outputs.count if self.outputs else 0))

    @property
    def line_names(self) -> tuple[str, ...]:
        """Digital output lines."""
        return tuple(f"{self.name}/port0/line{k}" for k in range(self.lines))

    @property
    def input_line_names(self) -> tuple[str, ...]:
        """Digital input lines."""
        return tuple(f"{self.name}/port0/line{k}" for k in range(self.input_lines))

    @property
    def clockwork(self) -> str:
        """Who makes clocks and triggers: the chassis where there is one."""
        return self.chassis or self.name

    @property
    def input_start(self) -> str:
        """Terminal of the start trigger of the inputs."""
        return f"/{self.chassis}/te0/StartTrigger" if self.chassis else f"/{self.name}/ai/StartTrigger"

    @property
    def input_clock(self) -> str:
        """Terminal of the sample clock of the inputs."""
        return f"/{self.chassis}/te0/SampleClock" if self.chassis else f"/{self.name}/ai/SampleClock"

    @property
    def output_clock(self) -> str:
        """Terminal of the sample clock of the outputs."""
        return f"/{self.chassis}/te1/SampleClock" if self.chassis else f"/{self.name}/ao/SampleClock"

    @property
    def terminals(self) -> tuple[str, ...]:
        """Every terminal that others may be started or clocked from."""
        return self.input_start, self.output_start, self.input_clock, self.output_clock

    @property
    def output_start(self) -> str:
        """Terminal of the start trigger of the outputs."""
        return f"/{self.chassis}/te1/StartTrigger" if self.chassis else f"/{self.name}/ao/StartTrigger"
