"""Wiring of the emulated laboratory, and the client's configuration that follows from it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from drivers.daqmx.parameters import AmplifierReady, Daq, EmergencyStop, Heartbeat, OverTravel, OverTravel2
from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.models import compact_rio, x_series
from drivers.emulation.daqmx.zoo import build
from drivers.hardware.parameters import Hardware, Laser1, Laser2, Lasers, TableAcceleration, TableDisplacement
from sim.errors import InvalidInput
from sim.parameters import Parameters
from sim.virtual_bench import VirtualBenchParameters

Connection = Literal["serial", "socket", "analogue"]
"""Connection of the lasers; `socket` is the serial line through a TCP socket."""
Device = Literal["usb", "crio", "cDAQ-9174", "cDAQ-9185", "cRIO-9045", "cRIO-9049", "PCIe-6351", "USB-6351"]
"""Selectable devices: `usb` (USB-6363) and `crio` (cRIO-9045 with NI 9239), both with calibration polynomials, and the
devices of `zoo`.
"""

_VALUES = 4
"""Number of values per measurement on the serial line: distance, counter, and the two halves of the time stamp."""
_BAUD = 921_600
_WATCHDOG = 1.0
"""Time-out of the device's watchdog on the enable line [s]."""
HEARTBEAT = 1.5
"""Time-out of the heartbeat relay [s]; longer than that of the watchdog, so that their effects can be distinguished."""
_READY = 1.0
"""Configured delay of the amplifier: longest time from closing the enable line to the ready signal [s]."""
_CONTACTS = 4
"""Number of lines for the contacts of the safety chain."""


@dataclass(frozen=True)
class Site:
    """Devices of a laboratory and the terminals in use.

    `inputs` are the terminals of displacement, acceleration and lasers; `contacts` are the digital inputs in the order
    of `safety_chain.INPUTS`, empty on a device without digital inputs. `counter` is the counter that switches the
    lasers, None if there is none. `range` is the largest voltage that all inputs can measure [V].
    """

    devices: tuple[DeviceModel, ...]
    inputs: tuple[str, str, str, str]
    output: str
    enable: str
    heartbeat: str
    contacts: tuple[str, ...]
    counter: str | None
    has_watchdog: bool
    range: float


def site_of(device: Device, modules: Sequence[str] = ()) -> Site:
    """The wiring of a device, or of a chassis with `modules`.

    If a chassis has several input modules, the accelerometer is wired to the first and the other sensors to the second.
    Raises InvalidInput for a chassis without inputs, output or relays, for modules that it cannot hold, and if
    `modules` are specified for a fixed set of devices.
    """
    if device in ("usb", "crio"):
        if modules:
            raise InvalidInput("--modules", " ".join(modules), f"{device} is a fixed set of devices; specify a chassis")
        devices = (x_series(calibrated=True),) if device == "usb" else compact_rio(calibrated=True)
    else:
        devices = build(device, modules)
    analogue = [one for one in devices if one.inputs is not None]
    if device == "crio":
        # all sensors are wired to the first module; the second one reads other terminals of the plant
        analogue = analogue[:1]
    drive = _first(devices, "an analogue output (9263, 9269)", lambda one: one.output_names)
    relays = _first(devices, "relays or digital outputs (9485, 9401)", lambda one: one.line_names)
    contacts = _contacts(devices, relays)
    first, *others = analogue or [
        _first(devices, "analogue inputs (9205, 9215, 9234, 9239)", lambda one: one.input_names)
    ]
    rest = others[0] if others else first
    ranges = [one.inputs.ranges[0] for one in (first, rest) if one.inputs is not None]
    # on a single device, the heartbeat line is next to the contacts
    heartbeat = relays.line_names[_CONTACTS + 1 if len(devices) == 1 else 1]
    return Site(
        devices=devices,
        inputs=(rest.input_names[0], first.input_names[1], rest.input_names[2], rest.input_names[3]),
        output=drive.output_names[0],
        enable=relays.line_names[0],
        heartbeat=heartbeat,
        contacts=contacts,
        counter=next((name for one in devices for name in one.counter_names), None),
        has_watchdog=any(one.watchdog is not None for one in devices),
        range=min(ranges),
    )


