"""The way to the driver: on this PC, or on a controller behind a gRPC device server."""

from typing import Any, cast

from nidaqmx.grpc_session_options import GrpcSessionOptions, SessionInitializationBehavior

from drivers.daqmx.library import Options
from drivers.errors import DeviceNotFound
from sim.errors import InvalidInput

_READY = 2.0
"""Time for a server to answer at all [s]."""
_PORT = 31763
"""Port on which NI gRPC Device Server listens unless told otherwise (its README)."""


class Connection:
    """Where tasks are made. Only the options that it hands out differ between this PC and a server.

    Raises DeviceNotFound when no server answers within 2 s, InvalidInput for an address without port.
    """

    def __init__(self, server: str | None, patience: float) -> None:
        self.server = server
        self._deadline: Any = None
        self._channel: Any = None
        self._calls: Any = None
        if server is not None:
            self._connect(server, patience)

    @property
    def late(self) -> bool:
        """Whether the server once did not answer in time: nothing is known of its tasks since."""
        return self._deadline is not None and bool(self._deadline.late)

    def options(self, name: str = "") -> Options:
        """To make a new task of this name, to be found by whoever comes after this process; and only a new one."""
        return self._session(name, SessionInitializationBehavior.INITIALIZE_SERVER_SESSION)

    def attaching(self, name: str) -> Options:
        """To take hold of a task of this name that is on the server already."""
        return self._session(name, SessionInitializationBehavior.ATTACH_TO_SERVER_SESSION)

    def close(self) -> None:
        """Let go of the server; allowed any number of times."""
        if self._channel is not None:
            self._channel.close()

    def _session(self, name: str, behavior: SessionInitializationBehavior) -> Options:
        if self._calls is None:
            return None
        return GrpcSessionOptions(self._calls, name, initialization_behavior=behavior)

    def _connect(self, server: str, patience: float) -> None:
        if not server.rpartition(":")[2].isdigit():
            raise InvalidInput("hardware.daq.server", server, f"it must be host:port, such as crio.local:{_PORT}")
        # the PC of a driver of its own has no use for gRPC, which takes half a second to import
        import grpc

        from drivers.daqmx.deadline import Deadline

        gone = round(1000.0 * max(1.0, patience / 2.0))
        channel_options = [
            ("grpc.max_receive_message_length", -1),
            ("grpc.max_send_message_length", -1),
            # a device stands in the laboratory, not behind the proxy to the internet
            ("grpc.enable_http_proxy", 0),
            # at most two pings in a call: servers hang up on a client that pings too often
            ("grpc.keepalive_time_ms", gone),
            ("grpc.keepalive_timeout_ms", gone),
            # without it, a frozen machine is noticed after a minute only
            ("grpc.http2.ping_timeout_ms", gone),
        ]
        library = cast(Any, grpc)
        self._channel = library.insecure_channel(server, options=channel_options)
        ready = library.channel_ready_future(self._channel)
        try:
            ready.result(timeout=_READY)
        except library.FutureTimeoutError as error:
            ready.cancel()
            self._channel.close()
            raise DeviceNotFound(
                f"no gRPC device server answers at {server}: start ni_grpc_device_server there and check the port"
                f" ({_PORT} unless changed); to be reached from another machine it needs"
                ' "address": "[::]" in its server_config.json'
            ) from error
        except BaseException:
            ready.cancel()
            self._channel.close()
            raise
        self._deadline = Deadline(patience)
        self._calls = library.intercept_channel(self._channel, self._deadline)
