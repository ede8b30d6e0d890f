"""`rockbench devices`: lists connected instruments and installed rig backends."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bench.app.catalogue import all_backends
from bench.app.cli.inputs import configuration_from
from bench.app.cli.options import Handed, Json
from bench.app.cli.output import print_result
from bench.progress import silent
from drivers.errors import RigError
from sim.extras import MissingExtra, require

if TYPE_CHECKING:
    from drivers.daqmx.devices import FoundDevice
    from drivers.daqmx.parameters import Tls
    from drivers.hardware.parameters import Hardware
    from drivers.optoncdt.search import FoundLaser


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
            help="Serial port to query for a laser; may be given several times.",
            show_default="all",
        ),
    ] = (),
    config: Annotated[
        Path | None,
        Parameter(metavar="FILE", help="Configuration (TOML) whose device server and serial ports are searched."),
    ] = None,
    as_json: Json = False,
    progress: Handed = silent,
) -> int:
    """List the NI devices with their channels and ranges, the lasers on the serial ports, and the rig backends.

    Each port is queried at every baud rate; specify the ports if other instruments must not be disturbed. The exit code
    is 0, even if nothing is found, or 2 if an argument or the configuration is refused.
    """
    progress("searching for NI devices")
    if server is not None:
        require("ni", "--server")
    if port:
        require("serial", "--port")
    hardware = None if config is None else configuration_from(config, None).hardware
    server = server if server is not None or hardware is None else hardware.daq.server
    daq = None if hardware is None else hardware.daq
    found, missing = _daq(server, None if daq is None else daq.tls, plain=daq is not None and daq.plain_connection)
    progress("querying the serial ports")
    lasers, no_ports = _lasers(port or _configured(hardware))
    backends, failed = all_backends()
    content: dict[str, Any] = {
        "server": server,
        "devices": [asdict(device) for device in found],
        "reason": missing,
        "ports": [asdict(laser) for laser in lasers],
        "ports_reason": no_ports,
        "backends": list(backends),
        "backends_failed": failed,
    }
    lines = [*_daq_lines(server, found, missing), "", *_laser_lines(lasers, no_ports), ""]
    lines += [f"Rig backends: {', '.join(backends)}", *(f"  not available: {line}" for line in failed)]
    print_result(lambda: content, lambda: "\n".join(lines), as_json=as_json)
    return 0


def _daq(server: str | None, tls: "Tls | None", *, plain: bool) -> "tuple[list[FoundDevice], str | None]":
    """The NI devices and None, or an empty list and the reason if the search failed."""
    try:
        require("ni", "the search for NI devices")
        from drivers.daqmx.devices import find_devices

        return find_devices(server, tls, plain=plain), None
    except (MissingExtra, RigError) as error:
        return [], str(error)


def _configured(hardware: "Hardware | None") -> tuple[str, ...]:
    if hardware is None:
        return ()
    return tuple(laser.port for laser in (hardware.laser_1, hardware.laser_2) if laser.port is not None)


def _lasers(ports: tuple[str, ...]) -> "tuple[list[FoundLaser], str | None]":
    """The lasers on the serial ports and None, or an empty list and the reason if the package for the search is not
    installed.
    """
    try:
        require("serial", "the search for lasers")
    except MissingExtra as error:
        return [], str(error)
    from drivers.optoncdt.search import find_lasers

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
        return ["Serial ports:", "  none: plug in the laser adapters and check that their drivers are installed"]
    return ["Serial ports:", *(f"  {laser.port}: {_laser_text(laser)}" for laser in lasers)]


def _laser_text(laser: "FoundLaser") -> str:
    if laser.info is None:
        return laser.problem or "nothing"
    identity = f"{laser.info.identity}, {laser.baud} baud"
    return identity if laser.problem is None else f"{identity}; {laser.problem}"
