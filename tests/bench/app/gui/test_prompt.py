"""A question cannot be answered unread, and says of each kind of work what really follows."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from bench.app.gui.panels import TASKS, UNKNOWN_TASK
from bench.app.gui.window import Window
from bench.app.ipc.messages import Published, Question
from bench.events import OperatorAsked, State, StateChanged
from drivers.rig import OperatorTask
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.ipc.experiment import order
from tests.patience import LONG_MS

pytestmark = pytest.mark.usefixtures("without_plots")

BOTH = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier
STILL = (OperatorTask.LOCK_TABLE, OperatorTask.WATCH_BLOCK, OperatorTask.TILT_BLOCK, OperatorTask.PULL_FRAME)
"""Work after which nothing is driven."""


@pytest.fixture
def link(window: Window, spoken: type[ScriptedClient]) -> ScriptedClient:
    window._controller.start(order(Path("never")))
    return spoken.latest


def _ask(window: Window, link: ScriptedClient, number: int, work: OperatorTask | None = None) -> None:
    request = f"Do thing {number}."
    link.said = [Published(OperatorAsked(request, work, time=1.0)), Question(number, request)]
    window._controller._look()


def _hold(window: Window, *, again: bool) -> None:
    QTest.simulateEvent(window, True, Qt.Key.Key_Return, BOTH, "", again, -1)


def test_a_key_that_is_held_answers_no_question_unread(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    _ask(window, link, 1)
    _hold(window, again=False)
    qtbot.mouseClick(window.prompt.done, Qt.MouseButton.LeftButton)
    qtbot.mouseClick(window.prompt.decline, Qt.MouseButton.LeftButton)
    assert link.asked == [], "it has only just appeared"
    qtbot.waitUntil(window.prompt.done.isEnabled, timeout=LONG_MS)
    for _ in range(5):
        _hold(window, again=True)
        QApplication.processEvents()
    qtbot.wait(150)
    assert link.asked == [], "the key was held since before it could be answered"
    _hold(window, again=False)
    qtbot.waitUntil(lambda: link.asked == [(1, True)], timeout=LONG_MS)
    _ask(window, link, 2)
    assert not window.prompt.done.isEnabled(), "the next one has not been read either"
    assert not window.prompt.decline.isEnabled()


@pytest.mark.parametrize("work", [*OperatorTask, None])
def test_every_kind_of_work_says_why_and_what_is_checked(
    work: OperatorTask | None, window: Window, link: ScriptedClient
) -> None:
    _ask(window, link, 1, work)
    why, checked = (part.text() for part in window.prompt.parts)
    assert why.startswith("Why: ")
    assert checked.startswith("Checked afterwards: ")
    told = UNKNOWN_TASK if work is None else TASKS[work]
    assert (told[0] in why, told[1] in checked) == (True, True)
    if work in STILL:
        assert "may" not in checked, "nothing is driven after it"
    # another question than the event spoke of says nothing of its work
    link.said = [Question(2, "Something else.")]
    window._controller._look()
    assert UNKNOWN_TASK[1] in window.prompt.parts[1].text()


def test_a_question_is_inline_and_answered_once(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    link.said = [
        Published(StateChanged(State.IDLE, State.WAITING, "a question", time=1.0)),
        Question(7, "Mount the spring of beta = 0.4."),
    ]
    window._controller._look()
    assert window.prompt.isVisible()
    assert window.prompt.request.text() == "Mount the spring of β = 0.4."
    assert QApplication.activeModalWidget() is None
    qtbot.waitUntil(window.prompt.done.isEnabled, timeout=LONG_MS)
    qtbot.mouseClick(window.prompt.done, Qt.MouseButton.LeftButton)
    qtbot.mouseClick(window.prompt.done, Qt.MouseButton.LeftButton)
    assert link.asked == [(7, True)]
    assert not window.prompt.isVisible()


def test_a_question_goes_when_the_bench_no_longer_waits(window: Window, link: ScriptedClient) -> None:
    link.said = [Question(1, "Stand the block up.")]
    window._controller._look()
    link.said = [Published(StateChanged(State.WAITING, State.HALTED, "halt requested", time=1.0))]
    window._controller._look()
    assert not window.prompt.isVisible()
