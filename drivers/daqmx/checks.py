"""What a device cannot do is refused before any task is made."""

from collections.abc import Mapping, Sequence

from drivers.daqmx import library
from drivers.daqmx.devices import FoundDevice, described
from drivers.daqmx.inputs import TERMINAL_CONFIGURATIONS
from drivers.daqmx.parameters import AnalogInput, Daq, device_name
from sim.errors import InvalidInput

_TERMINAL = "terminal of an input"
_RANGE = "range of input {}"


def checked_devices(
    system: library.System, daq: Daq, inputs: Sequence[AnalogInput], sample_rate: float, lead: int
) -> tuple[FoundDevice, ...]:
    """The devices that are used, each once. Raises InvalidInput for whatever they do not have or cannot do."""
    if not inputs:
        raise InvalidInput("inputs", 0, "there must be at least one analogue input")
    if lead < 0:
        raise InvalidInput("lead", lead, "it must be a number of samples, 0 or more")
    if daq.watchdog is not None and daq.enable_line is None:
        raise InvalidInput("hardware.daq.watchdog", daq.watchdog, "it needs hardware.daq.enable_line, which it opens")
    present = {device.name.lower(): device for device in system.devices}
    used: dict[str, FoundDevice] = {}

    def device_of(item: str, terminal: str) -> FoundDevice:
        name = device_name(terminal)
        if name.lower() not in present:
            names = ", ".join(device.name for device in present.values()) or "none"
            raise InvalidInput(item, terminal, f"there is no device {name}; there is: {names}")
        if name.lower() not in used:
            used[name.lower()] = described(present[name.lower()])
        return used[name.lower()]

    output = device_of("hardware.daq.output", daq.output)
    _require_known("hardware.daq.output", daq.output, output.outputs, "analogue output", output)
    _require_range("hardware.daq.output_range", daq.output_range, output.output_ranges, output)
    for item, line in daq.digital_lines.items():
        lines = device_of(f"hardware.daq.{item}", line)
        is_output = item in ("enable_line", "heartbeat.line")
        known, kind = (lines.lines, "output") if is_output else (lines.input_lines, "input")
        _require_known(f"hardware.daq.{item}", line, known, f"digital {kind} line", lines)
    for given in inputs:
        device = device_of(_TERMINAL, given.terminal)
        _require_known(_TERMINAL, given.terminal, device.inputs, "analogue input", device)
        _require_range(_RANGE.format(given.terminal), given.range, device.input_ranges, device)
        _require_wiring(given, present[device.name.lower()])
    _require_rate(sample_rate, inputs, output, used)
    return tuple(used.values())


def _require_known(item: str, given: str, known: Sequence[str], kind: str, device: FoundDevice) -> None:
    if given.strip("/").lower() not in (name.lower() for name in known):
        there = f"it has {known[0]} to {known[-1]}" if known else "it has none"
        raise InvalidInput(item, given, f"{device.name} ({device.product}) has no such {kind}; {there}")


def _require_range(item: str, given: float, ranges: Sequence[tuple[float, float]], device: FoundDevice) -> None:
    highest = max((min(-low, high) for low, high in ranges), default=0.0)
    if given > highest:
        raise InvalidInput(item, given, f"{device.name} ({device.product}) has at most +-{highest:g} V")


def _require_wiring(given: AnalogInput, device: library.Device) -> None:
    if given.wiring == "default":
        return
    channel = next(channel for channel in device.ai_physical_chans if channel.name.lower() == given.terminal.lower())
    possible = list(channel.ai_term_cfgs)
    if TERMINAL_CONFIGURATIONS[given.wiring] not in possible:
        names = [name for name, configuration in TERMINAL_CONFIGURATIONS.items() if configuration in possible]
        raise InvalidInput(f"wiring of input {given.terminal}", given.wiring, f"it can be {', '.join(names)}")


def _require_rate(
    rate: float, inputs: Sequence[AnalogInput], output: FoundDevice, used: Mapping[str, FoundDevice]
) -> None:
    if not rate > 0.0:
        raise InvalidInput("sample_rate", rate, "it must be greater than 0")
    if output.output_rate is not None and rate > output.output_rate:
        raise InvalidInput(
            "sample_rate",
            rate,
            f"the output of {output.name} ({output.product}) makes at most {output.output_rate:g}/s",
        )
    for key, device in used.items():
        channels = sum(device_name(given.terminal).lower() == key for given in inputs)
        highest = device.highest_input_rate(channels) if channels else None
        if highest is not None and rate > highest:
            raise InvalidInput(
                "sample_rate",
                rate,
                f"{channels} inputs of {device.name} ({device.product}) are read at most {highest:g}/s each",
            )
