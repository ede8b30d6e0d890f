"""A run in virtual time waits for a client that gets no processor time; one in real time cannot."""

import threading
from collections.abc import Generator
from multiprocessing import Pipe
from pathlib import Path

import pytest

from bench.app.ipc.messages import SILENCE, Run
from bench.app.ipc.server import SessionServer
from bench.engine.interface import Requests
from tests.bench.app.ipc.experiment import SHAKING, ShakingParameters, bench
from tests.patience import LONG


class Served:
    """A session with its engine's thread, which publishes one block after the other."""

    def __init__(self, *, virtual: bool) -> None:
        self.client, there = Pipe()
        self.requests, self.lost = Requests(), list[str]()
        self.server = SessionServer(there, self.requests, self.lost.append, virtual=virtual)
        self.passed = threading.Event()

    def silent(self) -> threading.Thread:
        """The client has been silent for longer than permitted, and the next block is due."""
        self.server._heard -= 2.0 * SILENCE
        thread = threading.Thread(target=self._next_block)
        thread.start()
        return thread

    def _next_block(self) -> None:
        self.server.wait_for_owner()
        self.passed.set()


@pytest.fixture
def virtual() -> Generator[Served]:
    served = Served(virtual=True)
    yield served
    served.client.close()


def test_the_engine_goes_on_when_the_client_is_heard_again(virtual: Served) -> None:
    thread = virtual.silent()
    assert not virtual.passed.wait(0.5)
    virtual.client.send("alive")
    thread.join(LONG)
    assert virtual.passed.is_set()
    assert virtual.lost == []


def test_a_client_that_disconnects_is_lost_at_once(virtual: Served) -> None:
    thread = virtual.silent()
    virtual.client.close()
    thread.join(LONG)
    assert virtual.lost == ["the client has disconnected"]


def test_stop_is_not_kept_waiting(virtual: Served) -> None:
    thread = virtual.silent()
    virtual.requests.abort("from a second window")
    thread.join(LONG)
    assert virtual.passed.is_set()


def test_real_time_waits_for_nobody() -> None:
    served = Served(virtual=False)
    thread = served.silent()
    thread.join(LONG)
    assert served.passed.is_set()
    served.client.close()


@pytest.mark.parametrize("realtime", [False, True])
def test_a_simulated_bench_is_paced_only_in_real_time(realtime: bool, tmp_path: Path) -> None:
    assert Run(SHAKING.name, ShakingParameters(), bench(), tmp_path, realtime=realtime).paced == realtime
