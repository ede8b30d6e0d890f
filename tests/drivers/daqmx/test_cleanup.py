"""Clients that died, clients that live, and what the next one finds."""

import threading
from collections.abc import Iterator

import numpy as np
import pytest

from drivers.daqmx.session import DaqSession
from drivers.emulation.daqmx.server import DaqServer
from drivers.errors import ConnectionLost, DeviceNotFound, RigError
from drivers.timebase.marking import golden_pulses
from tests.drivers.daqmx.conftest import RATE, OpenSession
from tests.drivers.daqmx.loopback import Loopback
from tests.drivers.daqmx.runs import BLOCK, driving, is_safe, started
from tests.drivers.daqmx.wire import Wire
from tests.patience import eventually


@pytest.fixture
def doomed(server: DaqServer) -> Iterator[Wire]:
    """A cable that can be pulled."""
    wire = Wire(server.address)
    yield wire
    wire.close()


@pytest.mark.parametrize("playing", [True, False])
def test_what_a_dead_client_left_is_cleared(
    open_session: OpenSession, plant: Loopback, doomed: Wire, playing: bool
) -> None:
    dead = open_session(server=doomed.address, laser_marker="Dev1/ctr0", pulses=golden_pulses(4000.0))
    if playing:
        driving(dead)
    else:
        dead.prepare()
    doomed.pull()
    assert plant.enabled
    session = open_session()
    left = session.description["tasks left by another client"]
    assert left == "rockbench_enable, rockbench_out, rockbench_in, rockbench_marker"
    eventually(lambda: is_safe(plant))
    assert len(started(session).read(BLOCK)) == BLOCK


def test_a_dead_client_whose_output_ran_dry_is_cleared_too(
    open_session: OpenSession, plant: Loopback, doomed: Wire
) -> None:
    dead = started(open_session(server=doomed.address), np.full(200, 3.0))
    dead.read(BLOCK)
    doomed.pull()
    begin = plant.tick()
    eventually(lambda: plant.tick() > begin + 0.2 * RATE)
    # it holds its last value
    assert plant.present_output() == 3.0
    open_session()
    eventually(lambda: is_safe(plant))


def test_a_client_that_is_driving_is_left_alone(open_session: OpenSession, plant: Loopback) -> None:
    first = driving(open_session())
    refused: list[DaqSession | RigError] = []

    def second() -> None:
        try:
            refused.append(open_session())
        except RigError as error:
            refused.append(error)

    other = threading.Thread(target=second)
    other.start()
    while other.is_alive():
        first.write(np.full(BLOCK, 3.0))
        first.read(BLOCK)
    other.join()
    assert isinstance(refused[0], DeviceNotFound)
    assert "another client drives the shaker" in str(refused[0])
    assert plant.enabled
    assert len(first.read(BLOCK)) == BLOCK


def test_a_client_that_is_idle_loses_the_device_and_is_told(open_session: OpenSession, plant: Loopback) -> None:
    first = open_session()
    driving(first).stop()
    second = driving(open_session())
    with pytest.raises(ConnectionLost, match="another client has taken the device"):
        first.prepare()
    first.close()
    # a server knows tasks by name only: the first has not touched those of the second
    assert plant.enabled
    second.write(np.zeros(BLOCK))
    assert len(second.read(BLOCK)) == BLOCK


def test_a_client_that_has_lost_the_device_to_nobody_is_told_too(open_session: OpenSession) -> None:
    first = open_session(watchdog=1.0)
    open_session(watchdog=1.0).close()
    with pytest.raises(ConnectionLost, match="another client has taken the device"):
        first.prepare()
    first.close()
