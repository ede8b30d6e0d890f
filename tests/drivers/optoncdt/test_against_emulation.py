"""Driver and emulated sensor, each written from the manual alone, on one line in real time."""

import socket
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.emulation.optoncdt.laser import EmulatedLaser
from drivers.emulation.optoncdt.settings import Settings
from drivers.errors import ConnectionLost, DeviceNotFound
from drivers.optoncdt.codec import LASER_OFF, OTHER, marked
from drivers.optoncdt.search import find_lasers
from drivers.optoncdt.sensor import SerialLaser
from drivers.optoncdt.stream import Readings
from sim.sensors import Laser
from tests.drivers.optoncdt.peer import no_thread_left
from tests.drivers.optoncdt.script import joined
from tests.patience import LONG

PLACE = 0.030
"""Where the target stands, from mid range [m]."""
FOUND = Settings(output="RS422", rate=2000.0, average=8, hold=100.0, echo=True, baud=1_000_000)
"""As somebody else has left it."""


class Still:
    def displacement(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.full(times.size, PLACE)


@pytest.fixture
def emulated() -> Iterator[EmulatedLaser]:
    laser = Laser(measuring_range=0.2, noise=0.0, linearity=0.0, clock_error=0.0)
    with no_thread_left():
        sensor = EmulatedLaser(Still(), laser, as_found=FOUND, boot_time=0.0)
        sensor.start()
        yield sensor
        sensor.close()


@pytest.fixture
def on_network() -> Iterator[EmulatedLaser]:
    laser = Laser(measuring_range=0.2, noise=0.0, linearity=0.0, clock_error=0.0)
    with no_thread_left():
        sensor = EmulatedLaser(Still(), laser, as_found=FOUND, boot_time=0.0, network=True)
        sensor.start()
        yield sensor
        sensor.close()


def test_a_sensor_on_a_network_port_is_found_and_read_and_its_loss_reported(on_network: EmulatedLaser) -> None:
    (found,) = find_lasers([on_network.port])
    assert found.problem is None
    with SerialLaser("laser_1", on_network.port, baud=None, rate=1000.0, measuring_range=0.2) as laser:
        for _ in range(2):
            laser.start()
            got = taken_until(laser, lambda got: len(got) > 500)
            laser.stop()
            np.testing.assert_allclose(marked(got.code) * (1.02 * 0.2 / 65520), PLACE, atol=2e-6)
            assert (np.diff(got.index) == 1).all()
        laser.start()
        on_network.unplug()
        with pytest.raises(ConnectionLost):
            taken_until(laser, lambda _: False)
    assert on_network.dropped == 0


def test_a_network_port_without_a_server_is_named() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = f"socket://127.0.0.1:{server.getsockname()[1]}"
    with pytest.raises(DeviceNotFound, match=f"laser_1 cannot be opened: {port} does not respond"):
        SerialLaser("laser_1", port, baud=None, rate=1000.0, measuring_range=0.2)


def taken_until(laser: SerialLaser, enough: Callable[[Readings], bool]) -> Readings:
    """Everything that comes until there is enough."""
    taken = [laser.take()]
    deadline = time.monotonic() + LONG
    while not enough(joined(taken)):
        assert time.monotonic() < deadline
        laser.wait(0.1)
        taken.append(laser.take())
    return joined(taken)


def test_a_sensor_is_found_as_it_is_and_read(emulated: EmulatedLaser) -> None:
    (found,) = find_lasers([emulated.port])
    assert found.problem is None
    assert found.baud == 1_000_000
    assert emulated.settings == FOUND
    with SerialLaser("laser_1", emulated.port, baud=None, rate=1000.0, measuring_range=0.2) as laser:
        laser.start()
        got = taken_until(laser, lambda got: len(got) > 100)
        np.testing.assert_allclose(marked(got.code) * (1.02 * 0.2 / 65520), PLACE, atol=2e-6)
        assert (np.diff(got.index) == 1).all()
        np.testing.assert_allclose(np.diff(got.time), 1e-3, atol=1.1e-5)
        # no value arrives before it was taken
        assert (got.arrival > emulated.epoch + got.time).all()

        laser.laser(False)
        taken_until(laser, lambda got: LASER_OFF in marked(got.code))
        laser.laser(True)
        seen = taken_until(laser, lambda got: len(got) > 0 and marked(got.code[-1:])[0] > OTHER)

        emulated.lose_bytes(40)
        taken_until(laser, lambda got: len(got) > 0 and got.index[-1] - seen.index[-1] > len(got))
        emulated.unplug()
        with pytest.raises(ConnectionLost):
            taken_until(laser, lambda _: False)
    assert not emulated.settings.echo
