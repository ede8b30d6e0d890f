"""An error of the window: told in its own thread, once, and never in place of what is wrong at the bench."""

import signal
import sys
import threading
from collections.abc import Generator

import pytest
from PySide6.QtCore import QThread
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from bench.app.display.theme import LIGHT
from bench.app.display.trouble import Trouble
from bench.app.gui.controller import Controller
from bench.app.gui.header import KEY
from bench.app.gui.trouble import TroublePanel
from bench.app.gui.window import Window, attend
from tests.bench.app.gui.shared_window import undressed
from tests.bench.app.ipc.experiment import SHAKING, bench
from tests.patience import LONG_MS

pytestmark = pytest.mark.usefixtures("without_plots", "spoken")


@pytest.fixture
def heard(window: Window, qapp: QApplication, monkeypatch: pytest.MonkeyPatch) -> Generator[list[str], None, None]:
    """What the hooks that were there before heard."""
    said: list[str] = []
    monkeypatch.setattr(sys, "excepthook", lambda _kind, error, _trace: said.append(str(error)))
    monkeypatch.setattr(threading, "excepthook", lambda given: said.append(str(given.exc_value)))
    before = signal.getsignal(signal.SIGINT)
    undo = attend(window, window._controller, qapp)
    yield said
    undo()
    assert signal.getsignal(signal.SIGINT) is before


def _raise(text: str) -> None:
    error = ValueError(text)
    sys.excepthook(ValueError, error, None)


def _fail() -> None:
    raise ValueError("in a thread")


def test_an_error_in_a_thread_is_told_in_the_thread_of_the_window(
    window: Window, heard: list[str], qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    threads: list[bool] = []
    shown = TroublePanel.show_trouble

    def show(panel: TroublePanel, trouble: Trouble) -> None:
        threads.append(QThread.currentThread() is panel.thread())
        shown(panel, trouble)

    monkeypatch.setattr(TroublePanel, "show_trouble", show)
    for target in (lambda: _raise("anywhere"), _fail):
        window.trouble.hide()
        worker = threading.Thread(target=target)
        worker.start()
        worker.join()
        assert not window.trouble.isVisible(), "not from another thread"
        qtbot.waitUntil(window.trouble.isVisible, timeout=LONG_MS)
    assert threads == [True, True]
    assert heard == ["anywhere", "in a thread"]
    assert "ValueError: in a thread" in window.trouble.answers[0].text()


def test_the_same_error_is_told_once_and_never_in_place_of_the_bench(
    window: Window, heard: list[str], qtbot: QtBot
) -> None:
    notices: list[object] = []
    window._controller.noticed.connect(notices.append)
    window.trouble.show_trouble(Trouble("the relay opened", "cut", "look"))
    for _ in range(3):
        _raise("again")
    qtbot.wait(20)
    assert heard == ["again"] * 3
    assert len(notices) == 1
    assert window.trouble.answers[0].text() == "the relay opened"
    window.trouble.hide()
    _raise("again")
    qtbot.wait(20)
    assert not window.trouble.isVisible()
    _raise("another")
    qtbot.waitUntil(window.trouble.isVisible, timeout=LONG_MS)


def test_the_program_has_the_filter_of_stop(qtbot: QtBot, qapp: QApplication) -> None:
    controller = Controller()
    with undressed():
        shown = Window(controller, bench(), (SHAKING,), LIGHT)
    qtbot.addWidget(shown)
    undo = attend(shown, controller, qapp)
    shown.show()
    qtbot.keyClick(shown, KEY)
    undo()
    assert controller.latched
    controller.clear_stop()
    qtbot.keyClick(shown, KEY)
    assert not controller.latched, "it was taken away again"
    shown.close()
