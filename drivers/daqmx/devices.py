"""DAQ devices: their channels, ranges and rates, and checks of a configuration against them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from nidaqmx.constants import ProductCategory
from nidaqmx.errors import DaqError

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import is_unsupported, translated
from drivers.daqmx.inputs import TERMINAL_CONFIGURATIONS
from drivers.daqmx.parameters import AnalogInput, Daq, Tls, device_name
from sim.errors import InvalidInput

_PATIENCE = 5.0
"""Time allowed for a call to a server [s]; the driver there may have to be loaded first."""

T = TypeVar("T")


@dataclass(frozen=True)
class FoundDevice:
    """One device or module. Ranges are (lowest, highest) pairs [V]; rates [1/s] are None for functions that the device
    lacks.

    `lines` can be used as digital outputs, `input_lines` as digital inputs. `chassis` is the chassis of a module, None
    for other devices. `input_rate` is the maximum for one channel; `total_input_rate` is shared by all channels unless
    `simultaneous`.
    """

    name: str
    product: str
    serial: str
    simulated: bool
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    lines: tuple[str, ...]
    input_lines: tuple[str, ...]
    input_ranges: tuple[tuple[float, float], ...]
    output_ranges: tuple[tuple[float, float], ...]
    input_rate: float | None
    total_input_rate: float | None
    simultaneous: bool
    output_rate: float | None
    chassis: str | None = None

    @property
    def identity(self) -> str:
        """Product and serial number in one line."""
        return f"{self.product}, serial number {self.serial}{', simulated' if self.simulated else ''}"

    def highest_input_rate(self, channels: int) -> float | None:
        """Highest sample rate of each channel [1/s] if `channels` channels of this device are read; None if it has no
        inputs.
        """
        if self.input_rate is None or self.total_input_rate is None or self.simultaneous:
            return self.input_rate
        return min(self.input_rate, self.total_input_rate / channels)


def find_devices(server: str | None, tls: Tls | None = None, *, plain: bool = False) -> list[FoundDevice]:
    """The devices of this PC, or of the gRPC device server at `server` (host:port); see `Connection`.

    Raises DeviceNotFound if there is no driver or no server, and InvalidInput as `Connection` does.
    """
    connection = Connection(server, _PATIENCE, tls, plain=plain)
    try:
        with translated("looking for devices"):
            return [described(device) for device in library.system(connection.options()).devices]
    finally:
        connection.close()


def described(device: library.Device) -> FoundDevice:
    """The device's properties, read through the driver."""
    inputs = tuple(channel.name for channel in device.ai_physical_chans)
    outputs = tuple(channel.name for channel in device.ao_physical_chans)
    serial = int(device.serial_num)
    return FoundDevice(
        name=device.name,
        product=str(device.product_type),
        serial=f"{serial:08X}" if serial else "none",
        simulated=bool(device.is_simulated),
        inputs=inputs,
        outputs=outputs,
        lines=tuple(line.name for line in device.do_lines),
        input_lines=tuple(line.name for line in device.di_lines),
        input_ranges=_pairs(device.ai_voltage_rngs) if inputs else (),
        output_ranges=_pairs(device.ao_voltage_rngs) if outputs else (),
        input_rate=_where_supported(lambda: float(device.ai_max_single_chan_rate)) if inputs else None,
        total_input_rate=_where_supported(lambda: float(device.ai_max_multi_chan_rate)) if inputs else None,
        simultaneous=bool(inputs) and bool(_where_supported(lambda: device.ai_simultaneous_sampling_supported)),
        output_rate=_where_supported(lambda: float(device.ao_max_rate)) if outputs else None,
        chassis=_chassis_of(device),
    )


def _chassis_of(device: library.Device) -> str | None:
    """The name of the chassis or controller of a module; None for other devices."""
    if _where_supported(lambda: device.product_category) is not ProductCategory.C_SERIES_MODULE:
        return None
    name = _where_supported(lambda: str(device.compact_daq_chassis_device.name))
    return name or _where_supported(lambda: str(device.compact_rio_chassis_device.name)) or None


def _pairs(flat: Sequence[float]) -> tuple[tuple[float, float], ...]:
    """Pairs from DAQmx's flat list low, high, low, high, ..."""
    values = [float(value) for value in flat]
    return tuple(zip(values[::2], values[1::2], strict=True))


def _where_supported(ask: Callable[[], T]) -> T | None:
    try:
        return ask()
    except DaqError as error:
        if is_unsupported(error):
            return None
        raise


_TERMINAL = "terminal of an input"
_RANGE = "range of input {}"


