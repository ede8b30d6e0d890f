"""What the header says: never a last known state, never by colour alone."""

from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtWidgets import QApplication, QScrollArea
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.display.status import bench_status
from bench.app.gui.window import Window
from bench.app.ipc.messages import Beat, Ended, Opened, Preparing, Published, Question, Refused, SafetyInputs
from bench.events import Progress, State, StateChanged, StepStarted
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.ipc.experiment import order
from tests.patience import LONG_MS

NO_PLOTS = pytest.mark.usefixtures("without_live_plots")


def test_every_state_has_its_word_and_no_colour_stands_for_two_things_of_one_shape() -> None:
    shown = {state: bench_status("linked", state, "", 0.0) for state in State}
    assert len({each.word for each in shown.values()}) == len(State)
    lost = bench_status("no link", State.RUNNING, "", 3.0)
    assert lost.word == texts.NO_LINK
    assert lost.shape not in {each.shape for each in shown.values()}
    for state in (State.RUNNING, State.ARMED, State.HALTED, State.IDLE):
        others = [each for other, each in shown.items() if other is not state and each.shape == shown[state].shape]
        assert all(each.word != shown[state].word for each in others)
    assert len({shown[state].shape for state in (State.IDLE, State.ARMED, State.RUNNING, State.HALTED)}) == 4


@pytest.fixture
def link(window: Window, spoken: type[ScriptedClient]) -> ScriptedClient:
    window._controller.start(order(Path("never")))
    return spoken.latest


@NO_PLOTS
def test_state_step_time_and_inputs_are_shown(window: Window, link: ScriptedClient) -> None:
    header = window.header
    link.said = [
        Published(StateChanged(State.ARMED, State.RUNNING, "the sine begins", time=1.0)),
        Published(StepStarted("bare frame at 16 rad/s", time=1.0)),
        Published(Progress(0.25, 125.0, "settling", time=1.0)),
        SafetyInputs(1.0, {"end switch": True, "enable": False}),
    ]
    window._controller._look()
    assert (header.word.text(), header.lamp.shape) == ("RUNNING", "disc")
    assert header.reason.text() == "", "neither the reason of a change that is over, nor the step twice"
    assert header.step.text() == "bare frame at 16 rad/s · settling"
    assert header.remaining.text() == "2:05"
    assert header.inputs.text() == "end switch good, enable OPEN"
    assert header.inputs.property("level") == "alarm"
    assert header.progress.value() == 250


@NO_PLOTS
def test_a_session_that_plans_is_not_idle_and_time_left_counts_down(window: Window, link: ScriptedClient) -> None:
    header = window.header
    link.said = [Preparing("planning the starts", 1, 4), Beat(State.IDLE, "", 0.0, 0, 0)]
    window._controller._look()
    assert header.word.text() == texts.PLANNING
    assert header.reason.text() == "planning the starts"
    assert header.progress.value() == 250
    link.said = [Opened((), 2000.0, {}, (), 90.0), Beat(State.IDLE, "", 0.0, 0, 0)]
    window._controller._look()
    assert header.word.text() == "IDLE"
    assert header.remaining.text() == "1:30"
    link.said = [Published(Progress(0.1, float("nan"), "calibrating", time=20.0))]
    window._controller._look()
    assert header.remaining.text() == "1:10"
    link.said = [Published(Progress(0.5, 60.0, "settling", time=30.0)), Beat(State.RUNNING, "", 45.0, 0, 0)]
    window._controller._look()
    assert header.remaining.text() == "0:45"
    link.said = [Preparing("drawing the figures"), Beat(State.CLOSED, "", 90.0, 0, 0)]
    window._controller._look()
    assert (header.word.text(), header.reason.text()) == ("CLOSED", "drawing the figures")
    link.said = [Ended("completed", "the plan was carried out", {}, "", Path("never"))]
    window._controller._look()
    assert header.reason.text() == "the plan was carried out"
    assert header.step.text() == "–", "nothing is under way"


@NO_PLOTS
def test_silence_is_shown_as_no_link(window: Window, link: ScriptedClient) -> None:
    link.said = [Beat(State.RUNNING, "the sine begins", 1.0, 0, 0)]
    window._controller._look()
    link.status, link.silence = "no link", 1.4
    window.header.refresh()
    assert (window.header.word.text(), window.header.lamp.shape) == ("NO LINK", "cross")
    assert "1.4 s" in window.header.reason.text()
    assert "emergency stop" in window.header.reason.text()
    assert "RUNNING" not in window.header.word.text()
    assert window._controller.armed, "what is not known counts as armed"


@NO_PLOTS
def test_a_dead_session_says_what_happened_and_what_to_do(window: Window, link: ScriptedClient) -> None:
    link.said = [Refused("the session process ended without a message (exit code -9)", failed=True)]
    window._controller._look()
    assert "exit code -9" in window.results.message.text()
    assert "Look at the bench" in window.results.message.text()
    assert (window.header.word.text(), window.header.lamp.shape) == (texts.FAILED_WORD, "cross")
    assert window.pages.currentWidget() is window.results
    assert not window._controller.running


