"""Whatever goes wrong is told in one panel: what happened, what the bench did, what to do now."""

import errno
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.display.session_state import STALE
from bench.app.display.trouble import (
    DID_LOSE,
    DID_NOT_START,
    DID_NOTHING,
    DID_REFUSE,
    NOW,
    NOW_LOOK,
    NOW_REFUSED,
    advice,
    trouble_of,
)
from bench.app.gui.window import Window
from bench.app.ipc.messages import Ended, Published, Refused, SafetyInputs
from bench.datafile.hdf5_reading import DataFileError
from bench.events import LimitExceeded, State, StateChanged
from drivers.clock import now
from drivers.errors import (
    ConnectionLost,
    DeviceNotFound,
    DeviceTimeout,
    DriveUnderflow,
    RigError,
    SafetyInputOpen,
)
from drivers.optoncdt.dialogue import CommandRefused
from sim.errors import Cause, CauseCode, RockbenchError, cause_of
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.ipc.experiment import order

pytestmark = pytest.mark.usefixtures("without_plots")

OUT = Path("runs", "one")


@pytest.mark.parametrize(
    ("cause", "fits"),
    [
        (Cause(CauseCode.REQUEST), "Clear STOP"),
        (Cause(CauseCode.DECLINED), "Complete the task"),
        (Cause(CauseCode.LIMIT, "drift"), "limit was exceeded (drift)"),
        (Cause(CauseCode.LIMIT, "delay of a block of samples"), "too slow (delay of a block of samples)"),
        (Cause(CauseCode.LIMIT, "relative difference between the clocks"), "too slow"),
        (Cause(CauseCode.CLIENT_LOST), "did not respond"),
        (SafetyInputOpen("arming is refused", ("over-travel 1",)).cause, "Find the cause at the bench"),
        (DataFileError("its disk is 4096 events behind").cause, "Free disk space"),
        (cause_of(OSError(errno.ENOSPC, "whatever the system calls it")), "Free disk space"),
        (cause_of(PermissionError(errno.EACCES, "Permission denied")), "Look at the bench"),
        (ConnectionLost("cDAQ1Mod1 is gone").cause, "search for devices"),
        (DeviceTimeout("laser_1 on COM3 has not responded for 1 s").cause, "search for devices"),
        (DeviceNotFound("no gRPC device server answers").cause, "search for devices"),
        (CommandRefused("laser_1", "OUTPUT RS422", "E210 refused").cause, "search for devices"),
        (DriveUnderflow("the drive was written too late").cause, "Look at the bench"),
        (RigError("something that nobody thought of").cause, "Look at the bench"),
        (cause_of(ZeroDivisionError()), "Look at the bench"),
    ],
)
def test_advice_follows_the_cause_whatever_the_words(cause: Cause, fits: str) -> None:
    assert fits in advice(cause)


def test_every_cause_that_has_advice_exists() -> None:
    """A code that is renamed must not silently lose its advice."""

    def codes(kind: type[RockbenchError]) -> set[str]:
        return {kind.error_code}.union(*(codes(each) for each in kind.__subclasses__()))

    assert NOW.keys() <= codes(RockbenchError) | set(CauseCode)


@settings(max_examples=30, deadline=None)
@given(
    status=st.sampled_from(["completed", "stopped", "aborted", "halted", "failed"]),
    reason=st.text(min_size=1),
    driven=st.booleans(),
)
def test_every_bad_end_has_all_three_answers_and_no_good_one_has_any(status: str, reason: str, driven: bool) -> None:
    trouble = trouble_of(Ended(status, reason, {}, "", OUT), driven=driven)
    assert (trouble is None) == (status in ("completed", "stopped"))
    if trouble is not None:
        assert reason in trouble.what
        assert str(OUT) in trouble.did
        assert (DID_NOTHING in trouble.did) == (not driven)
        assert trouble.now


@pytest.fixture
def link(window: Window, spoken: type[ScriptedClient]) -> ScriptedClient:
    window._controller.start(order(OUT))
    return spoken.latest


