"""What passes over the link, both ways, in the order in which a person would meet it."""

import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import Pipe
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from bench.app.ipc.broadcast import SendQueue
from bench.app.ipc.client import SessionClient
from bench.app.ipc.messages import (
    Ask,
    Beat,
    Ended,
    FromSession,
    Opened,
    PlanCheck,
    PlanChecked,
    Preparing,
    Published,
    Question,
    Refused,
    Run,
    SafetyInputs,
    Traces,
    extremes,
)
from bench.app.ipc.server import SessionServer
from bench.app.session import run_session
from bench.config.model import BenchConfiguration
from bench.datafile.reader import open_datafile
from bench.engine.interface import Requests, Unattended
from bench.events import PointFinished, State, StateChanged, StepStarted
from bench.results import FILE
from protocols.harmonic.protocol import HarmonicParameters
from tests.bench.app.ipc.experiment import SHAKING, Shaking, ShakingParameters, begun, bench
from tests.patience import LONG, eventually


class Client:
    """Turns a main loop around a link."""

    def __init__(self, link: SessionClient) -> None:
        self.link, self.heard = link, list[FromSession]()

    def until(self, condition: Callable[[], object]) -> float:
        """Turn until `condition`; returns the seconds that it took."""
        start = time.monotonic()
        while not condition():
            assert time.monotonic() - start < LONG, self.heard[-5:]
            self.turn()
        return time.monotonic() - start

    def turn(self) -> None:
        self.link.alive()
        self.heard += self.link.take()
        time.sleep(0.02)

    def until_over(self) -> FromSession:
        self.until(lambda: self.link.process.poll() is not None)
        time.sleep(0.1)
        self.turn()
        return self.over()

    def over(self) -> FromSession:
        """The last message of a session."""
        return next(message for message in self.heard if isinstance(message, Ended | Refused | PlanChecked))

    def states(self) -> list[State]:
        return [m.event.after for m in self.heard if isinstance(m, Published) and isinstance(m.event, StateChanged)]

    def question(self) -> Question | None:
        return next((message for message in self.heard if isinstance(message, Question)), None)

    def until_running(self) -> None:
        self.until(lambda: State.RUNNING in self.states())


@dataclass
class Linked:
    """A short run that is over, with all that it sent, and its file. Its last message did not come through, as for a
    client that stood still at the end of a run that goes on without it."""

    client: Client
    file: Path
    last: Ended


@pytest.fixture(scope="module")
def linked(tmp_path_factory: pytest.TempPathFactory) -> Linked:
    folder = tmp_path_factory.mktemp("linked")
    keep, lost = SessionClient._keep, list[Ended]()  # pyright: ignore[reportPrivateUsage]

    def forgetful(self: SessionClient, message: FromSession) -> None:
        if isinstance(message, Ended) and not lost:
            lost.append(message)
        else:
            keep(self, message)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SessionClient, "_keep", forgetful)
        client = Client(begun(folder, realtime=False, cycles=6))
        client.until_over()
    return Linked(client, folder / FILE, lost[0])


def test_a_run_over_the_link_is_the_run_of_the_command_line(linked: Linked, tmp_path: Path) -> None:
    client, file, ended = linked.client, linked.file, linked.last
    direct = run_session(
        SHAKING,
        Shaking(ShakingParameters(cycles=6), bench()),
        out=tmp_path / "direct",
        operator=Unattended("the bench itself"),
        subscribers=[],
        requests=Requests(),
        realtime=False,
        about={"notes": "n"},
    )
    assert (ended.status, ended.reason, ended.table) == (direct.status, direct.reason, direct.table)
    with open_datafile(file) as one, open_datafile(tmp_path / "direct" / FILE) as other:
        np.testing.assert_array_equal(one.drive(), other.drive())
        assert one.metadata == other.metadata
        assert [event.text for event in one.events] == [event.text for event in other.events]
    opened = next(message for message in client.heard if isinstance(message, Opened))
    assert opened.sample_rate == 1000.0
    first = client.heard.index(opened)
    phases = [message.phase for message in client.heard if isinstance(message, Preparing)]
    assert isinstance(client.heard[0], Preparing | Beat), "planning is reported before the rig is open"
    assert any(isinstance(message, Preparing) for message in client.heard[:first])
    assert phases[-1] == "drawing the figures"
    told = [message.event for message in client.heard if isinstance(message, Published)]
    assert {StepStarted, PointFinished, StateChanged} <= {type(event) for event in told}
    assert any(isinstance(message, SafetyInputs) for message in client.heard)
    assert client.link.status == "over"


