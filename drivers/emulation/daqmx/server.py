"""The server: devices on a plant, behind an address."""

# ruff: noqa: ARG002 - gRPC gives every call a context, needed or not

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Self, cast

import grpc
import session_pb2 as sessions
from nidaqmx._stubs.nidaqmx_pb2_grpc import NiDAQmxServicer, add_NiDAQmxServicer_to_server
from session_pb2_grpc import SessionUtilitiesServicer, add_SessionUtilitiesServicer_to_server

from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.driver import Driver
from drivers.emulation.daqmx.faults import Boundary, Faults
from drivers.emulation.daqmx.lines import Wires
from drivers.emulation.daqmx.service.channel_attributes import ChannelAttributeService
from drivers.emulation.daqmx.service.channels import ChannelService
from drivers.emulation.daqmx.service.lines import LineService
from drivers.emulation.daqmx.service.reading import ReadingService
from drivers.emulation.daqmx.service.system import SystemService
from drivers.emulation.daqmx.service.timing import TimingService
from drivers.emulation.daqmx.service.watchdogs import WatchdogService
from drivers.emulation.daqmx.service.writing import WritingService
from drivers.emulation.plant import Plant
from sim.errors import InvalidInput
from sim.sensors import Converter


class NiDaqmx(
    SystemService,
    WatchdogService,
    ChannelService,
    ChannelAttributeService,
    TimingService,
    ReadingService,
    WritingService,
    LineService,
    NiDAQmxServicer,
):
    """Whatever is not here is UNIMPLEMENTED, as the base class says."""


class SessionUtilities(SessionUtilitiesServicer):
    """EnumerateDevices, ResetServer."""

    def __init__(self, driver: Driver) -> None:
        self._driver = driver

    def EnumerateDevices(
        self, request: sessions.EnumerateDevicesRequest, context: object
    ) -> sessions.EnumerateDevicesResponse:
        return sessions.EnumerateDevicesResponse(
            devices=[
                sessions.DeviceProperties(
                    name=device.name,
                    model=device.product,
                    vendor="National Instruments",
                    serial_number=f"{device.serial:08X}",
                )
                for device in self._driver.catalogue.devices
            ]
        )

    def ResetServer(self, request: sessions.ResetServerRequest, context: object) -> sessions.ResetServerResponse:
        self._driver.reset()
        return sessions.ResetServerResponse(is_server_reset=True)


_WORKERS = 32
"""Calls at the same time; a read that waits holds one."""


class DaqServer:
    """Speaks like NI's gRPC device server, with `devices` whose terminals are those of `plant`.

    `drive` is the analogue output that drives the plant and `enable_line` the digital line of its enable relay; the
    first that the devices have unless told. `wires` are the digital lines' instead, when the relay is not all there is
    on them. `converter` made the plant's counts. `output_clock_error` is by how much an
    output that does not follow the inputs' sample clock is faster than it, relative; the counter of samples that the
    inputs have taken goes in steps of `packet`, as where they travel in packets. Raises InvalidInput when the address
    cannot be had.
    """

    def __init__(
        self,
        plant: Plant,
        devices: Sequence[DeviceModel],
        *,
        address: str = "127.0.0.1:0",
        converter: Converter | None = None,
        drive: str | None = None,
        enable_line: str | None = None,
        wires: Wires | None = None,
        output_clock_error: float = 0.0,
        packet: int = 1,
    ) -> None:
        self._plant = plant
        outputs = [name for device in devices for name in device.output_names]
        relay = _chosen("enable_line", enable_line, [name for device in devices for name in device.line_names])
        self._driver = Driver(
            plant,
            devices,
            converter if converter is not None else Converter(),
            _chosen("drive", drive, outputs),
            wires if wires is not None else Wires({} if relay is None else {relay: plant.enable}),
            output_clock_error,
            packet,
        )
        self._faults = Faults()
        self._pool = ThreadPoolExecutor(_WORKERS, thread_name_prefix="emulated-daq")
        library = cast(Any, grpc)
        self._server = library.server(
            self._pool,
            interceptors=(Boundary(self._faults),),
            options=[("grpc.so_reuseport", 0), ("grpc.max_receive_message_length", -1)],
        )
        # the generated types call every call abstract, while at run time those that are left out are UNIMPLEMENTED
        daqmx = NiDaqmx(self._driver)  # pyright: ignore[reportAbstractUsage]
        utilities = SessionUtilities(self._driver)  # pyright: ignore[reportAbstractUsage]
        add_NiDAQmxServicer_to_server(daqmx, self._server)
        add_SessionUtilitiesServicer_to_server(utilities, self._server)
        host = address.rpartition(":")[0]
        try:
            port = int(self._server.add_insecure_port(address))
        except RuntimeError as error:
            self._pool.shutdown()
            raise InvalidInput(
                "address", address, "somebody listens there already, or there is no such address"
            ) from error
        self.address = f"{host}:{port}"

    @property
    def first_sample(self) -> float | None:
        """Monotonic time of the first sample of the clocked task that was started last [s]; None before the first."""
        tick = self._driver.first_tick
        return None if tick is None else self._plant.time_of(tick)

    def volts(self, output: str) -> float:
        """Volts at an analogue output at the next tick."""
        with self._driver.instant.next() as tick:
            return self._driver.terminals[output].volts_at(tick)

    def start(self) -> None:
        """Answer from now on."""
        self._server.start()

    def close(self) -> None:
        """Switch devices and server off; no thread and no port is left. Allowed any number of times."""
        self._faults.end()
        gone = self._server.stop(None)
        # ends the reads and writes that wait, too
        self._driver.reset()
        gone.wait()
        self._pool.shutdown()

    def fail_next(self, call: str, code: int) -> None:
        """The next call of this name, such as "StartTask", fails with a code of DAQmx and is not done."""
        self._faults.fail_next(call, code)

    def stall(self, seconds: float) -> None:
        """Answer nobody for so long, like a frozen machine; the devices go on."""
        self._faults.stall(seconds)

    def vanish(self) -> None:
        """Be gone at once, like a server whose cable is pulled; the devices go on until `close`."""
        self._server.stop(None).wait()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _chosen(item: str, given: str | None, known: Sequence[str]) -> str | None:
    """The one that was told, else the first."""
    if given is None:
        return known[0] if known else None
    if given not in known:
        raise InvalidInput(item, given, f"the devices have: {', '.join(known) or 'none'}")
    return given