def checked_devices(
    system: library.System, daq: Daq, inputs: Sequence[AnalogInput], sample_rate: float, lead: int
) -> tuple[FoundDevice, ...]:
    """The devices in use, each listed once. Raises InvalidInput for settings that they do not support."""
    if not inputs:
        raise InvalidInput("inputs", 0, "at least one analogue input is required")
    if lead < 0:
        raise InvalidInput("lead", lead, "it must be a number of samples, 0 or more")
    if daq.watchdog is not None and daq.enable_line is None:
        raise InvalidInput("hardware.daq.watchdog", daq.watchdog, "it requires hardware.daq.enable_line")
    present = {device.name.lower(): device for device in system.devices}
    used: dict[str, FoundDevice] = {}

    def device_of(item: str, terminal: str) -> FoundDevice:
        name = device_name(terminal)
        if name.lower() not in present:
            names = ", ".join(device.name for device in present.values()) or "none"
            raise InvalidInput(item, terminal, f"no device {name} exists; available: {names}")
        if name.lower() not in used:
            used[name.lower()] = described(present[name.lower()])
        return used[name.lower()]

    output = device_of("hardware.daq.output", daq.output)
    _require_known("hardware.daq.output", daq.output, output.outputs, "analogue output", output)
    _require_range("hardware.daq.output_range", daq.output_range, output.output_ranges, output)
    for item, line in daq.digital_lines.items():
        lines = device_of(f"hardware.daq.{item}", line)
        is_output = item in _OUTPUT_LINES
        known, kind = (lines.lines, "output") if is_output else (lines.input_lines, "input")
        _require_known(f"hardware.daq.{item}", line, known, f"digital {kind} line", lines)
    _require_one_direction(daq, used)
    for given in inputs:
        device = device_of(_TERMINAL, given.terminal)
        _require_known(_TERMINAL, given.terminal, device.inputs, "analogue input", device)
        _require_range(_RANGE.format(given.terminal), given.range, device.input_ranges, device)
        _require_wiring(given, present[device.name.lower()])
    _require_rate(sample_rate, inputs, output, used)
    return tuple(used.values())


_OUTPUT_LINES = ("enable_line", "heartbeat.line")
_NIBBLE = 4
"""Number of lines of an NI 9401 that share one direction (its operating instructions, p. 7)."""


def _require_one_direction(daq: Daq, used: Mapping[str, FoundDevice]) -> None:
    """Raise InvalidInput for an output and an input in the same half of an NI 9401, whose lines share one direction."""
    seen: dict[tuple[str, int], str] = {}
    for item, line in daq.digital_lines.items():
        device = used[device_name(line).lower()]
        if "9401" not in device.product:
            continue
        half = int(line.rpartition("line")[2]) // _NIBBLE
        other = seen.setdefault((device.name, half), item)
        if (other in _OUTPUT_LINES) != (item in _OUTPUT_LINES):
            low, high, free = _NIBBLE * half, _NIBBLE * half + _NIBBLE - 1, "4 to 7" if half == 0 else "0 to 3"
            mine, theirs = ("output", "input") if item in _OUTPUT_LINES else ("input", "output")
            raise InvalidInput(
                f"hardware.daq.{item}",
                line,
                f"lines {low} to {high} of an NI 9401 share one direction, and hardware.daq.{other} is an {theirs}: "
                f"wire this {mine} to one of lines {free}, or to another module",
            )


def _require_known(item: str, given: str, known: Sequence[str], kind: str, device: FoundDevice) -> None:
    if given.strip("/").lower() not in (name.lower() for name in known):
        there = f"it has {' to '.join(dict.fromkeys((known[0], known[-1])))}" if known else "it has none"
        raise InvalidInput(item, given, f"{device.name} ({device.product}) has no such {kind}; {there}")


def _require_range(item: str, given: float, ranges: Sequence[tuple[float, float]], device: FoundDevice) -> None:
    highest = max((min(-low, high) for low, high in ranges), default=0.0)
    if given > highest:
        raise InvalidInput(item, given, f"the range of {device.name} ({device.product}) is at most +-{highest:g} V")


def _require_wiring(given: AnalogInput, device: library.Device) -> None:
    if given.wiring == "default":
        return
    channel = next(channel for channel in device.ai_physical_chans if channel.name.lower() == given.terminal.lower())
    possible = list(channel.ai_term_cfgs)
    if TERMINAL_CONFIGURATIONS[given.wiring] not in possible:
        names = [name for name, configuration in TERMINAL_CONFIGURATIONS.items() if configuration in possible]
        raise InvalidInput(f"wiring of input {given.terminal}", given.wiring, f"it must be one of: {', '.join(names)}")


def _require_rate(
    rate: float, inputs: Sequence[AnalogInput], output: FoundDevice, used: Mapping[str, FoundDevice]
) -> None:
    if not rate > 0.0:
        raise InvalidInput("sample_rate", rate, "it must be greater than 0")
    if output.output_rate is not None and rate > output.output_rate:
        raise InvalidInput(
            "sample_rate",
            rate,
            f"the output of {output.name} ({output.product}) has a maximum rate of {output.output_rate:g}/s",
        )
    for key, device in used.items():
        channels = sum(device_name(given.terminal).lower() == key for given in inputs)
        highest = device.highest_input_rate(channels) if channels else None
        if highest is not None and rate > highest:
            raise InvalidInput(
                "sample_rate",
                rate,
                f"the inputs of {device.name} ({device.product}) can be read at {highest:g}/s at most (inputs in use:"
                f" {channels})",
            )
