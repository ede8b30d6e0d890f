"""The control channel of an emulated laboratory, and the hands that use it."""

import json
import os
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from drivers.emulation.control import ControlServer, ask, place_of
from drivers.errors import ConnectionLost, DeviceTimeout, RigError
from drivers.rig import OperatorTask
from sim.errors import InvalidInput
from tests.patience import LONG


def refuse(arguments: dict[str, Any]) -> object:
    raise RigError(f"{arguments['work']} is refused: the amplifier is enabled")


@pytest.fixture
def done() -> list[dict[str, Any]]:
    """What the hands were asked to do."""
    return []


@pytest.fixture
def server(done: list[dict[str, Any]]) -> Iterator[ControlServer]:
    server = ControlServer(
        {
            "handwork": done.append,
            "epoch": lambda arguments: {"laser": arguments["laser"], "epoch": 12.5},
            "refuse": refuse,
            "break": lambda _: 1 / 0,
            "unspeakable": lambda _: object(),
        }
    )
    yield server
    server.close()


@pytest.fixture
def exchange(server: ControlServer) -> Iterator[Callable[[bytes], dict[str, Any]]]:
    """One line there, one line back, over one connection."""
    host, port = server.address.split(":")
    with socket.create_connection((host, int(port)), timeout=LONG) as connection:
        lines = connection.makefile("rb")

        def send(line: bytes) -> dict[str, Any]:
            connection.sendall(line + b"\n")
            return json.loads(lines.readline())

        yield send
        lines.close()


def test_it_listens_on_this_machine_only(server: ControlServer) -> None:
    host, port = server.address.split(":")
    assert host == "127.0.0.1"
    assert int(port) > 0


def test_the_operators_work_arrives_with_its_amount(server: ControlServer, done: list[dict[str, Any]]) -> None:
    ask(server.address, "handwork", work=OperatorTask.MOUNT_SPRING.value, amount=1250.0)
    ask(server.address, "handwork", work=OperatorTask.REMOVE_BLOCK.value, amount=None)
    assert done == [{"work": "mount spring", "amount": 1250.0}, {"work": "remove block", "amount": None}]


def test_the_answer_to_a_question(server: ControlServer) -> None:
    assert ask(server.address, "epoch", laser=2) == {"laser": 2, "epoch": 12.5}


def test_a_refusal_reaches_the_caller_word_by_word(server: ControlServer) -> None:
    with pytest.raises(RigError, match=r"^lock frame is refused: the amplifier is enabled$"):
        ask(server.address, "refuse", work="lock frame")


@pytest.mark.parametrize(("command", "words"), [("break", "ZeroDivisionError"), ("unspeakable", "TypeError")])
def test_a_failure_of_the_laboratory_is_told(server: ControlServer, command: str, words: str) -> None:
    with pytest.raises(RigError, match=words):
        ask(server.address, command)


def test_an_unknown_command_is_named(server: ControlServer) -> None:
    with pytest.raises(RigError, match=r"'dance' is refused: it must be one of break, epoch, handwork"):
        ask(server.address, "dance")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b"", "not JSON"),
        (b"{", "not JSON"),
        (b"\xff\xfe\xfd", "not JSON"),
        (b"[1, 2]", "not a JSON object"),
        (b"{}", "command None"),
        (b'{"command": ["handwork"]}', "refused"),
        (b" " * 70000, "more than 65536 bytes"),
        (b'{"command": "handwork", "work": "' + b"x" * 300000 + b'"}', "more than 65536 bytes"),
    ],
)
def test_a_malformed_line_is_refused_and_the_next_is_served(
    exchange: Callable[[bytes], dict[str, Any]], line: bytes, words: str
) -> None:
    answer = exchange(line)
    assert answer["ok"] is False
    assert words in answer["error"]
    assert exchange(b'{"command": "epoch", "laser": 1}') == {"ok": True, "result": {"laser": 1, "epoch": 12.5}}


def test_a_command_that_waits_does_not_hold_up_others() -> None:
    go_on, answers = threading.Event(), []
    server = ControlServer({"wait": lambda _: go_on.wait(LONG), "now": lambda _: "now"})
    waiting = threading.Thread(target=lambda: answers.append(ask(server.address, "wait")))
    waiting.start()
    assert ask(server.address, "now") == "now"
    assert not answers
    go_on.set()
    waiting.join(LONG)
    server.close()
    assert answers == [True]


def test_nobody_there_is_a_lost_connection(server: ControlServer) -> None:
    server.close()
    with pytest.raises(ConnectionLost, match="handwork failed: no connection"):
        ask(server.address, "handwork", work=OperatorTask.REMOVE_BLOCK.value, amount=None)


def test_a_laboratory_that_hangs_up_is_a_lost_connection() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def hang_up() -> None:
            connection, _ = listening.accept()
            with connection:
                connection.recv(4096)

        thread = threading.Thread(target=hang_up)
        thread.start()
        with pytest.raises(ConnectionLost, match="closed the connection"):
            ask(f"127.0.0.1:{listening.getsockname()[1]}", "handwork")
        thread.join()


def test_an_answer_that_does_not_come_is_a_timeout() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening, pytest.raises(DeviceTimeout, match=r"in 0\.1 s"):
        ask(f"127.0.0.1:{listening.getsockname()[1]}", "handwork", patience=0.1)


@pytest.mark.parametrize("answer", [b"SSH-2.0\n", b"[]\n", b'{"ok": true}\n', b'{"ok": false}\n'])
def test_an_answer_of_something_else_is_refused(answer: bytes) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def talk() -> None:
            connection, _ = listening.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(answer)

        thread = threading.Thread(target=talk)
        thread.start()
        with pytest.raises(RigError, match="invalid reply"):
            ask(f"127.0.0.1:{listening.getsockname()[1]}", "handwork")
        thread.join()


@pytest.mark.parametrize("address", ["", "here", ":80", "here:", "here:x", "here:0", "here:65536", "here:-1"])
def test_an_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(InvalidInput, match="host:port"):
        place_of(address)


@pytest.mark.skipif(not os.path.exists("/proc/self/fd"), reason="open files are counted in /proc")
def test_nothing_is_left_after_closing() -> None:
    files, threads = len(os.listdir("/proc/self/fd")), threading.active_count()
    server = ControlServer({"now": lambda _: "now"})
    assert ask(server.address, "now") == "now"
    host, port = server.address.split(":")
    with socket.create_connection((host, int(port)), timeout=LONG) as idle:
        idle.sendall(b'{"command": "now"}\n')
        assert idle.recv(4096) == b'{"ok": true, "result": "now"}\n'
        server.close()
        server.close()
        assert idle.recv(4096) == b""
    assert len(os.listdir("/proc/self/fd")) == files
    assert threading.active_count() == threads
