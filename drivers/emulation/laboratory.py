"""The whole emulated laboratory: bench, DAQ, lasers, and the hands that change springs and cause faults."""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, Literal, Self

from drivers.daqmx.parameters import Daq
from drivers.emulation.bench import EmulatedBench
from drivers.emulation.control import ControlServer
from drivers.emulation.daqmx.models import compact_rio, x_series
from drivers.emulation.daqmx.server import DaqServer
from drivers.emulation.optoncdt.laser import EmulatedLaser
from drivers.hardware.parameters import (
    Hardware,
    Laser1,
    Laser2,
    Lasers,
    TableAcceleration,
    TableDisplacement,
)
from drivers.rig import Handwork
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters

Connection = Literal["serial", "analogue"]
Device = Literal["usb", "crio"]

_VALUES = 4
"""Values of a measurement on the serial line: distance, counter, and the two halves of the time stamp."""
_BAUD = 921_600
_WATCHDOG = 1.0
"""Time-out of the device's watchdog on the enable line [s]."""
_PIPELINE = 3
"""Measurements from exposure to output (manual of the optoNCDT 1420, p. 52)."""


@dataclass(frozen=True)
class ClockErrors:
    """Relative errors of the clocks: sample clock of the DAQ, laser on the first and on the second storey."""

    daq: float = 12e-6
    laser_1: float = 30e-6
    laser_2: float = -21e-6


class Laboratory:
    """Instruments that speak their real protocols, around one virtual bench in real time.

    `hardware` is the configuration with which a client reaches them. Raises DeviceNotFound where pseudo-terminals,
    which serial lasers need, do not exist; nothing is left open then.
    """

    def __init__(
        self,
        parameters: VirtualBenchParameters,
        specimen: Specimen,
        *,
        seed: int,
        spring_factor: float = 1.0,
        connection: Connection = "serial",
        device: Device = "usb",
        clock_errors: ClockErrors | None = None,
    ) -> None:
        errors = clock_errors or ClockErrors()
        with ExitStack() as opened:
            bench = EmulatedBench(parameters, specimen, seed=seed, spring_factor=spring_factor, clock_error=errors.daq)
            opened.callback(bench.close)
            self.bench = bench
            self.lasers: tuple[EmulatedLaser, ...] = ()
            if connection == "serial":
                for storey, laser, error in (
                    (1, parameters.laser_1, errors.laser_1),
                    (2, parameters.laser_2, errors.laser_2),
                ):
                    one = EmulatedLaser(
                        bench.sight(storey), laser, serial=f"1503000{storey}", clock_error=error, seed=seed + storey
                    )
                    opened.callback(one.close)
                    bench.connect_laser(storey, lambda one=one: one.analogue)
                    self.lasers += (one,)
            models = (x_series(calibrated=True),) if device == "usb" else compact_rio(calibrated=True)
            self.daq = DaqServer(bench, models, converter=parameters.converter)
            opened.callback(self.daq.close)
            self._control = ControlServer(self._handlers())
            opened.callback(self._control.close)
            self.hardware = self._wiring(parameters, device, connection)
            self._opened = opened.pop_all()

    def start(self) -> None:
        """Switch everything on."""
        self.bench.start()
        for laser in self.lasers:
            laser.start()
        self.daq.start()

    def close(self) -> None:
        """Switch everything off; no thread, port or process is left. Allowed any number of times."""
        self._opened.close()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _wiring(self, p: VirtualBenchParameters, device: Device, connection: Connection) -> Hardware:
        """The configuration of a client, with the calibrations of the virtual bench."""
        inputs, output, line = (
            ("Dev1", "Dev1/ao0", "Dev1/port0/line0")
            if device == "usb"
            else ("cRIO1Mod1", "cRIO1Mod3/ao0", "cRIO1Mod4/port0/line0")
        )
        # what a person reads off the data sheets of filter and laser; what is left, the loop check measures
        latency = _PIPELINE / p.laser_1.rate + 30.0 * _VALUES / _BAUD
        delay = p.filter_unit.delay(p.sample_rate) - latency if connection == "serial" else 0.0
        ports = [laser.port for laser in self.lasers] or [None, None]
        return Hardware(
            sample_rate=p.sample_rate,
            half_stroke=p.shaker.half_stroke,
            hands=self._control.address,
            daq=Daq(
                server=self.daq.address,
                output=output,
                output_range=p.shaker.drive_range,
                enable_line=line,
                watchdog=_WATCHDOG if device == "usb" else None,
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

    def _handlers(self) -> dict[str, Any]:
        """What may be asked for from outside: the work of hands, faults, and the truth that no client could know."""
        return {"handwork": self._handwork, "laser": self._laser, "daq": self._daq, "truth": self._truth}

    def _handwork(self, arguments: Mapping[str, Any]) -> None:
        self.bench.handwork(Handwork(arguments["work"]), arguments.get("stiffness"))

    def _laser(self, arguments: Mapping[str, Any]) -> None:
        """A fault of the laser on `storey`: the name of a method of EmulatedLaser, and its `arguments`."""
        laser = self.lasers[int(arguments["storey"]) - 1]
        _FAULTS_OF_LASER[arguments["fault"]](laser, *arguments.get("arguments", ()))

    def _daq(self, arguments: Mapping[str, Any]) -> None:
        """A fault of the DAQ: the name of a method of DaqServer, and its `arguments`."""
        _FAULTS_OF_DAQ[arguments["fault"]](self.daq, *arguments.get("arguments", ()))

    def _truth(self, arguments: Mapping[str, Any]) -> dict[str, Any]:  # noqa: ARG002 - the signature of a handler
        """Host times [s] of the clocks' zeros and their true rates."""
        return {
            "first_sample": self.daq.first_sample,
            "sample_rate": self.bench.rate_true,
            "lasers": [{"epoch": laser.epoch, "rate": laser.rate_true} for laser in self.lasers],
        }


_FAULTS_OF_LASER = {
    method.__name__: method
    for method in (
        EmulatedLaser.lose_bytes,
        EmulatedLaser.garbage,
        EmulatedLaser.silence,
        EmulatedLaser.laser_off,
        EmulatedLaser.laser_on,
        EmulatedLaser.target,
        EmulatedLaser.unplug,
    )
}
_FAULTS_OF_DAQ = {method.__name__: method for method in (DaqServer.fail_next, DaqServer.stall, DaqServer.vanish)}
