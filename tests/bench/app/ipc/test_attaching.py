"""Clients that attach to a session: one that is silent, frozen or faulty affects neither the others nor the end."""

import threading
from collections.abc import Generator
from contextlib import contextmanager
from multiprocessing import AuthenticationError, Pipe
from multiprocessing.connection import Client
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bench.app.ipc import announcement
from bench.app.ipc import server as serving
from bench.app.ipc.announcement import announced
from bench.app.ipc.client import AttachedClient
from bench.app.ipc.messages import Alive, Ask, Attached
from bench.app.ipc.server import SessionServer
from bench.app.ipc.sessions import RunningSession, running_sessions
from bench.engine.interface import Requests
from tests.bench.app.ipc.experiment import order
from tests.patience import LONG, eventually


@contextmanager
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Generator[tuple[RunningSession, Requests]]:
    monkeypatch.setenv("ROCKBENCH_SESSIONS", str(tmp_path / "sessions"))
    requests = Requests()
    with announced(SessionServer(None, requests, print), order(tmp_path / "run"), "terminal"):
        (found,) = running_sessions()
        yield found, requests


def test_beside_a_client_that_sends_nothing_another_stops_the_run_which_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # so long that a wait for the silent client would be seen on any machine
    monkeypatch.setattr(announcement, "PATIENCE", 2.0 * LONG)
    with session(tmp_path, monkeypatch) as (found, requests), Client(found.address) as silent:
        eventually(silent.poll)
        client = AttachedClient(found)
        client.ask("abort")
        eventually(lambda: requests.strongest == "abort")
        client.leave()
    assert running_sessions() == []


def test_a_client_that_sends_nothing_is_dropped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(announcement, "PATIENCE", 0.05)
    with session(tmp_path, monkeypatch) as (found, _), Client(found.address) as silent:
        silent.recv_bytes()
        assert silent.poll(LONG)
        with pytest.raises((EOFError, OSError)):
            silent.recv_bytes()


def test_a_client_without_the_key_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with session(tmp_path, monkeypatch) as (found, _):
        with pytest.raises(AuthenticationError):
            Client(found.address, authkey=b"another")
        with Client(found.address, authkey=bytes.fromhex(found.key)) as client:
            assert isinstance(client.recv(), Attached)


def test_a_listener_that_has_closed_by_itself_is_no_error_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Last(threading.Event):
        """A client comes just when the session ends, so that the listener closes before it is woken."""

        def set(self) -> None:
            super().set()
            Client(found.address).close()
            eventually(lambda: all(each.name != "attaching" for each in threading.enumerate()))

    monkeypatch.setattr(announcement, "threading", SimpleNamespace(Event=Last, Thread=threading.Thread))
    with session(tmp_path, monkeypatch) as (found, _):
        pass
    eventually(lambda: all(each.name != "end of attaching" for each in threading.enumerate()))


def test_an_abort_after_a_message_that_cannot_be_compared_is_carried_out(tmp_path: Path) -> None:
    here, there = Pipe()
    requests = Requests()
    SessionServer(None, requests, print).attach(there, Attached(order(tmp_path), "", "terminal", 0.0))
    here.send(np.zeros(3))
    here.send(Ask("abort"))
    eventually(lambda: requests.strongest == "abort")
    here.close()


def test_a_frozen_client_answers_no_question(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serving, "PATIENCE", 0.05)
    owner, its_end = Pipe()
    server = SessionServer(its_end, Requests(), lambda _why: None)
    owner.close()
    eventually(lambda: not server.attended)
    here, there = Pipe()
    server.attach(there, Attached(order(tmp_path), "", "window", 0.0))
    eventually(lambda: not server.attended)
    eventually(lambda: here.send(Alive()) or server.attended)
    here.close()
    eventually(lambda: not server.broadcast.has_clients)
    assert not server.attended
