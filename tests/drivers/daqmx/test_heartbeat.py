"""The heartbeat line: it turns over once per block, and stands still and low whenever the run does."""

import time
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest

from drivers.daqmx.session import DaqSession
from drivers.emulation.daqmx.server import DaqServer
from drivers.emulation.safety_chain import PulseRelay
from drivers.errors import RigError
from tests.drivers.daqmx.conftest import RATE, OpenSession
from tests.drivers.daqmx.loopback import Loopback
from tests.drivers.daqmx.runs import BLOCK, driving, is_safe, started
from tests.drivers.daqmx.wired import Contacts, wired
from tests.patience import eventually

TIMEOUT = 0.5


@pytest.fixture
def contacts() -> Contacts:
    return Contacts(TIMEOUT)


@pytest.fixture
def server(plant: Loopback, contacts: Contacts) -> Iterator[DaqServer]:
    with wired(plant, contacts) as server:
        yield server


@pytest.fixture
def session(open_session: OpenSession) -> DaqSession:
    return open_session(heartbeat={})


def test_it_turns_over_once_per_block(session: DaqSession, contacts: Contacts) -> None:
    assert contacts.beats == [False]
    started(session, np.zeros(round(RATE)))
    # a rising edge with the enable line, a falling one with the start
    assert contacts.beats[-2:] == [True, False]
    begin = len(contacts.beats)
    for n in range(1, 7):
        session.write(np.zeros(BLOCK))
        session.read(BLOCK)
        assert len(contacts.beats) == begin + n
    assert all(one is not other for one, other in pairwise(contacts.beats[begin:]))
    assert contacts.relay.closed


def test_it_is_low_after_every_end(session: DaqSession, server: DaqServer, contacts: Contacts) -> None:
    def fails() -> None:
        server.fail_next("ReadBinaryI16", -200279)
        with pytest.raises(RigError):
            session.read(BLOCK)

    for end in (session.stop, fails, session.close):
        if contacts.beats[-1:] == [False]:
            session.stop()
        driving(session)
        if not contacts.beats[-1]:
            session.read(BLOCK)
        assert contacts.beats[-1] is True
        end()
        assert contacts.beats[-1] is False


def test_a_cut_ends_it_at_once(session: DaqSession, contacts: Contacts) -> None:
    driving(session)
    session.cut()
    given = list(contacts.beats)
    for _ in range(4):
        session.read(BLOCK)
    assert contacts.beats == given


@pytest.mark.milliseconds
@pytest.mark.seconds
def test_a_loop_that_hangs_loses_the_relay(session: DaqSession, contacts: Contacts) -> None:
    driving(session)
    assert contacts.relay.closed
    hung = time.monotonic()
    eventually(lambda: not contacts.relay.closed)
    assert time.monotonic() - hung < TIMEOUT + 0.3


def test_a_line_that_cannot_be_turned_over_ends_the_run(
    session: DaqSession, server: DaqServer, plant: Loopback
) -> None:
    driving(session)
    server.fail_next("WriteDigitalLines", -200077)
    with pytest.raises(RigError, match="toggling the heartbeat line"):
        session.read(BLOCK)
    assert not plant.enabled


@pytest.mark.parametrize("level", [True, False])
def test_a_level_that_stands_still_opens_the_relay(level: bool) -> None:
    relay = PulseRelay(0.05)
    assert not relay.closed
    relay.level(True)
    assert relay.closed
    relay.level(level)
    time.sleep(0.06)
    # it is told of the same level again and again
    relay.level(level)
    assert not relay.closed


def test_a_relay_that_has_opened_is_not_closed_again_during_the_motion(
    open_session: OpenSession, contacts: Contacts, plant: Loopback
) -> None:
    session = driving(open_session(heartbeat={"timeout": TIMEOUT}))
    while not contacts.beats[-1]:
        session.read(BLOCK)
    session.read(BLOCK)
    assert contacts.beats[-1] is False
    rising = contacts.beats.count(True)
    # the program is late, and the relay opens; there is drive enough for it
    time.sleep(TIMEOUT + 0.1)
    assert not contacts.relay.closed
    with pytest.raises(RigError, match="the heartbeat relay has opened: its line had no rising edge for"):
        session.read(BLOCK)
    assert contacts.beats.count(True) == rising
    eventually(lambda: is_safe(plant))
