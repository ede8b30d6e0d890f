"""Connection to the driver: on this PC, or on a controller behind a gRPC device server.

Connections to a server can be encrypted with TLS, or with mutual TLS if a client certificate is configured. NI's server
supports no other credentials (wiki of grpc-device, "Server Security Support").
"""

import socket
import threading
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, cast

from nidaqmx.grpc_session_options import GrpcSessionOptions, SessionInitializationBehavior

from drivers.daqmx.library import Options
from drivers.errors import DeviceNotFound
from sim import waiting
from sim.errors import InvalidInput

if TYPE_CHECKING:
    # a process of its own that connects to the server needs no models, which are slow to import
    from drivers.daqmx.parameters import Daq, Tls

_REMEDY = (
    "it is neither this computer nor in a private network, and others could intercept a plain connection and drive the"
    " shaker: set hardware.daq.tls with the server's certificate, or hardware.daq.plain_connection = true"
)


def require_private(server: str) -> None:
    """Raise InvalidInput for a server outside loopback, link-local and private networks. A name that cannot be resolved
    is accepted, since no connection to it is possible.
    """
    host = server.rpartition(":")[0].strip("[]")
    try:
        found = socket.getaddrinfo(host, None)
    except (OSError, UnicodeError):
        return
    for *_, place in found:
        # an IPv6 address may end with a zone
        if ip_address(str(place[0]).partition("%")[0]).is_global:
            raise InvalidInput("hardware.daq.server", server, _REMEDY)


def credentials(tls: "Tls") -> Any:
    """Credentials of a gRPC channel. Raises InvalidInput for a file that cannot be read or is not a PEM file, and for a
    certificate without key or a key without certificate.
    """
    import grpc

    if (tls.client_certificate is None) != (tls.client_key is None):
        item = "hardware.daq.tls.client_key"
        raise InvalidInput(item, tls.client_key, "specify both client_certificate and client_key, or neither")
    names = ("root_certificate", "client_key", "client_certificate")
    given = {name: _content(name, getattr(tls, name)) for name in names}
    return cast(Any, grpc).ssl_channel_credentials(
        given["root_certificate"], given["client_key"], given["client_certificate"]
    )


def _content(name: str, path: str | None) -> bytes | None:
    if path is None:
        return None
    item = f"hardware.daq.tls.{name}"
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise InvalidInput(
            item, path, f"the file cannot be read ({error.strerror}); check its path and permissions"
        ) from None
    if b"-----BEGIN " not in content:
        raise InvalidInput(item, path, "the file is not a PEM file: convert it with `openssl x509` or `openssl pkey`")
    return content


_READY = 2.0
"""Time-out for a server's first answer [s]."""
_ENCRYPTED = ", and for TLS server_cert and server_key; check the certificates and hardware.daq.tls.server_name"
_PORT = 31763
"""Default port of NI gRPC Device Server (its README)."""


class Connection:
    """Connection to the driver of this PC or of a server; it provides the options with which tasks are created there.

    `patience` [s] is the time allowed for a call beyond its own time-out. The connection is encrypted if `tls` is
    given. `plain` permits an unencrypted connection to a server outside private networks. Raises DeviceNotFound if no
    server answers within 2 s, and InvalidInput for an address without a port, for a plain connection to a public
    network, or for certificates that cannot be read.
    """

    def __init__(self, server: str | None, patience: float, tls: "Tls | None" = None, *, plain: bool = False) -> None:
        self.server = server
        self._deadline: Any = None
        self._channel: Any = None
        self._calls: Any = None
        if server is not None:
            self._connect(server, patience, tls, plain=plain)

    @classmethod
    def of(cls, daq: "Daq") -> Self:
        """The connection that the parameters describe."""
        return cls(daq.server, daq.timeout_margin, daq.tls, plain=daq.plain_connection)

    @property
    def late(self) -> bool:
        """Whether any call has timed out; the state of the server's tasks is then unknown."""
        return self._deadline is not None and bool(self._deadline.late)

    def options(self, name: str = "") -> Options:
        """Options for creating a task of this name, under which later processes can find it."""
        return self._session(name, SessionInitializationBehavior.INITIALIZE_SERVER_SESSION)

    def attaching(self, name: str) -> Options:
        """Options for attaching to an existing task of this name on the server."""
        return self._session(name, SessionInitializationBehavior.ATTACH_TO_SERVER_SESSION)

    def close(self) -> None:
        """Disconnect from the server; may be called repeatedly."""
        if self._channel is not None:
            self._channel.close()

    def _session(self, name: str, behavior: SessionInitializationBehavior) -> Options:
        if self._calls is None:
            return None
        return GrpcSessionOptions(self._calls, name, initialization_behavior=behavior)

    def _connect(self, server: str, patience: float, tls: "Tls | None", *, plain: bool) -> None:
        if not server.rpartition(":")[2].isdigit():
            raise InvalidInput("hardware.daq.server", server, f"it must be host:port, such as crio.local:{_PORT}")
        if tls is None and not plain:
            require_private(server)
        # a PC with a local driver does not need gRPC, which is slow to import
        import grpc

        from drivers.daqmx.deadline import Deadline, ReusedCalls

        gone = round(1000.0 * max(1.0, patience / 2.0))
        channel_options: list[tuple[str, int | str]] = [
            ("grpc.max_receive_message_length", -1),
            ("grpc.max_send_message_length", -1),
            # do not use the internet proxy for a device in the laboratory
            ("grpc.enable_http_proxy", 0),
            # at most two pings per call: servers disconnect clients that ping too often
            ("grpc.keepalive_time_ms", gone),
            ("grpc.keepalive_timeout_ms", gone),
            # otherwise a frozen machine is detected only after a minute
            ("grpc.http2.ping_timeout_ms", gone),
        ]
        library = cast(Any, grpc)
        if tls is None:
            self._channel = library.insecure_channel(server, options=channel_options)
        else:
            if tls.server_name is not None:
                channel_options.append(("grpc.ssl_target_name_override", tls.server_name))
            self._channel = library.secure_channel(server, credentials(tls), options=channel_options)
        ready = library.channel_ready_future(self._channel)
        settled = threading.Event()

        def settle(_: object) -> None:
            settled.set()

        ready.add_done_callback(settle)
        try:
            waiting.wait(settled, _READY)
            ready.result(timeout=0.0)
        except library.FutureTimeoutError as error:
            ready.cancel()
            self._channel.close()
            raise DeviceNotFound(
                f"no gRPC device server responds at {server}: start ni_grpc_device_server there and check the port"
                f" ({_PORT} unless changed); for connections from another machine, set"
                ' "address": "[::]" in its server_config.json'
                f"{_ENCRYPTED if tls is not None else ''}"
            ) from error
        except BaseException:
            ready.cancel()
            self._channel.close()
            raise
        self._deadline = Deadline(patience)
        self._calls = ReusedCalls(self._channel, self._deadline)
