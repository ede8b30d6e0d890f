"""A window on a link that a test speaks for; and one on real sessions."""

from collections.abc import Callable, Generator
from math import inf
from pathlib import Path

import pytest
from pyqtgraph import GraphicsView, PlotItem
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from bench.app import catalogue
from bench.app.gui.header import StopFilter
from bench.app.gui.window import Window
from bench.app.ipc.messages import FromSession, PlanCheck
from tests.bench.app.gui.shared_window import SHARED, NoPlots, delete_closed
from tests.installed import installed


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

    def note(self, text: str, by: str) -> None:
        self.asked.append((text, by))

    def leave(self) -> None:
        self.asked.append("leave")

    def take(self) -> list[FromSession]:
        said, self.said = self.said, []
        return said


_show_grid = PlotItem.showGrid


@pytest.fixture(scope="package", autouse=True)
def _plots_have_no_grid() -> Generator[None]:
    """No test here looks at its lines, and Qt draws lines that are nearly transparent slowly: they take most of the
    time of a page with plots. The windows of `pixels` are those of another process; see also `grids`.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(PlotItem, "showGrid", lambda *_given, **_options: None)
        yield


@pytest.fixture(scope="package", autouse=True)
def _the_shared_window_is_closed() -> Generator[None]:
    yield
    SHARED.close()


@pytest.fixture(autouse=True)
def _closed_windows_are_deleted() -> Generator[None]:
    yield
    delete_closed()


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
    shown = SHARED.take()
    key = StopFilter(shown._controller, shown.header.stop)
    qapp.installEventFilter(key)
    shown.protocol.folder.setText(str(tmp_path / "run"))
    with qtbot.waitActive(shown):
        shown.activateWindow()
    yield shown
    qapp.removeEventFilter(key)
    SHARED.give_back()


@pytest.fixture
def grids(window: Window) -> Generator[None]:
    """For a test that measures how long the Run page takes: it is drawn as a person sees it."""
    views = window.run.findChildren(GraphicsView)
    plots = [item for view in views for item in view.scene().items() if isinstance(item, PlotItem)]
    assert plots
    for plot in plots:
        _show_grid(plot, x=True, y=True, alpha=0.25)
    yield
    for plot in plots:
        _show_grid(plot, x=False, y=False)
