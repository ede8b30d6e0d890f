"""Encryption of the connection to a gRPC device server, as offered by the server: TLS, and mutual TLS with a client
certificate (wiki of NI's grpc-device, "Server Security Support"). The server supports no other credentials.
"""

import socket
from ipaddress import ip_address
from pathlib import Path
from typing import Any, cast

from drivers.daqmx.parameters import Tls
from sim.errors import InvalidInput

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
        # a zone may follow an IPv6 address
        if ip_address(str(place[0]).partition("%")[0]).is_global:
            raise InvalidInput("hardware.daq.server", server, _REMEDY)


def credentials(tls: Tls) -> Any:
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
        raise InvalidInput(item, path, f"the file cannot be read: {error.strerror}") from None
    if b"-----BEGIN " not in content:
        raise InvalidInput(item, path, "the file is not a PEM file: convert it with `openssl x509` or `openssl pkey`")
    return content
