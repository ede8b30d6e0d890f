"""The page over sockets, on a session whose messages a test sends: token, methods, headers, clients, end of runs."""

import json
import socket
import sys
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from http.client import HTTPConnection, HTTPException, HTTPResponse
from importlib.resources import files
from pathlib import Path
from threading import Event, Thread
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from bench.app.ipc.announcement import announced
from bench.app.ipc.messages import TRACES, Ended, Opened, Published, Question, Traces
from bench.app.ipc.server import FAREWELL, SessionServer
from bench.app.watch.feed import Feed
from bench.app.watch.server import POLICY
from bench.app.watch.serving import LivePage
from bench.engine.interface import Requests
from bench.events import PointFinished, SpecimenMounted, State, StateChanged, Warned
from bench.live_values import Estimate
from drivers.clock import now
from drivers.rig import OperatorTask
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, PointStatus
from sim.errors import InvalidInput
from sim.specimen import Specimen
from tests.bench.app.ipc.experiment import order
from tests.patience import LONG, eventually

HOSTILE = "</script><script>alert(1)</script>\u2028\"'&"


@dataclass
class Served:
    """A page, and its connections."""

    url: str

    def __post_init__(self) -> None:
        parts = urlsplit(self.url)
        self.path, self.place = parts.path, (parts.hostname or "", parts.port or 0)
        self.held = ExitStack()

    def get(self, path: str, method: str = "GET", **headers: str) -> HTTPResponse:
        connection = HTTPConnection(*self.place, timeout=LONG)
        self.held.callback(connection.close)
        connection.request(method, path, headers=headers)
        return connection.getresponse()

    def state(self) -> dict[str, Any]:
        return json.loads(self.get(f"{self.path}state").read())


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> Generator[Path]:
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("sessions")
        patch.setenv("ROCKBENCH_SESSIONS", str(folder))
        yield folder


@contextmanager
def page(**options: Any) -> Generator[Served]:
    served, over = LivePage("127.0.0.1", 0, **options), Event()
    thread = Thread(target=served.serve, args=(over,))
    thread.start()
    found = Served(served.url)
    try:
        with found.held:
            yield found
    finally:
        over.set()
        thread.join(LONG)
        assert not thread.is_alive()


@pytest.fixture(scope="module")
def served(sessions: Path) -> Generator[Served]:  # noqa: ARG001 - the sessions of other programs stay out
    with page() as found:
        yield found


def test_without_its_token_nothing_is_served(served: Served) -> None:
    for path in ("/", "/state", "/style.css", "/wrong/state", f"{served.path[:-2]}/state", "//", "/%00/"):
        answer = served.get(path)
        assert answer.status == 403, path
        assert b"token" in answer.read()
    assert len(served.path) > 20


def test_every_answer_forbids_foreign_content(served: Served) -> None:
    for name, kind in (("", "text/html"), ("page.js", "text/javascript"), ("style.css", "text/css"), ("state", "json")):
        answer = served.get(served.path + name)
        assert answer.status == 200
        assert kind in str(answer.getheader("Content-Type"))
        assert answer.getheader("Content-Security-Policy") == POLICY
        assert answer.getheader("X-Content-Type-Options") == "nosniff"
        assert answer.getheader("Referrer-Policy") == "no-referrer"
        content = answer.read().decode()
        assert "//cdn" not in content
        assert "https://" not in content
        assert "innerHTML" not in content
    assert "unsafe" not in POLICY


def test_no_path_is_a_file(served: Served) -> None:
    for path in ("../server.py", "..%2fserver.py", "/etc/passwd", "index.html/..", "state/", "page.js%00"):
        assert served.get(served.path + path).status == 404, path


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT", "ABORT"])
def test_no_method_writes(served: Served, method: str) -> None:
    answer = served.get(f"{served.path}state", method)
    assert (answer.status, answer.getheader("Allow")) == (405, "GET, HEAD")


def test_head_has_the_headers_alone(served: Served) -> None:
    answer = served.get(f"{served.path}page.js", "HEAD")
    assert int(answer.getheader("Content-Length") or 0) > 1000
    assert answer.read() == b""


def test_a_page_without_a_token_answers_to_this_computer_only(sessions: Path) -> None:  # noqa: ARG001
    with page(with_token=False) as found:
        assert found.path == "/"
        assert found.get("/state").status == 200
        assert found.get("/state", Host="bench.example").status == 403
    with pytest.raises(InvalidInput, match="loopback"):
        LivePage("0.0.0.0", 0, with_token=False)
    with pytest.raises(InvalidInput, match="cannot be served"):
        LivePage("192.0.2.1", 0)


