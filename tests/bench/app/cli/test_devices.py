"""`rockbench devices` on emulated instruments that speak the real protocols."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.app.cli.main import main
from drivers.daqmx import devices
from drivers.emulation.daqmx.models import compact_rio, x_series
from drivers.emulation.daqmx.server import DaqServer
from drivers.emulation.optoncdt.laser import EmulatedLaser
from drivers.errors import DeviceNotFound
from drivers.optoncdt import search
from drivers.optoncdt.search import open_port
from sim.sensors import Laser
from tests.drivers.daqmx.loopback import Loopback

Said = pytest.CaptureFixture[str]


class Wall:
    """Stands still in mid range."""

    def displacement(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.zeros_like(times)


@pytest.fixture
def server() -> Iterator[str]:
    with DaqServer(Loopback(2000.0), [x_series(), *compact_rio(simulated=True)]) as running:
        yield running.address


@pytest.fixture
def laser() -> Iterator[EmulatedLaser]:
    if sys.platform == "win32":
        pytest.skip("Windows has no pseudo-terminals")
    sensor = EmulatedLaser(Wall(), Laser(measuring_range=0.2), serial="42")
    sensor.start()
    yield sensor
    sensor.close()


@pytest.fixture
def _no_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "listed_ports", list)


@pytest.mark.usefixtures("_no_ports")
def test_devices_of_a_server_are_listed_with_channels_and_ranges(server: str, capsys: Said) -> None:
    assert main(["devices", "--server", server]) == 0
    text = capsys.readouterr().out
    assert f"the server at {server}" in text
    assert (
        "  Dev1: USB-6363, serial number 01C0FFEE\n    inputs: Dev1/ai0 to Dev1/ai31 (32); ranges -10 .. 10 V" in text
    )
    assert "    outputs: Dev1/ao0, Dev1/ao1, Dev1/ao2, Dev1/ao3; ranges -10 .. 10 V, -5 .. 5 V" in text
    assert "cRIO1Mod1" in text
    assert "simulated" in text
    assert "none: plug in the laser adapters" in text


def test_lasers_are_named_and_other_ports_say_why_not(server: str, laser: EmulatedLaser, capsys: Said) -> None:
    ports = ("--port", laser.port, "--port", "/dev/nothing")
    assert main(["devices", "--server", server, *ports]) == 0
    text = capsys.readouterr().out
    assert f"  {laser.port}: ILD1420-200, 200 mm, serial number 42, firmware " in text
    assert "921600 baud" in text
    assert "there is no port /dev/nothing" in text


def test_a_port_that_is_held_is_busy(laser: EmulatedLaser, server: str, capsys: Said) -> None:
    with open_port("me", laser.port, 921_600):
        assert main(["devices", "--server", server, "--port", laser.port]) == 0
    assert "is in use; close the program that holds it" in capsys.readouterr().out


def test_json_holds_the_same(server: str, laser: EmulatedLaser, capsys: Said) -> None:
    assert main(["devices", "--server", server, "--port", laser.port, "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["server"] == server
    assert content["reason"] is None
    first = content["devices"][0]
    assert (first["product"], first["simulated"], len(first["inputs"])) == ("USB-6363", False, 32)
    (port,) = content["ports"]
    assert (port["baud"], port["problem"]) == (921_600, None)
    assert (port["info"]["serial"], port["info"]["measuring_range"]) == ("42", 0.2)


def test_a_configuration_names_server_and_ports(
    server: str, laser: EmulatedLaser, tmp_path: Path, capsys: Said
) -> None:
    file = tmp_path / "bench.toml"
    file.write_text(
        f'[hardware.daq]\nserver = "{server}"\n[hardware.laser_2]\nport = "{laser.port}"\n', encoding="utf-8"
    )
    assert main(["devices", "--config", str(file), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["server"] == server
    assert [port["port"] for port in content["ports"]] == [laser.port]


@pytest.mark.usefixtures("_no_ports")
def test_a_pc_without_driver_is_told_the_remedy(capsys: Said) -> None:
    if not _without_driver():
        pytest.skip("this PC has the NI-DAQmx driver")
    assert main(["devices"]) == 0
    text = capsys.readouterr().out
    assert "there is no NI-DAQmx driver on this PC; install NI-DAQmx, or" in text
    assert main(["devices", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert (content["devices"], content["ports"]) == ([], [])
    assert "no NI-DAQmx driver" in content["reason"]


def _without_driver() -> bool:
    try:
        devices.find_devices(None)
    except DeviceNotFound:
        return True
    return False


@pytest.mark.usefixtures("_no_ports")
def test_a_server_that_is_not_there_is_a_result(capsys: Said) -> None:
    assert main(["devices", "--server", "127.0.0.1:9"]) == 0
    assert "no gRPC device server responds at 127.0.0.1:9" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (("--server", "nowhere"), ("'nowhere'", "host:port")),
        (("--config", "absent.toml"), ("there is no such file",)),
        (("--baud", "9600"), ("--baud",)),
    ],
)
def test_what_cannot_be_meant_is_refused(flags: tuple[str, ...], words: tuple[str, ...], capsys: Said) -> None:
    assert main(["devices", *flags]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    for word in words:
        assert word in captured.err
