"""`rockbench devices`: which instruments are there."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from bench.cli.inputs import configuration_from
from bench.cli.progress import Handed
from bench.progress import silent
from drivers.errors import RigError
from sim.extras import MissingExtra, require

if TYPE_CHECKING:
    from drivers.daqmx.devices import FoundDevice
    from drivers.hardware.parameters import Hardware
    from drivers.optoncdt.find import FoundLaser


def devices_app() -> App:
    """`rockbench devices`."""
    app = App(name="devices", help="List NI devices and lasers.", version_flags=())
    app.default(devices)
    return app


def devices(
    *,
    server: Annotated[
        str | None,
        Parameter(metavar="HOST:PORT", help="gRPC device server.", show_default="the NI-DAQmx driver of this PC"),
    ] = None,
    port: Annotated[
        tuple[str, ...],
        Parameter(
            metavar="PORT",
            negative=(),
            help="Serial port to ask for a laser; may be given several times.",
            show_default="all",
        ),
    ] = (),
    config: Annotated[
        Path | None, Parameter(metavar="FILE", help="Configuration whose server and ports are looked at.")
    ] = None,
    as_json: Annotated[
        bool, Parameter(name="--json", negative=(), show_default=False, help="Print one JSON object.")
    ] = False,
    progress: Handed = silent,
) -> int:
    """List the NI devices with their channels and ranges, and what answers on the serial ports.

    A port is asked at every baud rate; name the ports when other instruments must not be disturbed. Nothing found is
    a result: the exit code is 0 then, and 2 when what was given is refused.
    """
    progress("asking for NI devices")
    if server is not None:
        require("ni", "--server")
    if port:
        require("serial", "--port")
    hardware = None if config is None else configuration_from(config, None).hardware
    server = server if server is not None or hardware is None else hardware.daq.server
    found, missing = _daq(server)
    progress("asking on the serial ports, about 4 s")
    lasers, no_ports = _lasers(port or _configured(hardware))
    if as_json:
        print(_json_text(server, found, missing, lasers, no_ports))
    else:
        print("\n".join([*_daq_lines(server, found, missing), "", *_laser_lines(lasers, no_ports)]))
    return 0


def _daq(server: str | None) -> "tuple[list[FoundDevice], str | None]":
    """The NI devices, or none and the reason."""
    try:
        require("ni", "the search for NI devices")
        from drivers.daqmx.devices import find_devices

        return find_devices(server), None
    except (MissingExtra, RigError) as error:
        return [], str(error)


def _configured(hardware: "Hardware | None") -> tuple[str, ...]:
    if hardware is None:
        return ()
    return tuple(laser.port for laser in (hardware.laser_1, hardware.laser_2) if laser.port is not None)


def _lasers(ports: tuple[str, ...]) -> "tuple[list[FoundLaser], str | None]":
    """What is on the serial ports, or nothing and the reason."""
    try:
        require("serial", "the search for lasers")
    except MissingExtra as error:
        return [], str(error)
    from drivers.optoncdt.find import find_lasers

    return find_lasers(ports or None), None


def _daq_lines(server: str | None, found: "list[FoundDevice]", missing: str | None) -> list[str]:
    lines = [f"NI devices, {'the driver of this PC' if server is None else f'the server at {server}'}:"]
    if missing is not None:
        return [*lines, f"  none: {missing}"]
    if not found:
        return [*lines, "  none: connect a device, or create a simulated one in NI MAX"]
    for device in found:
        lines.append(f"  {device.name}: {device.identity}")
        for kind, channels, ranges in (
            ("inputs", device.inputs, device.input_ranges),
            ("outputs", device.outputs, device.output_ranges),
            ("lines", device.lines, ()),
            ("input lines", device.input_lines, ()),
        ):
            if channels:
                lines.append(f"    {kind}: {_channels(channels)}{_volts(ranges)}")
    return lines


def _channels(names: tuple[str, ...]) -> str:
    return f"{names[0]} to {names[-1]} ({len(names)})" if len(names) > 4 else ", ".join(names)


def _volts(ranges: tuple[tuple[float, float], ...]) -> str:
    return f"; ranges {', '.join(f'{low:g} .. {high:g} V' for low, high in ranges)}" if ranges else ""


def _laser_lines(lasers: "list[FoundLaser]", missing: str | None) -> list[str]:
    if missing is not None:
        return ["Serial ports:", f"  none: {missing}"]
    if not lasers:
        return ["Serial ports:", "  none: plug in the adapters of the lasers, and see that their driver is installed"]
    return ["Serial ports:", *(f"  {laser.port}: {_said(laser)}" for laser in lasers)]


def _said(laser: "FoundLaser") -> str:
    if laser.info is None:
        return laser.problem or "nothing"
    identity = f"{laser.info.identity}, {laser.baud} baud"
    return identity if laser.problem is None else f"{identity}; {laser.problem}"


def _json_text(
    server: str | None,
    found: "list[FoundDevice]",
    missing: str | None,
    lasers: "list[FoundLaser]",
    no_ports: str | None,
) -> str:
    content: dict[str, Any] = {
        "server": server,
        "devices": [asdict(device) for device in found],
        "reason": missing,
        "ports": [asdict(laser) for laser in lasers],
        "ports_reason": no_ports,
    }
    return json.dumps(content, allow_nan=False)
