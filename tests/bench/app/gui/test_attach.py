"""A window beside a run of another window or of a terminal: it shows whose it is, and can stop it."""

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Generator
from multiprocessing import Pipe
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from bench.app.display.theme import LIGHT
from bench.app.gui.controller import Controller
from bench.app.gui.window import Window
from bench.app.ipc.messages import Ask, Attached, Ended, Refused, receive
from bench.app.ipc.server import SessionServer
from bench.app.ipc.sessions import running_sessions
from bench.datafile.reader import open_datafile
from bench.engine.interface import Requests
from bench.events import StepStarted
from tests.bench.app.gui.shared_window import undressed
from tests.bench.app.ipc.experiment import SHAKING, bench, order
from tests.forked_sessions import ForkedSessions
from tests.patience import LONG_MS

ROOT = Path(__file__).parents[4]

pytestmark = pytest.mark.skipif(os.name != "posix", reason="kills a process the POSIX way")


@pytest.fixture
def session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, forked_sessions: ForkedSessions
) -> Generator[subprocess.Popen[str]]:
    """A window's process that is killed while its run, which goes on without it, drives the table."""
    monkeypatch.setenv("ROCKBENCH_SESSIONS", str(tmp_path / "sessions"))
    # in another working folder than the window's, with a relative folder for its results, as on a command line
    link = forked_sessions.link.fileno()
    command = [sys.executable, "-m", "tests.bench.app.ipc.lone_client", "run", "go on", "400", str(link)]
    paths = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    environment = os.environ | {"PYTHONPATH": paths}
    with subprocess.Popen(
        command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True, pass_fds=[link]
    ) as client:
        assert client.stdout is not None
        while client.stdout.readline().strip() != "running":
            assert client.poll() is None
        yield client
        client.kill()


def opened(qtbot: QtBot) -> Window:
    with undressed():
        window = Window(Controller(), bench(), (SHAKING,), LIGHT)
    qtbot.addWidget(window)
    window.show()
    return window


def test_a_window_after_a_killed_one_has_state_log_and_stop(
    session: subprocess.Popen[str], qtbot: QtBot, tmp_path: Path
) -> None:
    session.send_signal(signal.SIGKILL)
    session.wait()
    window = opened(qtbot)
    # points of an earlier run
    window.run.gains.add({"omega_rad_s": 16.0, "beta": 0.4, "alpha_2": 0.21})
    began = time.monotonic()
    controller = window.header._controller  # pyright: ignore[reportPrivateUsage]
    qtbot.waitUntil(lambda: window.header.word.text() == "RUNNING", timeout=LONG_MS)
    qtbot.waitUntil(lambda: "shaking" in window.run.log.toPlainText(), timeout=LONG_MS)
    qtbot.waitUntil(lambda: len(window.run.traces.ring) > 0, timeout=LONG_MS)
    print(f"attached after {time.monotonic() - began:.2f} s")
    assert window.run.gains.measured == []
    assert str(tmp_path / "run") in window.header.reason.text()
    assert "another window's run" in window.header.reason.text().lower()
    assert not window.protocol.start.isEnabled()
    assert window.protocol.why_not == "a run is under way"
    qtbot.waitUntil(lambda: controller.session.controls, timeout=LONG_MS)
    ended = list[Ended | Refused]()
    controller.ended.connect(ended.append)
    qtbot.mousePress(window.header.stop, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: not controller.running, timeout=LONG_MS)
    window.close()
    (end,) = ended
    assert isinstance(end, Ended)
    assert end.out == tmp_path / "run"
    with open_datafile(tmp_path / "run" / "campaign.h5") as record:
        assert (record.status, record.summary) == ("aborted", "abort requested")
    assert running_sessions() == []


@pytest.mark.usefixtures("session")
def test_a_second_window_only_watches_and_stops(qtbot: QtBot, tmp_path: Path) -> None:
    window = opened(qtbot)
    controller = window.header._controller  # pyright: ignore[reportPrivateUsage]
    qtbot.waitUntil(lambda: window.header.word.text() == "RUNNING", timeout=LONG_MS)
    assert not controller.session.controls
    assert not window.run.ramp_out.isEnabled()
    controller.ramp_out()
    # the run goes on while the window leaves, offers it, and attaches again
    window.header.attach.click()
    assert window.header.word.text() == "RUN ELSEWHERE"
    assert not controller.running
    window.header.attach.click()
    qtbot.waitUntil(lambda: window.header.word.text() == "RUNNING", timeout=LONG_MS)
    controller.press_stop()
    qtbot.waitUntil(lambda: not controller.running, timeout=LONG_MS)
    window.close()
    with open_datafile(tmp_path / "run" / "campaign.h5") as record:
        assert record.status == "aborted"


@pytest.mark.usefixtures("session")
def test_stop_ends_a_run_to_which_the_window_is_not_attached(qtbot: QtBot, tmp_path: Path) -> None:
    window = opened(qtbot)
    controller = window.header._controller  # pyright: ignore[reportPrivateUsage]
    qtbot.waitUntil(lambda: window.header.word.text() == "RUNNING", timeout=LONG_MS)
    window.header.attach.click()
    # a STOP from before stays latched, but this run has not been stopped
    controller.latched = True
    window.header.attach.click()
    qtbot.waitUntil(lambda: window.header.word.text() == "RUNNING", timeout=LONG_MS)
    assert controller.latched
    assert not controller.cuts_next
    controller.clear_stop()
    assert not controller.latched
    window.header.attach.click()
    assert window.header.word.text() == "RUN ELSEWHERE"
    controller.press_stop()
    assert controller.cuts_next
    qtbot.waitUntil(lambda: not controller.running, timeout=LONG_MS)
    assert controller.latched
    window.close()
    with open_datafile(tmp_path / "run" / "campaign.h5") as record:
        assert (record.status, record.summary) == ("aborted", "abort requested")


def test_the_announcement_of_a_killed_session_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROCKBENCH_SESSIONS", str(tmp_path))
    (tmp_path / "1-abcd.json").write_text("{}")
    assert running_sessions() == []
    assert list(tmp_path.glob("*.json")) == []


def test_a_folder_that_others_can_enter_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROCKBENCH_SESSIONS", str(tmp_path / "open"))
    (tmp_path / "open").mkdir(mode=0o777)
    (tmp_path / "open").chmod(0o777)
    (tmp_path / "open" / "1-abcd.json").write_text("{}")
    assert running_sessions() == []
    assert (tmp_path / "open" / "1-abcd.json").exists()


def test_a_session_of_another_version_can_be_stopped(tmp_path: Path) -> None:
    """Its unknown messages are left out, in both directions."""
    here, there = Pipe()
    requests = Requests()
    server = SessionServer(None, requests, lambda _why: None)
    server.attach(there, Attached(order(tmp_path), "", "terminal", 0.0))
    unknown = pickle.dumps(StepStarted("x")).replace(b"StepStarted", b"StepUnknown")
    here.send_bytes(unknown)
    here.send(Ask("abort"))
    while requests.strongest is None:
        time.sleep(0.01)
    assert requests.strongest == "abort"
    assert isinstance(receive(here), Attached)
    there.send_bytes(unknown)
    received = list[object]()
    while None not in received:
        received.append(receive(here))
    here.close()