def test_traces_enclose_the_recorded_samples(linked: Linked) -> None:
    client, file = linked.client, linked.file
    traces = [message for message in client.heard if isinstance(message, Traces)]
    assert len(traces) > 10
    with open_datafile(file) as record:
        recorded, times = record.drive(), record.time()
    for each in traces:
        # two samples a bin at 1000 samples/s
        first = int(np.searchsorted(times, each.begin - 1e-4))
        shown = recorded[first : first + 2 * len(each.low)].reshape(-1, 2)
        np.testing.assert_allclose(each.low[:, 0], shown.min(axis=1), atol=1e-6)
        np.testing.assert_allclose(each.high[:, 0], shown.max(axis=1), atol=1e-6)
    # a client that does not keep up misses whole blocks, and is told how many
    missed = len(recorded) // 2 - sum(len(each.low) for each in traces)
    told = max(message.lost_traces for message in client.heard if isinstance(message, Beat))
    assert missed % len(traces[0].low) == 0
    assert told <= missed // len(traces[0].low)
    rows = np.diff([each.begin for each in traces if each.run == traces[0].run]) / 0.05
    np.testing.assert_allclose(rows, np.rint(rows), atol=1e-6)
    assert rows.min() > 0.5


def test_a_plan_check_opens_nothing_calls_whoever_waits_and_leaves_no_thread(tmp_path: Path) -> None:
    before, called = set(threading.enumerate()), threading.Event()
    check = PlanCheck("shaking", ShakingParameters(), bench(), tmp_path / "run")
    client = Client(SessionClient(check, called.set))
    assert called.wait(LONG)
    client.turn()
    assert client.heard
    found = client.until_over()
    assert isinstance(found, PlanChecked)
    assert (found.refusal, list(found.prediction)) == (None, ["value"])
    assert not (tmp_path / "run").exists()
    eventually(lambda: not set(threading.enumerate()) - before)


@pytest.mark.usefixtures("forked")
@pytest.mark.seconds
@pytest.mark.skipif(sys.platform == "win32", reason="no signal ends a wait there")
@pytest.mark.parametrize(
    "end", ["abort", pytest.param("stop", marks=pytest.mark.soak), pytest.param("halt", marks=pytest.mark.soak)]
)
def test_an_end_that_is_asked_for_breaks_the_planning_off(
    tmp_path: Path, end: Literal["stop", "abort", "halt"]
) -> None:
    """The paper's whole campaign, whose plan takes many seconds."""
    client = Client(SessionClient(Run("harmonic", HarmonicParameters(), BenchConfiguration(), tmp_path / "run")))
    client.until(lambda: any(isinstance(message, Preparing) and message.done for message in client.heard))
    client.link.ask(end)
    took = client.until(lambda: client.link.process.poll() is not None)
    refused = client.until_over()
    assert isinstance(refused, Refused)
    assert f"{end} requested" in refused.text
    assert not (tmp_path / "run").exists()
    # but for what a machine under full load may be late
    assert took < 4.0


@pytest.mark.usefixtures("forked")
def test_what_is_refused_names_its_item(tmp_path: Path) -> None:
    client = Client(begun(tmp_path / "run", amplitude=1.95))
    refused = client.until_over()
    assert isinstance(refused, Refused)
    assert (refused.cause.subject, refused.failed) == ("amplitude", False)
    assert not (tmp_path / "run").exists()


@pytest.mark.usefixtures("forked")
def test_an_abort_can_be_asked_for_and_beats_tell_the_state(tmp_path: Path) -> None:
    client = Client(begun(tmp_path, gossip=50))
    client.until(lambda: any(isinstance(m, Beat) and m.state is State.RUNNING for m in client.heard))
    client.link.ask("abort")
    ended = client.until_over()
    assert isinstance(ended, Ended)
    assert (ended.status, ended.reason) == ("aborted", "abort requested")


@pytest.mark.usefixtures("forked")
def test_a_run_that_has_ended_is_not_refused_when_its_figures_are_broken_off(tmp_path: Path) -> None:
    client = Client(begun(tmp_path, cycles=1, drawing=LONG))
    client.until(lambda: any(isinstance(m, Preparing) and m.phase == "drawing the figures" for m in client.heard))
    client.link.ask("halt")
    ended = client.until_over()
    assert isinstance(ended, Ended)
    assert (ended.status, ended.reason) == ("completed", "the plan was carried out")
    assert not (tmp_path / "none.png").exists()


