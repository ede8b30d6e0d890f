"""Nobody there: said quickly, and with what to do about it."""

import contextlib
import ctypes.util
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

from drivers.daqmx.devices import find_devices
from drivers.daqmx.parameters import AnalogInput, Daq
from drivers.daqmx.session import DaqSession
from drivers.errors import DeviceNotFound
from sim.errors import InvalidInput

without_driver = pytest.mark.skipif(
    sys.platform == "win32" or ctypes.util.find_library("nidaqmx") is not None, reason="this PC may have the driver"
)


@contextlib.contextmanager
def mute_server() -> Iterator[str]:
    """Takes connections and never says a word."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield f"127.0.0.1:{listener.getsockname()[1]}"


@contextlib.contextmanager
def nobody() -> Iterator[str]:
    """A port on which nothing listens."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        yield f"127.0.0.1:{taken.getsockname()[1]}"


def open_session(server: str | None) -> object:
    return DaqSession(Daq(server=server), [AnalogInput()], 2000.0, 100)


@pytest.mark.seconds
@pytest.mark.parametrize(("server", "use"), [(mute_server, open_session), (nobody, find_devices)])
def test_a_server_that_does_not_answer_is_not_waited_for(
    server: Callable[[], contextlib.AbstractContextManager[str]], use: Callable[[str], object]
) -> None:
    with server() as address:
        begin = time.monotonic()
        with pytest.raises(DeviceNotFound) as caught:
            use(address)
        assert time.monotonic() - begin < 10.0
    for said in (address, "ni_grpc_device_server", "31763", '"address": "[::]"', "server_config.json"):
        assert said in str(caught.value)


@pytest.mark.parametrize("address", ["crio", "crio:", "crio:port"])
def test_an_address_needs_a_port(address: str) -> None:
    with pytest.raises(InvalidInput, match=r"hardware\.daq\.server.*host:port"):
        find_devices(address)


@without_driver
@pytest.mark.parametrize("use", [open_session, find_devices])
def test_a_pc_without_driver_says_so(use: Callable[[None], object]) -> None:
    with pytest.raises(DeviceNotFound, match="install NI-DAQmx"):
        use(None)


def test_the_driver_of_this_pc_needs_no_grpc() -> None:
    code = "import sys, drivers.daqmx.session, drivers.daqmx.devices; sys.exit('grpc' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_description_of_the_wiring_needs_no_driver() -> None:
    code = "import sys, drivers.daqmx.parameters; sys.exit('nidaqmx' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
