"""A window on a link that a test speaks for; and one on real sessions."""

from collections.abc import Callable, Generator
from math import inf
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from bench.app import catalogue
from bench.app.catalogue import all_protocols
from bench.app.display.theme import LIGHT
from bench.app.gui.controller import Controller
from bench.app.gui.header import StopFilter
from bench.app.gui.palette import dress
from bench.app.gui.window import Window
from bench.app.ipc.messages import FromSession, PlanCheck
from tests.bench.app.ipc.experiment import SHAKING, bench
from tests.installed import installed

PROTOCOLS = tuple(each for each in all_protocols()[0] if each.name != SHAKING.name)
"""Those of the project."""


@pytest.fixture(scope="session", autouse=True)
def _shaking_is_installed(tmp_path_factory: pytest.TempPathFactory) -> Generator[None]:
    """The sessions of these tests are processes of their own, and find their protocol as they find every other."""
    entry_points = {catalogue.PROTOCOLS: {"shaking": "tests.bench.app.ipc.experiment:SHAKING"}}
    with installed(tmp_path_factory.mktemp("shaking"), "rockbench-shaking", entry_points):
        yield


class ScriptedClient:
    """Stands in for `bench.app.ipc.client.SessionClient`: says what the test says, and keeps what it was asked."""

    latest: "ScriptedClient"

    def __init__(self, assignment: PlanCheck, heard: Callable[[], None]) -> None:  # noqa: ARG002 - the timer looks anyway
        self.assignment = assignment
        self.said: list[FromSession] = []
        self.asked: list[object] = []
        self.status, self.silence, self.beats = "linked", 0.0, 0
        self.lives = True
        ScriptedClient.latest = self

    def alive(self) -> None:
        self.beats += 1

    def ask(self, end: str) -> None:
        self.asked.append(end)

    def answer(self, number: int, *, agreed: bool) -> None:
        self.asked.append((number, agreed))

    def leave(self) -> None:
        self.asked.append("leave")

    def take(self) -> list[FromSession]:
        said, self.said = self.said, []
        return said


@pytest.fixture(autouse=True)
def _messages_are_handled_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a slow machine too, one call of `_look` handles all that a test has put."""
    monkeypatch.setattr("bench.app.gui.controller.BUDGET", inf)


@pytest.fixture
def spoken(monkeypatch: pytest.MonkeyPatch) -> type[ScriptedClient]:
    monkeypatch.setattr("bench.app.gui.controller.SessionClient", ScriptedClient)
    # the client of an earlier test in this process
    monkeypatch.delattr(ScriptedClient, "latest", raising=False)
    return ScriptedClient


class NoPlots(QWidget):
    """Stands in for the pages with plots, which take most of the time that a window needs to come."""

    def __init__(self, *_given: object) -> None:
        super().__init__()
        self.predicted: list[object] = []

    def predict(self, prediction: object) -> None:
        self.predicted.append(prediction)

    def reuse_through(self, setup: object) -> None: ...


@pytest.fixture
def without_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    for page in ("RunPage", "ResultsPage"):
        monkeypatch.setattr(f"bench.app.gui.window.{page}", NoPlots)


@pytest.fixture
def without_live_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.app.gui.window.RunPage", NoPlots)


@pytest.fixture
def window(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Generator[Window, None, None]:
    """The window, in front, with the filter of STOP that the application has."""
    # built without a theme, as by the program: with one, every insertion of a widget would style its children again
    qapp.setStyleSheet("")
    controller = Controller()
    shown = Window(controller, bench(), (SHAKING, *PROTOCOLS), LIGHT)
    dress(qapp, LIGHT)
    key = StopFilter(controller, shown.header.stop)
    qapp.installEventFilter(key)
    shown.protocol.folder.setText(str(tmp_path / "run"))
    qtbot.addWidget(shown)
    shown.show()
    with qtbot.waitActive(shown):
        shown.activateWindow()
    yield shown
    qapp.removeEventFilter(key)
    shown.leave()