@pytest.mark.usefixtures("forked")
def test_a_question_takes_only_its_own_answer(tmp_path: Path) -> None:
    client = Client(begun(tmp_path, person=True))
    client.until(client.question)
    question = client.question()
    assert question is not None
    assert question.request == "Take the block off the table."
    client.link.answer(question.number + 1, agreed=True)
    client.link.answer(question.number, agreed=False)
    ended = client.until_over()
    assert isinstance(ended, Ended)
    assert (ended.status, ended.reason) == ("aborted", "the operator declined: Take the block off the table.")


@pytest.mark.usefixtures("forked")
def test_a_client_that_is_closed_at_a_question_ends_the_run(tmp_path: Path) -> None:
    client = Client(begun(tmp_path, person=True))
    client.until(client.question)
    client.link.leave()
    ended = client.until_over()
    assert isinstance(ended, Ended)
    assert ended.status == "stopped"
    assert ended.reason.startswith("the client was closed")


@pytest.mark.usefixtures("forked")
@pytest.mark.seconds
def test_a_session_that_dies_is_noticed_within_a_second(tmp_path: Path) -> None:
    client = Client(begun(tmp_path))
    client.until_running()
    client.link.process.kill()
    assert client.until(lambda: client.link.status == "no link") < 1.0
    client.until(lambda: isinstance(client.heard[-1], Refused))
    refused = client.heard[-1]
    assert isinstance(refused, Refused)
    assert refused.failed
    assert "ended without a message" in refused.text


@pytest.mark.usefixtures("forked")
@pytest.mark.seconds
def test_halt_is_quick_while_thousands_of_events_are_told(tmp_path: Path) -> None:
    client = Client(begun(tmp_path, gossip=2000))
    client.until_running()
    time.sleep(1.0)
    client.link.ask("halt")
    assert client.until(lambda: State.HALTED in client.states()) < 2.0
    ended = client.until_over()
    assert isinstance(ended, Ended)
    assert (ended.status, ended.reason) == ("halted", "halt requested")


def test_a_halt_is_heard_from_a_client_that_reads_nothing() -> None:
    """The sending thread hangs in a full pipe; the hearing thread does not, nor does whoever fills the outbox."""
    here, there = Pipe()
    requests = Requests()
    host = SessionServer(there, requests, print)
    unread = host.broadcast.join()
    # never returns if it waits for the reader
    for number in range(50_000):
        host.broadcast.put(Published(StepStarted("x" * 100, time=float(number))))
    assert unread.lost_events > 0
    here.send(Ask("halt"))
    eventually(lambda: requests.strongest == "halt")
    here.close()


def test_an_outbox_is_bounded() -> None:
    outbox = SendQueue(events=10, traces=4)
    nothing = np.zeros((1, 1), dtype=np.float32)
    for number in range(100):
        outbox.put(Question(number, ""))
        outbox.put(Traces(number, 0.0, 0.0, nothing, nothing, 0.0))
    outbox.put(Refused("the last"), always=True)
    taken = outbox.take(0.0)
    assert [m.number for m in taken if isinstance(m, Question)] == list(range(10))
    assert [m.run for m in taken if isinstance(m, Traces)] == [96, 97, 98, 99]
    assert (outbox.lost_events, outbox.lost_traces) == (90, 96)
    assert any(isinstance(message, Refused) for message in taken)


def test_extremes_are_those_of_each_bin() -> None:
    values = np.array([[1.0], [np.nan], [3.0], [-2.0], [np.nan], [np.nan], [7.0]])
    low, high = extremes(values, 2)
    np.testing.assert_array_equal(low[:, 0], [1.0, -2.0, np.nan, 7.0])
    np.testing.assert_array_equal(high[:, 0], [1.0, 3.0, np.nan, 7.0])


def test_a_run_whose_last_word_was_lost_is_told_by_its_files(linked: Linked) -> None:
    ended, true = linked.client.over(), linked.last
    assert isinstance(ended, Ended)
    assert ended is not true
    assert (ended.status, ended.reason, ended.summary) == (true.status, true.reason, true.summary)


def test_a_beat_tells_for_how_long_the_engine_has_been_quiet() -> None:
    began = time.monotonic()
    here, there = Pipe()
    host = SessionServer(there, Requests(), print)

    def quiet() -> float:
        while here.poll(LONG):
            beat = here.recv()
            if isinstance(beat, Beat):
                return beat.quiet
        raise AssertionError

    host.note(StepStarted("the last that is heard of the engine", time=0.0))
    while (told := quiet()) < 0.6:
        assert told <= time.monotonic() - began
    again = time.monotonic()
    host.note(StepStarted("it turns again", time=1.0))
    # beats of before may still be on their way
    while quiet() > time.monotonic() - again:
        assert time.monotonic() - again < LONG
    here.close()
