"""Beeps for a question, the end of a run and an abort."""

from pathlib import Path

import pytest
from PySide6.QtCore import QSettings, Qt
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from bench.app.display.theme import LIGHT
from bench.app.gui.controller import Controller
from bench.app.gui.sound import ABORT, END, INTERVAL, QUESTION, Sounds
from bench.app.gui.window import Window
from bench.app.ipc.messages import Ended, Question, Refused
from bench.events import State, StateChanged
from tests.bench.app.gui.shared_window import PROTOCOLS, undressed
from tests.bench.app.ipc.experiment import bench, order
from tests.patience import LONG_MS

pytestmark = pytest.mark.usefixtures("qapp")

ABORTING = StateChanged(State.RUNNING, State.ABORTING, "abort requested", time=1.0)


@pytest.fixture
def beeps(monkeypatch: pytest.MonkeyPatch) -> list[None]:
    heard: list[None] = []
    monkeypatch.setattr(QApplication, "beep", lambda: heard.append(None))
    return heard


@pytest.fixture
def controller() -> Controller:
    return Controller()


@pytest.fixture
def sounds(controller: Controller) -> Sounds:
    return Sounds(controller, controller)


def _ended(status: str) -> Ended:
    return Ended(status, "reason", {}, "", Path("never"))


def _settled(qtbot: QtBot, beeps: list[None], number: int) -> None:
    qtbot.waitUntil(lambda: len(beeps) >= number, timeout=LONG_MS)
    qtbot.wait(2 * INTERVAL)
    assert len(beeps) == number


@pytest.mark.usefixtures("sounds")
def test_each_occasion_has_its_number_of_beeps(controller: Controller, beeps: list[None], qtbot: QtBot) -> None:
    controller.began.emit(order(Path("never")))
    controller.question_changed.emit(Question(1, "Mount the spring."))
    controller.question_changed.emit(None)
    _settled(qtbot, beeps, QUESTION)
    controller.ended.emit(_ended("completed"))
    _settled(qtbot, beeps, QUESTION + END)
    controller.began.emit(order(Path("never")))
    controller.ended.emit(Refused("no room", failed=True))
    _settled(qtbot, beeps, QUESTION + END + ABORT)


@pytest.mark.usefixtures("sounds")
def test_an_abort_is_heard_when_it_begins_and_once(controller: Controller, beeps: list[None], qtbot: QtBot) -> None:
    controller.began.emit(order(Path("never")))
    controller.question_changed.emit(Question(1, "Mount the spring."))
    controller.event_received.emit(ABORTING)
    controller.event_received.emit(ABORTING)
    controller.ended.emit(_ended("aborted"))
    _settled(qtbot, beeps, QUESTION + ABORT)


def test_a_muted_window_is_silent_and_stays_so(
    controller: Controller, sounds: Sounds, beeps: list[None], qtbot: QtBot
) -> None:
    sounds.muted = True
    controller.event_received.emit(ABORTING)
    qtbot.wait(2 * INTERVAL)
    assert beeps == []


@pytest.mark.usefixtures("without_plots", "spoken")
def test_the_switch_is_kept(qtbot: QtBot, tmp_path: Path, beeps: list[None]) -> None:
    settings = QSettings(str(tmp_path / "kept.ini"), QSettings.Format.IniFormat)

    def opened() -> Window:
        with undressed():
            window = Window(Controller(), bench(), PROTOCOLS, LIGHT, settings=settings)
        qtbot.addWidget(window)
        window.show()
        window.pages.setCurrentWidget(window.setup)
        return window

    first = opened()
    assert first.setup.sounds.isChecked()
    first._controller.question_changed.emit(Question(1, "Mount the spring."))
    assert len(beeps) == QUESTION
    qtbot.mouseClick(first.setup.sounds, Qt.MouseButton.LeftButton)
    first.leave()
    second = opened()
    assert not second.setup.sounds.isChecked()
    second._controller.question_changed.emit(Question(2, "Mount the spring."))
    assert len(beeps) == QUESTION
