"""What a session says of its device and its wiring, for the data file."""

from collections.abc import Sequence

from drivers.daqmx.devices import FoundDevice
from drivers.daqmx.library import Version
from drivers.daqmx.parameters import AnalogInput, Daq
from drivers.daqmx.tasks import Tasks

_MISSING = "not wired to this program: it must open the enable chain by itself"


def description_of(
    daq: Daq,
    inputs: Sequence[AnalogInput],
    used: Sequence[FoundDevice],
    version: Version,
    tasks: Tasks,
    stale: Sequence[str],
) -> dict[str, str]:
    """Names and settings in words; `used` are the devices, `stale` the tasks that another client had left."""
    heartbeat = daq.heartbeat
    return {
        "driver": f"NI-DAQmx {version.major_version}.{version.minor_version}.{version.update_version}",
        "server": daq.server or "none: the driver of this PC",
        **{f"device {device.name}": device.identity for device in used},
        "inputs": ", ".join(f"{given.terminal} ({given.wiring}, +-{given.range:g} V)" for given in inputs),
        "output": f"{daq.output} (+-{daq.output_range:g} V)",
        "output transfer": tasks.output.transfer,
        "start trigger": tasks.inputs.trigger,
        "sample clock of the output": tasks.inputs.clock,
        "enable line": daq.enable_line or "none",
        "watchdog": "none: a program that dies leaves the relay as it is"
        if daq.watchdog is None
        else f"{daq.watchdog:g} s",
        "heartbeat": "none"
        if heartbeat is None
        else f"{heartbeat.line}, its relay opens after {heartbeat.timeout:g} s",
        **{name: f"{given.line}, {given.good} is good" for name, given in daq.safety_inputs.items()},
        **dict.fromkeys(daq.missing_inputs, _MISSING),
        "tasks left by another client": ", ".join(stale) or "none",
    }
