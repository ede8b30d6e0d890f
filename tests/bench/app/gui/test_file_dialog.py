"""A dialog for files blocks nothing, and none stands open while a run or the queue is under way."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.gui.window import Window
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.ipc.experiment import order

pytestmark = pytest.mark.usefixtures("without_live_plots")


def _opened(window: Window, qtbot: QtBot, which: str) -> QFileDialog:
    page = window.results if which == "open_results" else window.setup
    button = window.results.open_file if which == "open_results" else getattr(window.setup, which)
    window.pages.setCurrentWidget(page)
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    dialog = page.findChild(QFileDialog)
    assert isinstance(dialog, QFileDialog)
    assert dialog.isVisible()
    return dialog


WHICH = pytest.mark.parametrize("which", ["open_file", "open_specimen", "open_results"])


@WHICH
def test_stop_can_be_clicked_while_a_dialog_is_open(
    which: str, window: Window, qtbot: QtBot, spoken: type[ScriptedClient]
) -> None:
    dialog = _opened(window, qtbot, which)
    assert QApplication.activeModalWidget() is None
    stop = window.header.stop
    place = stop.mapTo(window, stop.rect().center())
    QTest.mousePress(window.windowHandle(), Qt.MouseButton.LeftButton, pos=place)
    QApplication.processEvents()
    assert window._controller.latched
    dialog.reject()
    assert not hasattr(spoken, "latest") or spoken.latest.asked == []


@WHICH
@pytest.mark.usefixtures("spoken")
def test_a_run_that_begins_shuts_it_and_none_can_be_opened(which: str, window: Window, qtbot: QtBot) -> None:
    dialog = _opened(window, qtbot, which)
    window._controller.start(order(Path("never")))
    assert not dialog.isVisible()
    for button in (window.setup.open_file, window.setup.open_specimen, window.results.open_file):
        assert not button.isEnabled()
        assert texts.START_BUSY in button.toolTip()


def test_the_queue_holds_it_too(window: Window, qtbot: QtBot, tmp_path: Path) -> None:
    dialog = _opened(window, qtbot, "open_results")
    window._controller.held = texts.QUEUE_HOLDS
    dialog.filesSelected.emit([str(tmp_path / "late.h5")])
    assert window.results.message.text() == texts.RESULTS_EMPTY, "chosen too late"
    window._controller.changed.emit()
    assert not dialog.isVisible()
    assert not window.results.open_file.isEnabled()
