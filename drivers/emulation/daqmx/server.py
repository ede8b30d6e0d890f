"""Emulated gRPC device server at a network address: devices wired to a plant, and faults on request."""

# ruff: noqa: ARG002 - gRPC passes a context to every call

import threading
import time
from collections import deque
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Self, cast

import grpc
import session_pb2 as sessions
from nidaqmx._stubs.nidaqmx_pb2_grpc import NiDAQmxServicer, add_NiDAQmxServicer_to_server
from nidaqmx.error_codes import DAQmxErrors
from session_pb2_grpc import SessionUtilitiesServicer, add_SessionUtilitiesServicer_to_server

from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.driver import Driver
from drivers.emulation.daqmx.errors import DaqmxFailure, NotEmulated, SessionExists, SessionMissing
from drivers.emulation.daqmx.lines import Wires
from drivers.emulation.daqmx.service.attributes import ChannelAttributeService
from drivers.emulation.daqmx.service.channels import ChannelService
from drivers.emulation.daqmx.service.lines import LineService, WatchdogService
from drivers.emulation.daqmx.service.samples import ReadingService, WritingService
from drivers.emulation.daqmx.service.system import SystemService
from drivers.emulation.daqmx.service.timing import TimingService
from drivers.emulation.plant import Plant
from sim import waiting
from sim.errors import InvalidInput
from sim.sensors import Converter

_GRPC = cast(Any, grpc)


class Faults:
    """Faults requested for later calls."""

    def __init__(self) -> None:
        self._codes: dict[str, deque[int]] = {}
        self._changed = threading.Condition()
        self._silent_until = 0.0

    def fail_next(self, call: str, code: int) -> None:
        """Make the next call of this name fail with a DAQmx code and without effect; each request applies to one
        call.
        """
        with self._changed:
            self._codes.setdefault(call, deque()).append(code)

    def stall(self, seconds: float) -> None:
        """Stall all calls for `seconds`; they take effect and are answered afterwards."""
        with self._changed:
            self._silent_until = time.monotonic() + seconds

    def end(self) -> None:
        """End the stall, so that requests are answered again."""
        with self._changed:
            self._silent_until = 0.0
            self._changed.notify_all()

    def strike(self, call: str) -> None:
        """Apply the requested faults, if any, to a call: delay it, or raise DaqmxFailure."""
        with self._changed:
            while (remaining := self._silent_until - time.monotonic()) > 0.0:
                self._changed.wait(remaining)
            if waiting := self._codes.get(call):
                code = waiting.popleft()
                raise DaqmxFailure(DAQmxErrors(code), f"A failure was requested: {DAQmxErrors(code).name}")


class Boundary(_GRPC.ServerInterceptor):
    """Interceptor of every call: injects faults and transmits errors as NI's server does.

    A DAQmx error is gRPC status UNKNOWN with its code in the trailing metadata (NI gRPC device server,
    source/server/converters.h).
    """

    def __init__(self, faults: Faults) -> None:
        self._faults = faults

    def intercept_service(self, continuation: Any, handler_call_details: Any) -> Any:
        handler = continuation(handler_call_details)
        if handler is None or handler.unary_unary is None:
            return handler
        name = str(handler_call_details.method).rpartition("/")[2]

        def call(request: object, context: Any) -> object:
            try:
                self._faults.strike(name)
                return handler.unary_unary(request, context)
            except DaqmxFailure as failure:
                context.set_trailing_metadata(_metadata(name, failure))
                context.abort(_GRPC.StatusCode.UNKNOWN, str(failure))
            except SessionExists as error:
                context.abort(
                    _GRPC.StatusCode.ALREADY_EXISTS, f"Cannot initialize '{error}' when a session already exists."
                )
            except SessionMissing as error:
                context.abort(
                    _GRPC.StatusCode.FAILED_PRECONDITION,
                    f"Cannot attach to '{error}' because it has not been initialized.",
                )
            except NotEmulated as error:
                context.abort(_GRPC.StatusCode.UNIMPLEMENTED, f"{error} is not emulated")
            except NotImplementedError:
                context.abort(_GRPC.StatusCode.UNIMPLEMENTED, f"{name} is not emulated")

        return _GRPC.unary_unary_rpc_method_handler(call, handler.request_deserializer, handler.response_serializer)