@pytest.mark.usefixtures("without_live_plots", "window")
def test_the_main_loop_keeps_the_link_alive(link: ScriptedClient, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: link.beats >= 3, timeout=LONG_MS)


@NO_PLOTS
def test_a_session_that_plans_on_a_busy_computer_is_not_lost(window: Window, link: ScriptedClient) -> None:
    """No rig is open: the state is known. A process that has died is lost."""
    link.said = [Preparing("simulating starts", 1, 4)]
    window._controller._look()
    link.status, link.silence = "no link", 2.4
    window.header.refresh()
    assert window.header.word.text() == "PLANNING"
    assert "no message for 2 s" in window.header.reason.text()
    link.lives = False
    window.header.refresh()
    assert window.header.word.text() == "NO LINK"


@NO_PLOTS
def test_closing_asks_while_a_run_is_driven(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    window.close()
    assert window.isVisible()
    assert link.asked == []
    assert QApplication.activeModalWidget() is None
    assert window.leave_panel.question.text() == texts.LEAVE_RAMPS_OUT
    qtbot.mouseClick(window.leave_panel.stay, Qt.MouseButton.LeftButton)
    assert not window.leave_panel.isVisible()
    window.close()
    qtbot.mouseClick(window.leave_panel.close_window, Qt.MouseButton.LeftButton)
    assert not window.isVisible()
    assert link.asked == ["leave"]


@NO_PLOTS
def test_closing_asks_nothing_when_the_run_is_over(window: Window, link: ScriptedClient) -> None:
    link.said = [Ended("completed", "the plan was carried out", {}, "", Path("never"))]
    window._controller._look()
    window.close()
    assert not window.isVisible()


def test_stop_stays_in_its_place_whatever_is_said(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    window.resize(window.minimumSize())
    qtbot.wait(50)
    stop = window.header.stop
    place = stop.mapTo(window, stop.rect().topLeft())
    link.said = [
        Published(StepStarted("a step with very much to say " * 12, time=1.0)),
        Published(StateChanged(State.ARMED, State.WAITING, "a reason with very much to say " * 8, time=1.0)),
        Question(1, "Mount the spring, and look at it from every side. " * 3),
    ]
    window._controller._look()
    qtbot.waitUntil(window.prompt.isVisible, timeout=LONG_MS)
    qtbot.wait(100)
    assert stop.mapTo(window, stop.rect().topLeft()) == place
    assert window.width() == window.minimumWidth()


def test_a_beat_tells_the_state_when_the_change_was_lost(window: Window, link: ScriptedClient) -> None:
    link.said = [Beat(State.HALTED, "the end switch opened", 9.0, 12, 3)]
    window._controller._look()
    assert window.header.word.text() == "HALTED"
    assert "12 event(s) and 3 block(s)" in window.run.lost.text()


def test_stop_is_in_view_on_small_screens(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    """1024x600, 1366x768 and 1920x1080 at scales 1, 1.5 and 2; whatever is asked, and on every page."""
    link.said = [Question(1, "Mount the spring, and look at it from every side. " * 3)]
    window._controller._look()
    stop = window.header.stop
    screens = ((1024, 600), (1366, 728), (1920, 1040))
    for width, height in [(int(w / s), int((h - 30 * s) / s)) for w, h in screens for s in (1.0, 1.5, 2.0)]:
        window.resize(width, height)
        for page in range(window.pages.count()):
            window.pages.setCurrentIndex(page)
            qtbot.wait(20)
            assert (window.width(), window.height()) == (width, height)
            place = QRect(stop.mapTo(window, QPoint(0, 0)), stop.size())
            assert window.rect().contains(place)
            assert stop.visibleRegion().boundingRect() == stop.rect()
            font = stop.fontMetrics()
            assert max(map(font.horizontalAdvance, stop.text().splitlines())) < stop.width()
            assert 2 * font.height() < stop.height() + font.descent()
            assert window.prompt.visibleRegion().boundingRect().height() >= 50
    parent = stop.parentWidget()
    while parent is not None:
        assert not isinstance(parent, QScrollArea)
        parent = parent.parentWidget()


def test_the_state_is_whole_beside_a_latched_stop(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    window._controller.press_stop()
    link.said = [Published(StateChanged(State.RUNNING, State.ABORTING, "abort requested", time=1.0))]
    window._controller._look()
    word = window.header.word
    for width, height in ((512, 270), (683, 360), (1024, 570), (1366, 738)):
        window.resize(width, height)
        qtbot.wait(20)
        assert word.fontMetrics().horizontalAdvance(word.text()) <= word.width()


def test_check_and_start_are_in_view_on_small_screens(window: Window, qtbot: QtBot) -> None:
    """Also at 150 %: on the Protocol page no scrolling is needed to press them."""
    window.pages.setCurrentWidget(window.protocol)
    for width, height in ((1024, 570), (1366, 738), (910, 482), (683, 360)):
        window.resize(width, height)
        qtbot.wait(20)
        for button in (window.protocol.check, window.protocol.start):
            place = QRect(button.mapTo(window, QPoint(0, 0)), button.size())
            assert window.rect().contains(place)
            assert button.visibleRegion().boundingRect() == button.rect()