def test_a_port_in_use_and_sessions_that_are_not_announced_are_refused(
    monkeypatch: pytest.MonkeyPatch,
    sessions: Path,  # noqa: ARG001
) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        with pytest.raises(InvalidInput, match="--port"):
            LivePage("127.0.0.1", other.getsockname()[1])
    with pytest.raises(InvalidInput, match="65535"):
        LivePage("127.0.0.1", 70_000)
    monkeypatch.setenv("ROCKBENCH_SESSIONS", "off")
    with pytest.raises(InvalidInput, match="ROCKBENCH_SESSIONS"):
        LivePage("127.0.0.1", 0)


@pytest.mark.skipif(sys.platform == "win32", reason="on Windows, permissions are not those of POSIX")
def test_a_folder_that_others_may_read_is_named_in_the_refusal(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tmp_path.chmod(0o755)
    monkeypatch.setenv("ROCKBENCH_SESSIONS", str(tmp_path))
    with pytest.raises(InvalidInput, match="which only this user may access") as caught:
        LivePage("127.0.0.1", 0)
    assert caught.value.value == str(tmp_path)


def test_more_connections_than_are_served_are_closed(sessions: Path, monkeypatch: pytest.MonkeyPatch) -> None:  # noqa: ARG001
    monkeypatch.setattr("bench.app.watch.server.MOST", 2)
    with page() as found, ExitStack() as held:
        idle = [held.enter_context(socket.create_connection(found.place)) for _ in range(2)]
        with socket.create_connection(found.place, timeout=LONG) as third:
            assert third.recv(1) == b"", "closed without an answer"
        for each in idle:
            each.close()
        eventually(lambda: _status(found) == 200)


def _status(found: Served) -> int:
    with suppress(OSError, HTTPException):
        return found.get(f"{found.path}state").status
    return 0


@contextmanager
def session(out: Path) -> Generator[SessionServer]:
    """A session of a harmonic run that does nothing but what a test publishes."""
    asked = HarmonicParameters(omega=(16.0,), beta=(0.4, 0.64))
    run = replace(order(out), protocol="harmonic", parameters=asked, about={"operator": HOSTILE})
    server = SessionServer(None, Requests(), lambda _why: None)
    with announced(server, run, "terminal"):
        yield server
    server.close(Ended("completed", "the plan was carried out", {}, "", out), FAREWELL)


def _publish(server: SessionServer, *events: Any) -> None:
    for each in events:
        server.note(each)
        server.broadcast.put(Published(each))


def test_a_run_is_followed_from_its_begin_to_its_end_and_so_is_the_next(served: Served, tmp_path: Path) -> None:
    assert served.state()["head"]["word"] == "NO RUN"
    specimen = Specimen()
    with session(tmp_path / "first") as server:
        eventually(lambda: server.broadcast.has_clients)
        server.broadcast.put(Opened(("ai0",), 1000.0, {}))
        _publish(
            server,
            SpecimenMounted(specimen.coupled(0.4), OperatorTask.MOUNT_SPRING, time=0.5),
            StateChanged(State.IDLE, State.RUNNING, "shaking", time=1.0),
            Estimate(16.0, 0.4, 20, 0.01, 0.19, 0.004, 0.188, time=1.5),
            Warned(HOSTILE, time=2.0),
        )
        motion = np.zeros((50, len(TRACES)), np.float32)
        motion[25, TRACES.index("drift")] = 0.004
        motion[45] = np.nan
        server.broadcast.put(Traces(1, 2.0, 0.002, motion, motion, now(), 0.0, {"drift": 0.004}))
        eventually(lambda: served.state()["log"] and served.state()["head"]["live"])
        found = served.state()
        assert (found["head"]["word"], found["head"]["level"]) == ("RUNNING", "good")
        assert HOSTILE.split("\u2028")[0] in found["log"][-1][2]
        assert "0.190" in found["verdict"]["sentence"]
        assert "predicted 0.1880" in found["verdict"]["sentence"]
        assert found["matrix"]["cells"][0][0][0] == "▶"
        assert {shape[0] for shape in found["picture"]["shapes"]} >= {"spring", "unknown", "beam"}
        drift = next(meter for meter in found["meters"] if meter["name"] == "drift")
        assert drift["text"].startswith("4 / ")
        label, reach, ordinates = found["traces"]["traces"][4]
        assert "[mm]" in label
        assert reach == "± 4"
        assert max(value for value in ordinates if value is not None) == found["traces"]["full"]
        # a question is shown, and nobody who only looks can answer it
        server.broadcast.put(Question(1, HOSTILE))
        eventually(lambda: served.state()["head"]["question"])
        assert not server._attending
        point = HarmonicPoint.model_construct(
            omega_rad_s=16.0, beta=0.4, status=PointStatus.STEADY, alpha_2=0.19, alpha_2_uncertainty=0.004,
            alpha_2_predicted=0.188, agrees=True,
        )  # fmt: skip
        _publish(server, PointFinished(point, time=3.0))
        eventually(lambda: served.state()["points"]["marks"])
        assert "✓ agrees" in served.state()["verdict"]["sentence"]
        server.close(Ended("aborted", "STOP was pressed", {}, "", tmp_path), FAREWELL)
        eventually(lambda: served.state()["verdict"]["trouble"])
    found = served.state()
    assert not found["head"]["live"]
    assert "not live for" in found["head"]["age"]
    assert found["head"]["remaining"] == ""
    with session(tmp_path / "second") as server:
        eventually(lambda: served.state()["head"]["run"][2] == "second")
        eventually(lambda: served.state()["verdict"]["sentence"] == "no gain yet")
        assert served.state()["log"] == []


def test_ten_browsers_receive_the_same_changes_and_leave(served: Served, tmp_path: Path) -> None:
    streams = [served.get(f"{served.path}events") for _ in range(10)]
    assert {str(stream.getheader("Content-Type")) for stream in streams} == {"text/event-stream; charset=utf-8"}
    first: dict[str, set[bytes]] = {}
    for stream in streams:
        document = stream.readline()
        # between two connections on a slow machine, the age of what is no longer live may have changed
        first.setdefault(json.loads(document.removeprefix(b"data: "))["head"]["age"], set()).add(document)
    assert {len(same) for same in first.values()} == {1}, "the whole document first, serialised once"

    def heard(stream: HTTPResponse, fits: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        while True:
            line = stream.readline()
            assert line, "the stream has ended"
            if line.startswith(b"data: ") and fits(found := json.loads(line[6:])):
                return found

    with session(tmp_path / "run") as server:
        for stream in streams:
            heard(stream, lambda found: "head" in found and "run" in found["head"]["run"])
        _publish(server, Warned("one line", time=1.0))
        for stream in streams:
            changed = heard(stream, lambda found: "log" in found)
            assert changed["log"][-1][2] == "one line"
            assert "figure" not in changed, "what has not changed is not sent"


def test_a_reader_after_a_pause_receives_the_present_document() -> None:
    """Without readers it is not kept up to date."""
    feed = Feed()
    feed.publish({"head": "yesterday"})
    assert not feed.has_readers

    def update() -> None:
        eventually(lambda: feed.has_readers)
        feed.publish({"head": "now"})

    thread = Thread(target=update)
    thread.start()
    assert json.loads(feed.since(0, LONG)[1]) == {"head": "now"}
    thread.join()
    # without a change as well, as for a bench at rest
    assert feed.has_readers
    assert json.loads(feed.since(0, LONG)[1]) == {"head": "now"}


BROWSER = """
let clock = 0;
const elements = {}, classes = new Set();
const performance = { now: () => clock };
const document = {
  hidden: false,
  body: { classList: {
    add: (name) => classes.add(name),
    remove: (name) => classes.delete(name),
    contains: (name) => classes.has(name),
    toggle: (name, on) => on ? classes.add(name) : classes.delete(name),
  } },
  getElementById: (id) => elements[id] || (elements[id] = { firstElementChild: { style: {} } }),
  addEventListener: () => {},
};
function EventSource() {}
function setInterval() {}
function addEventListener() {}
function drawLamp() {}
"""
"""As much of a browser as the head of the page needs."""

LINK = """
const head = { word: "NO RUN", level: "", reason: "idle", inputs: ["", ""], run: [], fraction: 0, live: true };
const seen = () => [elements.word.textContent, document.title, classes.has("lost")];
receive({ data: JSON.stringify({ head }) });
clock += 5000;
check();
const lost = seen();
receive({ data: "{}" });
JSON.stringify([lost, seen()]);
"""


@pytest.mark.usefixtures("qapp")
def test_an_idle_page_whose_link_is_back_shows_its_state_again() -> None:
    """After an interruption nothing may have changed, so that the first message is empty."""
    engine = pytest.importorskip("PySide6.QtQml").QJSEngine()
    script = (files("bench.app.watch") / "page" / "page.js").read_text(encoding="utf-8")
    found = engine.evaluate(BROWSER + script + LINK)
    assert not found.isError(), found.toString()
    lost, back = json.loads(found.toString())
    assert lost == ["NO LINK", "NO LINK · rocking-bench", True]
    assert back == ["NO RUN", "NO RUN · rocking-bench", False]
