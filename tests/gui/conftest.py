"""A window on a link that a test speaks for; and one on real sessions."""

from collections.abc import Generator
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from bench.cli.catalogue import CATALOGUE, Entry
from bench.gui.app import dress
from bench.gui.controller import Controller
from bench.gui.palette import LIGHT
from bench.gui.stop import StopKey
from bench.gui.window import Window
from bench.link.messages import FromSession, Survey
from tests.link.experiment import Shaking, ShakingParameters, bench

SHAKING = Entry(
    name="shaking", summary="One sine.", details="For tests.", parameters=ShakingParameters, campaign=Shaking
)


class SpokenLink:
    """Stands in for `bench.link.client.Link`: says what the test says, and keeps what it was asked."""

    latest: "SpokenLink"

    def __init__(self, assignment: Survey) -> None:
        self.assignment = assignment
        self.said: list[FromSession] = []
        self.asked: list[object] = []
        self.standing, self.silence, self.beats = "linked", 0.0, 0
        SpokenLink.latest = self

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


@pytest.fixture
def spoken(monkeypatch: pytest.MonkeyPatch) -> type[SpokenLink]:
    monkeypatch.setattr("bench.gui.controller.Link", SpokenLink)
    return SpokenLink


@pytest.fixture
def window(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Generator[Window, None, None]:
    """The window, in front, with the key filter that the application has."""
    before = qapp.styleSheet()
    dress(qapp, LIGHT)
    controller = Controller()
    key = StopKey(controller)
    qapp.installEventFilter(key)
    shown = Window(controller, bench(), (SHAKING, *CATALOGUE), LIGHT)
    shown.protocol.folder.setText(str(tmp_path / "run"))
    qtbot.addWidget(shown)
    shown.show()
    with qtbot.waitActive(shown):
        shown.activateWindow()
    yield shown
    qapp.removeEventFilter(key)
    shown.close()
    qapp.setStyleSheet(before)
