"""The safety inputs are told as they are now: while the table moves, and while a person works at the bench."""

import threading
import time
from collections.abc import Generator, Mapping
from multiprocessing import Pipe
from typing import cast

import numpy as np
import pytest

from bench.analysis.signals import SIGNALS
from bench.app.ipc.messages import Answer, Question, SafetyInputs
from bench.app.ipc.server import PERIOD, Publisher, RemoteOperator, SessionServer
from bench.engine.interface import Requests
from bench.events import Acquired, State, StateChanged
from drivers.rig import Block, Rig, RigError
from tests.patience import LONG


class Wired:
    """The part of a rig that is asked; it counts."""

    channels = ()
    sample_rate = 1000.0
    description: Mapping[str, str] = {}

    def __init__(self) -> None:
        self.asked = 0
        self.threads: set[str] = set()
        self.good = True
        self.fails = False

    def interlocks(self) -> Mapping[str, bool]:
        self.asked += 1
        self.threads.add(threading.current_thread().name)
        if self.fails:
            raise RigError("the device is gone: check power and cables")
        return {"emergency stop": self.good}


@pytest.fixture
def host() -> Generator[SessionServer, None, None]:
    here, there = Pipe()
    yield SessionServer(there, Requests(), lambda _why: None)
    here.close()


@pytest.fixture
def rig() -> Wired:
    return Wired()


@pytest.fixture
def teller(host: SessionServer, rig: Wired) -> Publisher:
    told = Publisher(host)
    told.opened(cast(Rig, rig), told)
    return told


def _block(second: float) -> Acquired:
    return Acquired(
        1, Block(0, np.zeros((10, 0), dtype=np.int16)), np.zeros(10), np.zeros((10, len(SIGNALS))), time=second
    )


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The machine's clock, as the looks see it."""
    seconds = [1000.0]
    monkeypatch.setattr("bench.app.ipc.server.now", lambda: seconds[0])
    return seconds


def test_blocks_ask_twice_a_second_and_a_change_of_state_at_once(
    clock: list[float], rig: Wired, teller: Publisher
) -> None:
    clock[0] += 10.0
    for block in range(100):
        clock[0] += 0.1
        teller(_block(0.1 * block))
    # ten seconds of blocks, and the look when the rig was opened
    assert rig.asked - 1 == pytest.approx(10.0 / PERIOD, abs=1)
    before = rig.asked
    teller(StateChanged(State.RUNNING, State.STOPPING, "over", time=10.0))
    assert rig.asked == before + 1


def test_inputs_that_cannot_be_read_end_what_is_driven_with_their_own_reason(
    clock: list[float], rig: Wired, teller: Publisher
) -> None:
    rig.fails = True
    clock[0] += 1.0
    with pytest.raises(RigError, match="the device is gone"):
        teller(_block(1.0))
    # what is told of a state does not end anything
    teller(StateChanged(State.RUNNING, State.HALTED, "the device is gone", time=2.0))


@pytest.mark.usefixtures("teller")
def test_they_are_told_while_a_question_stands_from_the_thread_of_the_engine(host: SessionServer, rig: Wired) -> None:
    sent: list[object] = []
    host.broadcast.put = lambda message, **_how: sent.append(message)  # type: ignore[method-assign]
    answers: list[bool] = []
    asking = RemoteOperator(host, Requests())
    engine = threading.Thread(target=lambda: answers.append(asking.confirm("Clamp the table.")), name="engine")
    rig.threads.clear()
    engine.start()
    end = time.monotonic() + LONG
    while sum(isinstance(message, SafetyInputs) for message in sent) < 2:
        assert time.monotonic() < end
        time.sleep(0.02)
        rig.good = False
    host.answers.put(Answer(1, True))
    engine.join(LONG)
    assert answers == [True]
    assert rig.threads == {"engine"}
    assert isinstance(sent[0], Question)
    told = [message for message in sent if isinstance(message, SafetyInputs)]
    assert told[-1].good == {"emergency stop": False}
