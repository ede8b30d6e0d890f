"""STOP: from everywhere, behind a dialog too, at once; it latches, and nothing else starts a run again."""

from pathlib import Path

import pytest
from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialog, QLineEdit, QVBoxLayout
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.gui.controller import DELIBERATE
from bench.app.gui.header import KEY
from bench.app.gui.window import Window
from bench.app.ipc.messages import Beat, Ended
from bench.events import State
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.ipc.experiment import order
from tests.patience import LONG_MS

NO_PLOTS = pytest.mark.usefixtures("without_plots")


@pytest.fixture
def link(window: Window, spoken: type[ScriptedClient]) -> ScriptedClient:
    """A run under way, the table moving."""
    window._controller.start(order(Path("never")))
    spoken.latest.said.append(Beat(State.RUNNING, "a test", 1.0, 0, 0))
    window._controller._look()
    return spoken.latest


@NO_PLOTS
def test_the_button_aborts_and_the_next_press_halts(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    stop = window.header.stop
    place = stop.geometry()
    qtbot.mousePress(stop, Qt.MouseButton.LeftButton)
    assert link.asked == ["abort"]
    assert stop.text() == texts.STOP_AGAIN
    assert stop.text().startswith("STOP"), "it is never called anything else"
    qtbot.mouseRelease(stop, Qt.MouseButton.LeftButton)
    # a double click is one press; and so is a key that bounces
    qtbot.mouseDClick(stop, Qt.MouseButton.LeftButton)
    qtbot.keyClick(window, KEY)
    assert link.asked == ["abort"]
    # a timer of Qt may end 5 % early
    qtbot.wait(round(1100 * DELIBERATE))
    assert stop.fontMetrics().horizontalAdvance(max(stop.text().splitlines(), key=len)) < stop.width()
    qtbot.mousePress(stop, Qt.MouseButton.LeftButton)
    assert link.asked == ["abort", "halt"]
    assert stop.isEnabled()
    assert stop.geometry() == place


@NO_PLOTS
def test_the_key_works_behind_a_modal_dialog(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    dialog = QDialog(window)
    field = QLineEdit()
    QVBoxLayout(dialog).addWidget(field)

    def press() -> None:
        field.setFocus()
        qtbot.keyClick(field, KEY)
        dialog.reject()

    QTimer.singleShot(50, press)
    dialog.exec()
    assert link.asked == ["abort"]


@NO_PLOTS
def test_a_press_counts_beside_a_list_that_is_open(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    """As the window system delivers it: to whatever has the mouse then, which is the list."""
    window.pages.setCurrentWidget(window.protocol)
    handle, stop = window.windowHandle(), window.header.stop
    window.protocol.choice.showPopup()
    qtbot.waitUntil(lambda: QApplication.activePopupWidget() is not None, timeout=LONG_MS)
    beside = window.header.lamp
    for part, asked in ((stop, ["abort"]), (beside, ["abort"])):
        QTest.mouseClick(handle, Qt.MouseButton.LeftButton, pos=part.mapTo(window, part.rect().center()))
        QApplication.processEvents()
        assert link.asked == asked
        window.protocol.choice.showPopup()
    window.protocol.choice.hidePopup()


@NO_PLOTS
def test_a_key_that_is_held_counts_once(window: Window, link: ScriptedClient, qapp: QApplication) -> None:
    for again in (False, True, True, True):
        event = QKeyEvent(QEvent.Type.KeyPress, KEY, Qt.KeyboardModifier.NoModifier, "", again)
        qapp.sendEvent(window, event)
    assert link.asked == ["abort"]


@NO_PLOTS
def test_stop_latches_until_it_is_cleared(
    window: Window, link: ScriptedClient, qtbot: QtBot, spoken: type[ScriptedClient]
) -> None:
    protocol, controller = window.protocol, window._controller
    qtbot.keyClick(window, KEY)
    controller.clear_stop()
    assert controller.latched, "not while the stopped run is under way"
    link.said.append(Ended("aborted", "abort requested", {}, "", link.assignment.out))
    controller._look()
    assert protocol.why_not == texts.LATCHED
    assert texts.LATCHED in protocol.start.toolTip()
    controller.start(link.assignment)  # type: ignore[arg-type]
    assert spoken.latest is link
    window.pages.setCurrentWidget(window.results)
    qtbot.mouseClick(window.header.clear, Qt.MouseButton.LeftButton)
    assert protocol.why_not == texts.START_UNCHECKED


@NO_PLOTS
def test_a_latched_stop_makes_the_bar_red_and_offers_to_clear_it(window: Window, qtbot: QtBot) -> None:
    header = window.header
    header.refresh()
    ground = header.grab().toImage().pixelColor(2, 2)
    assert not header.clear.isVisible()
    qtbot.keyClick(window, KEY)
    red = header.grab().toImage().pixelColor(2, 2)
    assert red != ground
    assert red.red() > 150 > 60 > max(red.green(), red.blue())
    assert "STOP was pressed" in header.reason.text()
    assert header.clear.isVisible()
    assert header.clear.isEnabled()
    qtbot.mouseClick(header.clear, Qt.MouseButton.LeftButton)
    assert header.grab().toImage().pixelColor(2, 2) == ground
    assert not window._controller.latched


@NO_PLOTS
def test_a_latched_stop_cannot_be_cleared_during_its_run(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    assert link.status == "linked"
    qtbot.keyClick(window, KEY)
    assert window.header.clear.isVisible()
    assert not window.header.clear.isEnabled()


@NO_PLOTS
def test_the_bar_says_when_the_key_needs_the_focus(
    window: Window, qapp: QApplication, monkeypatch: pytest.MonkeyPatch
) -> None:
    header = window.header
    header.refresh()
    assert header.stop.text() == texts.STOP
    assert "F12" not in header.reason.text()
    monkeypatch.setattr(qapp, "applicationState", lambda: Qt.ApplicationState.ApplicationInactive)
    qapp.applicationStateChanged.emit(Qt.ApplicationState.ApplicationInactive)
    assert "F12" not in header.stop.text()
    assert "F12 works only while this window has the focus" in header.reason.text()


@NO_PLOTS
def test_stop_without_a_run_latches_too(window: Window, qtbot: QtBot) -> None:
    qtbot.keyClick(window, KEY)
    assert window._controller.latched
    assert window.protocol.why_not == texts.LATCHED


@pytest.mark.parametrize("page", range(len(texts.PAGES)))
def test_the_key_works_on_every_page(page: int, window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    window.pages.setCurrentIndex(page)
    qtbot.keyClick(QApplication.focusWidget() or window, KEY)
    assert link.asked == ["abort"]


def test_no_other_key_stops_or_starts(window: Window, link: ScriptedClient, qtbot: QtBot) -> None:
    for key in (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Escape):
        for page in range(len(texts.PAGES)):
            window.pages.setCurrentIndex(page)
            qtbot.keyClick(QApplication.focusWidget() or window, key)
        assert link.asked == [], key
    assert window.header.stop.focusPolicy() == Qt.FocusPolicy.NoFocus
    assert window.protocol.start.focusPolicy() == Qt.FocusPolicy.NoFocus