def _said(window: Window) -> list[str]:
    return [label.text() for label in window.trouble.answers]


def test_a_limit_says_what_the_bench_did_and_where_the_data_are(window: Window, link: ScriptedClient) -> None:
    link.said = [
        Published(StateChanged(State.ARMED, State.RUNNING, "driving", time=1.0)),
        Published(LimitExceeded("drift", 0.081, 0.08, "m", time=2.0)),
        Ended("aborted", "drift 0.081 m exceeds 0.08 m", {}, "", OUT, cause=Cause(CauseCode.LIMIT, "drift")),
    ]
    window._controller._look()
    assert window.trouble.isVisible()
    what, did, now_ = _said(window)
    assert "drift 0.081 m exceeds 0.08 m" in what
    assert "ramped quickly to zero" in did
    assert str(OUT) in did
    assert "drift" in now_
    assert not window.trouble.more.isVisible(), "there are no details to show"


def test_a_failed_start_has_its_details_on_request(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    link.said = [
        Refused("cDAQ1 is not there", DeviceNotFound("cDAQ1 is not there").cause, failed=True, details="Trace")
    ]
    window._controller._look()
    panel = window.trouble
    assert _said(window)[1] == DID_NOT_START
    assert "search for devices" in _said(window)[2]
    assert not panel.details.isVisible()
    qtbot.mouseClick(panel.more, Qt.MouseButton.LeftButton)
    assert panel.details.isVisible()
    assert panel.details.toPlainText() == "Trace"
    window._controller.start(order(OUT))
    assert not panel.isVisible(), "a new run begins clean"


def test_a_refused_start_says_that_nothing_happened(window: Window, link: ScriptedClient) -> None:
    link.said = [Refused("limits.drift = 0.08 is refused: too near", Cause("invalid_input", "limits.drift"))]
    window._controller._look()
    assert _said(window) == ["limits.drift = 0.08 is refused: too near", DID_REFUSE, NOW_REFUSED]


def test_a_session_that_dies_while_it_drives_sends_to_the_bench(window: Window, link: ScriptedClient) -> None:
    link.said = [
        Published(StateChanged(State.ARMED, State.RUNNING, "driving", time=1.0)),
        Refused("the session process ended without a message (exit code -9)", failed=True),
    ]
    window._controller._look()
    assert _said(window)[1:] == [DID_LOSE, NOW_LOOK]
    assert "emergency stop" in _said(window)[2]


def test_a_good_end_says_nothing(window: Window, link: ScriptedClient) -> None:
    link.said = [Ended("completed", "the plan was carried out", {}, "", OUT)]
    window._controller._look()
    assert not window.trouble.isVisible()


def test_safety_inputs_that_are_old_are_unknown(
    window: Window, link: ScriptedClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    header, controller = window.header, window._controller
    assert (header.inputs.text(), header.inputs.property("level")) == (texts.INPUT_UNKNOWN, "wait")
    link.said = [SafetyInputs(1.0, {"emergency stop": True, "over-travel": False})]
    controller._look()
    assert header.inputs.text() == "emergency stop good, over-travel OPEN"
    later = now() + STALE + 0.1
    monkeypatch.setattr("bench.app.display.session_state.now", lambda: later)
    header.refresh()
    assert header.inputs.text() == "emergency stop unknown, over-travel unknown"
    assert header.inputs.property("level") == "wait"
    link.said = [SafetyInputs(2.0, {})]
    controller._look()
    assert header.inputs.text() == texts.NO_INPUTS
    link.said = [Ended("completed", "over", {}, "", OUT)]
    controller._look()
    assert header.inputs.text() == texts.INPUTS_UNREAD


def test_after_stop_in_planning_the_advice_is_to_clear_it() -> None:
    refused = Refused("ended before anything moved: abort was asked for", Cause(CauseCode.REQUEST))
    trouble = trouble_of(refused, driven=False)
    assert trouble is not None
    assert trouble.now == NOW["request"]
