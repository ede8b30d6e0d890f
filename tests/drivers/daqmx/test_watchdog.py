"""A program that no longer says that all is well loses the enable relay."""

import numpy as np
import pytest

from drivers.daqmx.session import DaqSession
from drivers.emulation.daqmx.server import DaqServer
from drivers.errors import ConnectionLost, RigError
from sim.errors import InvalidInput
from tests.drivers.daqmx.conftest import RATE, OpenSession
from tests.drivers.daqmx.loopback import Loopback
from tests.drivers.daqmx.runs import BLOCK, driving, is_safe
from tests.patience import eventually

TIMEOUT = 1.0


@pytest.fixture
def session(open_session: OpenSession) -> DaqSession:
    return open_session(watchdog=TIMEOUT)


def test_a_run_keeps_the_watchdog_quiet(session: DaqSession, plant: Loopback) -> None:
    driving(session)
    # one and a half time-outs
    for _ in range(30):
        session.write(np.full(BLOCK, 3.0))
        session.read(BLOCK)
        assert plant.enabled
    session.stop()
    eventually(lambda: is_safe(plant))


def test_a_program_that_hangs_loses_the_relay(session: DaqSession, plant: Loopback) -> None:
    driving(session)
    eventually(lambda: not plant.enabled)
    with pytest.raises(RigError) as caught:
        session.write(np.zeros(BLOCK))
    assert caught.value.code == -200644
    eventually(lambda: is_safe(plant))
    # nothing is resumed by itself; the next run is
    session.stop()
    driving(session)
    assert plant.enabled
    session.stop()
    eventually(lambda: is_safe(plant))


def test_a_relay_that_the_watchdog_has_opened_counts_as_cut(session: DaqSession, plant: Loopback) -> None:
    driving(session)
    eventually(lambda: not plant.enabled)
    assert session.cut() is True


def test_a_watchdog_that_has_barked_keeps_the_relay_open_as_long_as_the_output_is_not_at_zero(
    session: DaqSession, server: DaqServer, plant: Loopback
) -> None:
    driving(session)
    eventually(lambda: not plant.enabled)
    plant.ever_enabled = False
    server.fail_next("WriteAnalogF64", -200077)
    with pytest.raises(RigError, match="setting the output to 0 V"):
        session.stop()
    assert not plant.ever_enabled
    # what was left to do is done before the next run
    driving(session)
    assert plant.enabled


def test_a_relay_that_could_not_be_opened_is_opened_by_the_watchdog(
    session: DaqSession, server: DaqServer, plant: Loopback
) -> None:
    driving(session)
    server.fail_next("WriteDigitalLines", -200077)
    with pytest.raises(RigError, match="press the emergency stop"):
        session.stop()
    eventually(lambda: is_safe(plant))


def test_a_session_that_could_not_open_the_relay_is_not_closed_before_the_watchdog_has(
    session: DaqSession, server: DaqServer, plant: Loopback
) -> None:
    driving(session)
    for _ in range(4):
        server.fail_next("WriteDigitalLines", -200077)
    with pytest.raises(RigError, match="press the emergency stop"):
        session.stop()
    with pytest.raises(RigError, match="press the emergency stop"):
        session.close()
    assert not plant.enabled


def test_a_cut_ends_the_telling(session: DaqSession, server: DaqServer, plant: Loopback) -> None:
    driving(session)
    assert session.cut() is True
    # it would fail if it were told
    server.fail_next("ControlWatchdogTask", -200077)
    begin = plant.tick()
    while plant.tick() < begin + 1.5 * TIMEOUT * RATE:
        session.write(np.zeros(BLOCK))
        session.read(BLOCK)
    assert not plant.enabled


def test_a_device_that_is_gone_is_let_go(open_session: OpenSession, server: DaqServer) -> None:
    session = driving(open_session(watchdog=5.0))
    server.vanish()
    with pytest.raises(ConnectionLost):
        session.read(BLOCK)
    with pytest.raises(ConnectionLost):
        session.close()


@pytest.mark.parametrize("call", ["CfgWatchdogDOExpirStates", "CreateAIVoltageChan"])
def test_a_session_that_fails_to_open_leaves_no_watchdog(
    server: DaqServer, open_session: OpenSession, call: str
) -> None:
    server.fail_next(call, -200077)
    with pytest.raises(RigError):
        open_session(watchdog=TIMEOUT)
    assert open_session(watchdog=TIMEOUT).description["tasks left by another client"] == "none"


@pytest.mark.parametrize("code", [-200662, -200668])
def test_a_watchdog_that_the_device_refuses_is_refused_by_name(
    server: DaqServer, open_session: OpenSession, code: int
) -> None:
    server.fail_next("CreateWatchdogTimerTaskEx", code)
    with pytest.raises(InvalidInput) as caught:
        open_session(watchdog=TIMEOUT)
    assert caught.value.item == "hardware.daq.watchdog"
