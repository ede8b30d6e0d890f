"""What the header says: never a last known state, never by colour alone."""

from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from bench.events import Progress, State, StateChanged, StepStarted
from bench.gui import texts
from bench.gui.standing import standing
from bench.gui.window import Window
from bench.link.messages import Beat, Question, Refused, SafetyInputs, Told
from tests.gui.conftest import SpokenLink
from tests.link.experiment import order


def test_every_state_has_its_word_and_no_colour_stands_for_two_things_of_one_shape() -> None:
    shown = {state: standing("linked", state, "", 0.0) for state in State}
    assert len({each.word for each in shown.values()}) == len(State)
    lost = standing("no link", State.RUNNING, "", 3.0)
    assert lost.word == texts.NO_LINK
    assert lost.shape not in {each.shape for each in shown.values()}
    for state in (State.RUNNING, State.ARMED, State.HALTED, State.IDLE):
        others = [each for other, each in shown.items() if other is not state and each.shape == shown[state].shape]
        assert all(each.word != shown[state].word for each in others)
    assert len({shown[state].shape for state in (State.IDLE, State.ARMED, State.RUNNING, State.HALTED)}) == 4


@pytest.fixture
def link(window: Window, spoken: type[SpokenLink]) -> SpokenLink:
    window._controller.start(order(Path("never")))
    return spoken.latest


def test_state_step_time_and_inputs_are_shown(window: Window, link: SpokenLink) -> None:
    header = window.header
    link.said = [
        Told(StateChanged(State.ARMED, State.RUNNING, "the sine begins", time=1.0)),
        Told(StepStarted("bare frame at 16 rad/s", time=1.0)),
        Told(Progress(0.25, 125.0, "settling", time=1.0)),
        SafetyInputs(1.0, {"end switch": True, "enable": False}),
    ]
    window._controller._look()
    assert (header.word.text(), header.lamp.shape) == ("RUNNING", "disc")
    assert header.reason.text() == "the sine begins"
    assert header.step.text() == "bare frame at 16 rad/s · settling"
    assert header.remaining.text() == "2:05"
    assert header.inputs.text() == "end switch good, enable OPEN"
    assert header.inputs.property("level") == "alarm"
    assert header.progress.value() == 250


def test_stop_stays_in_its_place_whatever_is_said(window: Window, link: SpokenLink, qtbot: QtBot) -> None:
    window.resize(window.minimumSize())
    stop = window.header.stop
    place = stop.mapTo(window, stop.rect().topLeft())
    link.said = [
        Told(StepStarted("a step with very much to say " * 12, time=1.0)),
        Told(StateChanged(State.ARMED, State.WAITING, "a reason with very much to say " * 8, time=1.0)),
        Question(1, "Mount the spring, and look at it from every side. " * 3),
    ]
    window._controller._look()
    qtbot.waitUntil(window.prompt.isVisible)
    qtbot.wait(100)
    assert stop.mapTo(window, stop.rect().topLeft()) == place
    assert window.width() == window.minimumWidth()


def test_silence_is_shown_as_no_link(window: Window, link: SpokenLink) -> None:
    link.said = [Beat(State.RUNNING, "the sine begins", 1.0, 0, 0)]
    window._controller._look()
    link.standing, link.silence = "no link", 1.4
    window.header.refresh()
    assert (window.header.word.text(), window.header.lamp.shape) == ("NO LINK", "cross")
    assert "1.4 s" in window.header.reason.text()
    assert "emergency stop" in window.header.reason.text()
    assert "RUNNING" not in window.header.word.text()
    assert window._controller.armed, "what is not known counts as armed"


def test_a_dead_session_says_what_happened_and_what_to_do(window: Window, link: SpokenLink) -> None:
    link.said = [Refused("the session's process ended without a word (exit code -9)", failed=True)]
    window._controller._look()
    assert "exit code -9" in window.results.told.text()
    assert "Look at the bench" in window.results.told.text()
    assert (window.header.word.text(), window.header.lamp.shape) == (texts.FAILED_WORD, "cross")
    assert window.pages.currentWidget() is window.results
    assert not window._controller.running


def test_a_beat_tells_the_state_when_the_change_was_lost(window: Window, link: SpokenLink) -> None:
    link.said = [Beat(State.HALTED, "the end switch opened", 9.0, 12, 3)]
    window._controller._look()
    assert window.header.word.text() == "HALTED"
    assert "12 events and 3 blocks" in window.run.lost.text()


def test_closing_lets_go_and_asks_nothing(window: Window, link: SpokenLink) -> None:
    window.close()
    assert link.asked == ["leave"]


@pytest.mark.usefixtures("window")
def test_the_main_loop_keeps_the_link_alive(link: SpokenLink, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: link.beats >= 3, timeout=3000)