def _metadata(call: str, failure: DaqmxFailure) -> tuple[tuple[str, str], ...]:
    """The error code, and for reads and writes the number of samples per channel transferred before the error."""
    entries = [("ni-error", str(failure.code.value))]
    if call.startswith("Read"):
        # the samples of a failed read are lost: only a time-out returns those acquired
        entries.append(("ni-samps-per-chan-read", "0"))
    if call.startswith("Write"):
        entries.append(("ni-samps-per-chan-written", str(failure.samples_written)))
    return tuple(entries)


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
    """NI-DAQmx service; calls that are not defined here are UNIMPLEMENTED, as in the base class."""


class SessionUtilities(SessionUtilitiesServicer):
    """Handlers of EnumerateDevices and ResetServer."""

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
"""Maximum number of concurrent calls, including reads and writes that wait."""


class DaqServer:
    """Emulation of NI's gRPC device server with `devices`, whose inputs and output are wired to `plant`.

    `drive` is the analogue output that drives the plant and `enable_line` the digital line of its enable relay; the
    defaults are the first of each on the devices. `wires` replaces this wiring of the digital lines if lines other
    than the relay's are connected. `converter` produces the plant's counts. With `credentials`, connections are
    encrypted.
    `output_clock_error` is the relative error (positive: fast) of the rate of an output that does not follow the
    inputs' sample clock. The inputs' sample counter advances in steps of `packet`, as with packet transfer. Raises
    InvalidInput if the address is not available, or if the devices lack `drive` or `enable_line`.
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
        credentials: Any = None,
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
        # the generated types declare every call abstract; at run time undefined ones are UNIMPLEMENTED
        daqmx = NiDaqmx(self._driver)  # pyright: ignore[reportAbstractUsage]
        utilities = SessionUtilities(self._driver)  # pyright: ignore[reportAbstractUsage]
        add_NiDAQmxServicer_to_server(daqmx, self._server)
        add_SessionUtilitiesServicer_to_server(utilities, self._server)
        host = address.rpartition(":")[0]
        try:
            port = int(
                self._server.add_insecure_port(address)
                if credentials is None
                else self._server.add_secure_port(address, credentials)
            )
        except RuntimeError as error:
            self._pool.shutdown()
            raise InvalidInput("address", address, "it is already in use, or does not exist") from error
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
        """Start answering requests."""
        self._server.start()

    def close(self) -> None:
        """Stop the server, reset the devices, end all threads and free the port; may be called repeatedly."""
        self._faults.end()
        gone = self._server.stop(None)
        # also ends waiting reads and writes
        self._driver.reset()
        waiting.wait(gone)
        ending = threading.Thread(target=self._pool.shutdown, name="emulated-daq, closing")
        ending.start()
        waiting.join(ending)

    def fail_next(self, call: str, code: int) -> None:
        """Make the next call of this name, such as "StartTask", fail with a DAQmx code and without effect."""
        self._faults.fail_next(call, code)

    def stall(self, seconds: float) -> None:
        """Stall all calls for `seconds`, like a frozen machine; the devices continue."""
        self._faults.stall(seconds)

    def lose_network(self) -> None:
        """Simulate a lost connection between this server and its chassis; watchdogs configured to do so expire."""
        self._driver.lose_network()

    def vanish(self) -> None:
        """Disconnect at once, like a server whose cable is pulled; the devices continue until `close`."""
        waiting.wait(self._server.stop(None))

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _chosen(item: str, given: str | None, known: Sequence[str]) -> str | None:
    """The specified terminal, by default the first one; None if none is specified and none exists."""
    if given is None:
        return known[0] if known else None
    if given not in known:
        raise InvalidInput(item, given, f"available: {', '.join(known) or 'none'}")
    return given
