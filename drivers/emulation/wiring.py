"""How the emulated laboratory is wired, as a client's configuration says it."""

from collections.abc import Sequence
from typing import Literal

from drivers.daqmx.parameters import AmplifierReady, Daq, EmergencyStop, Heartbeat, OverTravel, OverTravel2
from drivers.hardware.parameters import Hardware, Laser1, Laser2, Lasers, TableAcceleration, TableDisplacement
from sim.virtual_bench import VirtualBenchParameters

Connection = Literal["serial", "analogue"]
Device = Literal["usb", "crio"]

_VALUES = 4
"""Values of a measurement on the serial line: distance, counter, and the two halves of the time stamp."""
_BAUD = 921_600
_WATCHDOG = 1.0
"""Time-out of the device's watchdog on the enable line [s]."""
HEARTBEAT = 1.5
"""Time-out of the relay that the heartbeat keeps closed [s]; longer than the watchdog's, so that both can be seen."""
_READY = 1.0
"""What is said of the amplifier: ready so long after its enable at the latest [s]."""
LINES: dict[Device, tuple[str, str, tuple[str, ...]]] = {
    "usb": ("Dev1/port0/line0", "Dev1/port0/line5", tuple(f"Dev1/port0/line{k}" for k in range(1, 5))),
    "crio": ("cRIO1Mod4/port0/line0", "cRIO1Mod4/port0/line1", tuple(f"cRIO1Mod5/port0/line{k}" for k in range(4))),
}
"""Enable line, heartbeat line, and the lines of the safety inputs in the order of INPUTS."""
_PIPELINE = 3
"""Measurements from exposure to output (manual of the optoNCDT 1420, p. 52)."""


def hardware_of(
    p: VirtualBenchParameters,
    device: Device,
    connection: Connection,
    *,
    server: str,
    hands: str,
    ports: Sequence[str | None],
) -> Hardware:
    """The configuration of a client, with the calibrations of the virtual bench; `ports` are those of the lasers."""
    inputs, output = ("Dev1", "Dev1/ao0") if device == "usb" else ("cRIO1Mod1", "cRIO1Mod3/ao0")
    line, heartbeat, (emergency_stop, over_travel, over_travel_2, ready) = LINES[device]
    # what a person reads off the data sheets of filter and laser; what is left, the loop check measures
    latency = _PIPELINE / p.laser_1.rate + 30.0 * _VALUES / _BAUD
    delay = p.filter_unit.delay(p.sample_rate) - latency if connection == "serial" else 0.0
    return Hardware(
        sample_rate=p.sample_rate,
        half_stroke=p.shaker.half_stroke,
        hands=hands,
        daq=Daq(
            server=server,
            output=output,
            output_range=p.shaker.drive_range,
            enable_line=line,
            watchdog=_WATCHDOG if device == "usb" else None,
            emergency_stop=EmergencyStop(line=emergency_stop),
            over_travel=OverTravel(line=over_travel),
            over_travel_2=OverTravel2(line=over_travel_2),
            amplifier_ready=AmplifierReady(line=ready, delay=_READY),
            heartbeat=Heartbeat(line=heartbeat, timeout=HEARTBEAT),
        ),
        table_displacement=TableDisplacement(
            terminal=f"{inputs}/ai0", range=p.converter.range, sensitivity=1.0 / p.displacement_sensor.nominal[0]
        ),
        table_acceleration=TableAcceleration(
            terminal=f"{inputs}/ai1", range=p.converter.range, sensitivity=1.0 / p.accelerometer.nominal[0]
        ),
        lasers=Lasers(
            connection=connection,
            reference=p.laser_1.reference,
            rate=p.laser_1.rate,
            delay=round(delay, 6),
            load=p.laser_1.load,
        ),
        laser_1=Laser1(
            terminal=f"{inputs}/ai2",
            range=p.converter.range,
            port=ports[0],
            measuring_range=p.laser_1.measuring_range,
        ),
        laser_2=Laser2(
            terminal=f"{inputs}/ai3",
            range=p.converter.range,
            port=ports[1],
            measuring_range=p.laser_2.measuring_range,
        ),
    )
