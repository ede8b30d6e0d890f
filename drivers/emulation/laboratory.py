"""The emulated laboratory: bench, DAQ, lasers, and a control channel for operator tasks and faults."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from drivers.emulation.bench import EmulatedBench
from drivers.emulation.control import ControlServer
from drivers.emulation.daqmx.lines import Wires
from drivers.emulation.daqmx.server import DaqServer
from drivers.emulation.optoncdt.laser import EmulatedLaser
from drivers.emulation.safety_chain import INPUTS, SafetyChain
from drivers.emulation.wiring import HEARTBEAT, Connection, Device, hardware_of, sensors_within, site_of
from drivers.rig import OperatorTask
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters

LATE = 0.05
"""Delay in sending the values of an emulated laser [s] above which `Laboratory.late` reports it."""


@dataclass(frozen=True)
class ClockErrors:
    """Relative errors of the DAQ's sample clock and of the clocks of the lasers on the first and second storeys."""

    daq: float = 12e-6
    laser_1: float = 30e-6
    laser_2: float = -21e-6


class Laboratory:
    """Emulated instruments with real wire protocols, connected to one virtual bench in real time.

    `hardware` is the configuration that a client requires; `modules` are the modules of a chassis. Raises InvalidInput
    if `modules` are not valid for `device` or lack a required function, and DeviceNotFound if serial lasers are
    requested on a system without pseudo-terminals; all instruments opened so far are closed first.
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
        modules: Sequence[str] = (),
        clock_errors: ClockErrors | None = None,
    ) -> None:
        errors = clock_errors or ClockErrors()
        site = site_of(device, modules)
        parameters = sensors_within(parameters, site.range)
        with ExitStack() as opened:
            bench = EmulatedBench(parameters, specimen, seed=seed, spring_factor=spring_factor, clock_error=errors.daq)
            opened.callback(bench.close)
            self.bench = bench
            self.lasers: tuple[EmulatedLaser, ...] = ()
            if connection != "analogue":
                for storey, laser, error in (
                    (1, parameters.laser_1, errors.laser_1),
                    (2, parameters.laser_2, errors.laser_2),
                ):
                    one = EmulatedLaser(
                        bench.sight(storey),
                        laser,
                        serial=f"1503000{storey}",
                        clock_error=error,
                        seed=seed + storey,
                        network=connection == "socket",
                    )
                    opened.callback(one.close)
                    bench.connect_laser(storey, lambda one=one: one.analogue)
                    self.lasers += (one,)
            self.safety = SafetyChain(bench, HEARTBEAT)
            wires = Wires(
                {site.enable: self.safety.enable_line, site.heartbeat: self.safety.heartbeat_line},
                {line: self.safety.inputs[name] for name, line in zip(INPUTS, site.contacts, strict=False)},
                {} if site.counter is None else {site.counter: self._switch_lasers},
            )
            self.daq = DaqServer(bench, site.devices, converter=parameters.converter, drive=site.output, wires=wires)
            opened.callback(self.daq.close)
            self._control = ControlServer(self._handlers())
            opened.callback(self._control.close)
            ports = [laser.port for laser in self.lasers] or [None, None]
            self.hardware = hardware_of(
                parameters,
                site,
                connection,
                server=self.daq.address,
                emulator_address=self._control.address,
                ports=ports,
            )
            self._opened = opened.pop_all()

    def start(self) -> None:
        """Start the bench, the lasers and the DAQ server."""
        self.bench.start()
        for laser in self.lasers:
            laser.start()
        self.daq.start()

    def late(self) -> dict[str, float]:
        """Longest delay [s] with which this computer has sent values since the last call, for each laser with a delay
        greater than `LATE`.
        """
        found = {f"laser {storey}": laser.take_lateness() for storey, laser in enumerate(self.lasers, 1)}
        return {name: delay for name, delay in found.items() if delay > LATE}

    def close(self) -> None:
        """Close all instruments and end all threads; may be called repeatedly."""
        self._opened.close()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _handlers(self) -> dict[str, Any]:
        """Handlers of remote commands: operator tasks, faults, and true values that no client can measure."""
        return {
            "handwork": self._perform,
            "laser": self._laser,
            "daq": self._daq,
            "safety": self._safety,
            "truth": self._truth,
        }

    def _perform(self, arguments: Mapping[str, Any]) -> None:
        self.bench.perform(OperatorTask(arguments["work"]), arguments.get("amount"))

    def _switch_lasers(self, edges: NDArray[np.float64]) -> None:
        """Switch the lasers at `edges`, the host times [s] of the edges of the counter, whose output is wired to their
        on/off inputs. A high level opens these inputs, which switches the lasers off.
        """
        for laser in self.lasers:
            laser.switch(edges)

    def _laser(self, arguments: Mapping[str, Any]) -> None:
        """Call the method of EmulatedLaser named by `fault`, for the laser on `storey`, with `arguments`."""
        laser = self.lasers[int(arguments["storey"]) - 1]
        _FAULTS_OF_LASER[arguments["fault"]](laser, *arguments.get("arguments", ()))

    def _daq(self, arguments: Mapping[str, Any]) -> None:
        """Call the method of DaqServer named by `fault`, with `arguments`."""
        _FAULTS_OF_DAQ[arguments["fault"]](self.daq, *arguments.get("arguments", ()))

    def _safety(self, arguments: Mapping[str, Any]) -> None:
        """Call the method of SafetyChain named by `fault`, with `arguments`."""
        _FAULTS_OF_SAFETY[arguments["fault"]](self.safety, *arguments.get("arguments", ()))

    def _truth(self, arguments: Mapping[str, Any]) -> dict[str, Any]:  # noqa: ARG002 - the signature of a handler
        """True values: host times [s] at which the clocks are zero, clock rates and time-stamp lags; states of the
        enable chain and its contacts; volts at the drive output.
        """
        return {
            "enabled": self.bench.enabled,
            "contacts": self.safety.contacts,
            "drive": self.daq.volts(self.hardware.daq.output),
            "first_sample": self.daq.first_sample,
            "sample_rate": self.bench.rate_true,
            "lasers": [
                {"epoch": laser.epoch, "rate": laser.rate_true, "stamp_lag": laser.stamp_lag} for laser in self.lasers
            ],
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
_FAULTS_OF_SAFETY = {
    method.__name__: method
    for method in (
        SafetyChain.press_emergency_stop,
        SafetyChain.release_emergency_stop,
        SafetyChain.trip_over_travel,
        SafetyChain.reset_over_travel,
        SafetyChain.trip_amplifier,
        SafetyChain.reset_amplifier,
        SafetyChain.break_wire,
        SafetyChain.mend_wire,
    )
}