def _first(devices: Sequence[DeviceModel], what: str, has: Callable[[DeviceModel], Sequence[str]]) -> DeviceModel:
    for one in sorted(devices, key=lambda one: one.input_lines > 0):
        if has(one):
            return one
    raise InvalidInput("--modules", " ".join(one.product for one in devices), f"the laboratory needs {what}")


def _contacts(devices: Sequence[DeviceModel], relays: DeviceModel) -> tuple[str, ...]:
    """The lines of the safety inputs, if possible not on the module of the relays; empty if there are none."""
    for one in sorted(devices, key=lambda one: one is relays):
        names = one.input_line_names
        if one is not relays:
            if names:
                return names[:_CONTACTS]
        elif names:
            first = max(one.direction_group, 1)
            return names[first : first + _CONTACTS]
    return ()


def sensors_within(parameters: VirtualBenchParameters, span: float) -> VirtualBenchParameters:
    """The virtual bench; if +-`span` [V] is less than its converter's range, its sensors are scaled down to this range.

    The sensors of a laboratory, and the load resistors of its lasers, match its inputs. Inputs of 5 V (NI 9234) would
    cut off the signals of 10 V sensors at half their measuring ranges.
    """
    share = min(1.0, span / parameters.converter.range)
    changed: dict[str, Parameters] = {}
    for name, key in (
        ("displacement_sensor", "sensitivity"),
        ("accelerometer", "sensitivity"),
        ("laser_1", "load"),
        ("laser_2", "load"),
    ):
        sensor = getattr(parameters, name)
        changed[name] = sensor.model_copy(update={key: share * getattr(sensor, key)})
    return parameters.model_copy(update=changed)


_PIPELINE = 3
"""Measuring cycles between exposure and output (manual of the optoNCDT 1420, p. 52)."""


def hardware_of(
    p: VirtualBenchParameters,
    site: Site,
    connection: Connection,
    *,
    server: str,
    emulator_address: str,
    ports: Sequence[str | None],
) -> Hardware:
    """The configuration of a client, with the calibrations of the virtual bench; `ports` are the lasers' serial
    ports.
    """
    displacement, acceleration, laser_1, laser_2 = site.inputs
    lines: tuple[str | None, ...] = site.contacts or (None,) * _CONTACTS
    emergency_stop, over_travel, over_travel_2, ready = lines
    span = min(p.converter.range, site.range)
    # delay from the data sheets of filter and laser; the loop check measures the remainder
    latency = _PIPELINE / p.laser_1.rate + 30.0 * _VALUES / _BAUD
    delay = p.filter_unit.delay(p.sample_rate) - latency if connection != "analogue" else 0.0
    return Hardware(
        sample_rate=p.sample_rate,
        half_stroke=p.shaker.half_stroke,
        emulator_address=emulator_address,
        daq=Daq(
            server=server,
            output=site.output,
            output_range=p.shaker.drive_range,
            enable_line=site.enable,
            watchdog=_WATCHDOG if site.has_watchdog else None,
            emergency_stop=None if emergency_stop is None else EmergencyStop(line=emergency_stop),
            over_travel=None if over_travel is None else OverTravel(line=over_travel),
            over_travel_2=None if over_travel_2 is None else OverTravel2(line=over_travel_2),
            amplifier_ready=None if ready is None else AmplifierReady(line=ready, delay=_READY),
            heartbeat=Heartbeat(line=site.heartbeat, timeout=HEARTBEAT),
        ),
        table_displacement=TableDisplacement(
            terminal=displacement, range=span, sensitivity=1.0 / p.displacement_sensor.nominal[0]
        ),
        table_acceleration=TableAcceleration(
            terminal=acceleration, range=span, sensitivity=1.0 / p.accelerometer.nominal[0]
        ),
        lasers=Lasers(
            connection="analogue" if connection == "analogue" else "serial",
            reference=p.laser_1.reference,
            rate=p.laser_1.rate,
            delay=round(delay, 6),
            load=p.laser_1.load,
        ),
        laser_1=Laser1(terminal=laser_1, range=span, port=ports[0], measuring_range=p.laser_1.measuring_range),
        laser_2=Laser2(terminal=laser_2, range=span, port=ports[1], measuring_range=p.laser_2.measuring_range),
    )
