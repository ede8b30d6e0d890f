"""Opening an emulated sensor that streams at another baud rate, and a reader that fails as no manual says."""

import time

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.emulation.optoncdt.laser import EmulatedLaser
from drivers.emulation.optoncdt.settings import Settings
from drivers.errors import ConnectionLost
from drivers.optoncdt.dialogue import CommandRefused
from drivers.optoncdt.sensor import SerialLaser
from sim.sensors import Laser
from tests.drivers.optoncdt.peer import Peer, no_thread_left
from tests.drivers.optoncdt.script import INFO, OPENED, STARTED, STOPPED, measurements
from tests.patience import LONG


class Still:
    def displacement(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.zeros(times.size)


def take_all(laser: SerialLaser) -> None:
    deadline = time.monotonic() + LONG
    while time.monotonic() < deadline:
        laser.wait(LONG)
        laser.take()


@pytest.mark.seconds
def test_a_sensor_that_streams_at_another_baud_rate_is_silenced_before_it_is_set_up() -> None:
    """What it hears at wrong baud rates spoils the first command that it understands."""
    as_found = Settings(output="RS422", rate=4000.0, additional=("COUNTER", "TIMESTAMP"), baud=691_200)
    with no_thread_left():
        emulated = EmulatedLaser(Still(), Laser(measuring_range=0.2), as_found=as_found, boot_time=0.0)
        emulated.split_words()
        emulated.start()
        try:
            with SerialLaser("laser_1", emulated.port, baud=None, rate=2000.0, measuring_range=0.2) as laser:
                assert laser.baud == 691_200
                assert emulated.settings.output == "NONE"
                assert emulated.settings.rate == 2000.0
        finally:
            emulated.close()


def test_the_first_command_may_be_refused() -> None:
    script = [(b"OUTPUT NONE", b"E210 Unknown command\r\n->"), *OPENED]
    with Peer(script) as peer, SerialLaser("laser_1", peer.path, baud=921_600, rate=4000.0, measuring_range=0.2):
        pass


def test_a_sensor_that_never_stops_streaming_is_refused() -> None:
    denied = (b"OUTPUT NONE", b"E202 Access denied\r\n->")
    with (
        Peer([denied, denied, denied, (b"GETINFO", INFO)]) as peer,
        pytest.raises(CommandRefused, match="refused OUTPUT NONE: E202 Access denied; select the professional"),
    ):
        SerialLaser("laser_1", peer.path, baud=921_600, rate=4000.0, measuring_range=0.2)


@pytest.mark.parametrize("error", [TypeError("'NoneType' object cannot be interpreted as an integer"), ValueError("x")])
def test_whatever_ends_the_reader_is_a_lost_connection(error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    """As the library fails when another thread has closed the port."""

    def fail(*_: object) -> None:
        raise error

    *before, (command, answer) = STARTED
    script = [*OPENED, *before, (command, answer + b"".join(measurements(range(30), 1))), *STOPPED]
    with no_thread_left(), Peer(script) as peer:
        laser = SerialLaser("laser_1", peer.path, baud=921_600, rate=4000.0, measuring_range=0.2)
        laser.start()
        monkeypatch.setattr("drivers.optoncdt.codec.Decoder.feed", fail)
        peer.send(b"".join(measurements(range(30), 31)))
        with pytest.raises(ConnectionLost, match=r"laser_1 on .* was disconnected .*reopen it"):
            take_all(laser)
        laser.close()
        peer.wait_heard(len(script))
