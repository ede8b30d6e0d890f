"""Encrypted connections to the device server, and plain ones that would leave the laboratory."""

import shutil
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import grpc
import pytest

from drivers.daqmx.connection import Connection, require_private
from drivers.daqmx.devices import find_devices
from drivers.daqmx.parameters import Tls
from drivers.emulation.daqmx.models import x_series
from drivers.emulation.daqmx.server import DaqServer
from drivers.errors import DeviceNotFound
from sim.errors import InvalidInput
from tests.drivers.daqmx.loopback import Loopback

OPENSSL = shutil.which("openssl")
pytestmark = pytest.mark.skipif(OPENSSL is None, reason="makes certificates with openssl")


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Self-signed certificates of a controller and of this PC."""
    folder = tmp_path_factory.mktemp("certs")
    for name in ("server", "client"):
        command = [
            *(str(OPENSSL), "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2"),
            *("-subj", f"/CN={name}.local", "-addext", f"subjectAltName=DNS:{name}.local"),
            *("-keyout", str(folder / f"{name}_key.pem"), "-out", str(folder / f"{name}.pem")),
        ]
        subprocess.run(command, check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def server(certificates: Path) -> Iterator[str]:
    """A server with mutual TLS."""
    key, chain, client = ((certificates / name).read_bytes() for name in ("server_key.pem", "server.pem", "client.pem"))
    required = grpc.ssl_server_credentials([(key, chain)], client, require_client_auth=True)
    served = DaqServer(Loopback(2000.0), (x_series(),), credentials=required)
    served.start()
    yield served.address
    served.close()


def tls(certificates: Path, **changes: str | None) -> Tls:
    given = {
        "root_certificate": str(certificates / "server.pem"),
        "client_certificate": str(certificates / "client.pem"),
        "client_key": str(certificates / "client_key.pem"),
        "server_name": "server.local",
    }
    return Tls.model_validate(given | changes)


def test_devices_are_found_over_mutual_tls(server: str, certificates: Path) -> None:
    assert [device.name for device in find_devices(server, tls(certificates))] == ["Dev1"]


@pytest.fixture
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """A refused client waits for its first answer in vain: for two seconds, were it not told to be less patient."""
    monkeypatch.setattr("drivers.daqmx.connection._READY", 0.5)


@pytest.mark.usefixtures("soon")
def test_a_plain_client_is_not_served(server: str) -> None:
    with pytest.raises(DeviceNotFound, match="no gRPC device server responds"):
        find_devices(server)


@pytest.mark.usefixtures("soon")
@pytest.mark.parametrize(
    "change",
    [
        {"client_certificate": None, "client_key": None},
        {"server_name": "other.local"},
        {"root_certificate": "client.pem"},
    ],
)
def test_a_client_whose_certificates_do_not_match_is_told_what_to_check(
    server: str, certificates: Path, change: dict[str, str | None]
) -> None:
    if (name := change.get("root_certificate")) is not None:
        change = {"root_certificate": str(certificates / name)}
    with pytest.raises(DeviceNotFound, match=r"check the certificates and hardware\.daq\.tls\.server_name"):
        find_devices(server, tls(certificates, **change))


def test_a_certificate_that_cannot_be_read_is_named(certificates: Path) -> None:
    with pytest.raises(InvalidInput, match=r"hardware\.daq\.tls\.root_certificate.*cannot be read"):
        Connection("127.0.0.1:1", 1.0, tls(certificates, root_certificate="nowhere.pem"))
    (certificates / "der.crt").write_bytes(b"\x30\x82")
    with pytest.raises(InvalidInput, match=r"not a PEM file"):
        Connection("127.0.0.1:1", 1.0, tls(certificates, root_certificate=str(certificates / "der.crt")))


def test_a_client_certificate_needs_its_key(certificates: Path) -> None:
    with pytest.raises(InvalidInput, match=r"client_key = None.*client_certificate and client_key"):
        Connection("127.0.0.1:1", 1.0, tls(certificates, client_key=None))


@pytest.mark.parametrize(
    ("address", "refused"),
    [
        ("8.8.8.8", True),
        ("2001:4860:4860::8888", True),
        ("127.0.0.1", False),
        ("10.1.2.3", False),
        ("192.168.7.2", False),
        ("169.254.3.4", False),
        ("fe80::1", False),
        ("fd00::5", False),
    ],
)
def test_a_plain_connection_stays_in_the_laboratory(
    address: str, refused: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    monkeypatch.setattr(
        "drivers.daqmx.connection.socket.getaddrinfo",
        lambda *_: [(family, socket.SOCK_STREAM, 6, "", (address, 0))],
    )
    if not refused:
        require_private("crio.example:31763")
        return
    with pytest.raises(InvalidInput, match=r"hardware\.daq\.plain_connection = true"):
        find_devices("crio.example:31763")
