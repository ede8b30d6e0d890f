"""STOP: from everywhere, behind a dialog too, at once; it latches, and nothing else starts a run again."""

from pathlib import Path

import pytest
from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialog, QLineEdit, QVBoxLayout
from pytestqt.qtbot import QtBot

from bench.events import State
from bench.gui import texts
from bench.gui.controller import DELIBERATE
from bench.gui.stop import KEY
from bench.gui.window import Window
from bench.link.messages import Beat, Ended
from tests.gui.conftest import SpokenLink
from tests.link.experiment import order


@pytest.fixture
def link(window: Window, spoken: type[SpokenLink]) -> SpokenLink:
    """A run under way, the table moving."""
    window._controller.start(order(Path("never")))
    spoken.latest.said.append(Beat(State.RUNNING, "a test", 1.0, 0, 0))
    window._controller._look()
    return spoken.latest


def test_the_button_aborts_and_the_next_press_halts(window: Window, link: SpokenLink, qtbot: QtBot) -> None:
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
    qtbot.wait(round(1000 * DELIBERATE) + 20)
    assert stop.fontMetrics().horizontalAdvance(max(stop.text().splitlines(), key=len)) < stop.width()
    qtbot.mousePress(stop, Qt.MouseButton.LeftButton)
    assert link.asked == ["abort", "halt"]
    assert stop.isEnabled()
    assert stop.geometry() == place


@pytest.mark.parametrize("page", range(len(texts.PAGES)))
def test_the_key_works_on_every_page(page: int, window: Window, link: SpokenLink, qtbot: QtBot) -> None:
    window.pages.setCurrentIndex(page)
    qtbot.keyClick(QApplication.focusWidget() or window, KEY)
    assert link.asked == ["abort"]


def test_the_key_works_behind_a_modal_dialog(window: Window, link: SpokenLink, qtbot: QtBot) -> None:
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


def test_a_press_counts_beside_a_list_that_is_open(window: Window, link: SpokenLink, qtbot: QtBot) -> None:
    """As the window system delivers it: to whatever has the mouse then, which is the list."""
    window.pages.setCurrentWidget(window.protocol)
    handle, stop = window.windowHandle(), window.header.stop
    window.protocol.choice.showPopup()
    qtbot.waitUntil(lambda: QApplication.activePopupWidget() is not None)
    beside = window.header.lamp
    for part, asked in ((stop, ["abort"]), (beside, ["abort"])):
        QTest.mouseClick(handle, Qt.MouseButton.LeftButton, pos=part.mapTo(window, part.rect().center()))
        QApplication.processEvents()
        assert link.asked == asked
        window.protocol.choice.showPopup()
    window.protocol.choice.hidePopup()


def test_a_key_that_is_held_counts_once(window: Window, link: SpokenLink, qapp: QApplication) -> None:
    for again in (False, True, True, True):
        event = QKeyEvent(QEvent.Type.KeyPress, KEY, Qt.KeyboardModifier.NoModifier, "", again)
        qapp.sendEvent(window, event)
    assert link.asked == ["abort"]


def test_stop_latches_until_it_is_cleared_elsewhere(
    window: Window, link: SpokenLink, qtbot: QtBot, spoken: type[SpokenLink]
) -> None:
    protocol, controller = window.protocol, window._controller
    qtbot.keyClick(window, KEY)
    controller.clear_stop()
    assert controller.latched, "not while the stopped run is under way"
    link.said.append(Ended("aborted", "abort was asked for", {}, "", link.assignment.out))
    controller._look()
    assert protocol.why_not == texts.LATCHED
    assert texts.LATCHED in protocol.start.toolTip()
    controller.start(link.assignment)  # type: ignore[arg-type]
    assert spoken.latest is link
    window.pages.setCurrentWidget(protocol)
    qtbot.mouseClick(protocol.clear, Qt.MouseButton.LeftButton)
    assert protocol.why_not == texts.START_UNCHECKED


@pytest.mark.parametrize("key", [Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Escape])
def test_no_other_key_stops_or_starts(key: Qt.Key, window: Window, link: SpokenLink, qtbot: QtBot) -> None:
    for page in range(len(texts.PAGES)):
        window.pages.setCurrentIndex(page)
        qtbot.keyClick(QApplication.focusWidget() or window, key)
    assert link.asked == []
    assert window.header.stop.focusPolicy() == Qt.FocusPolicy.NoFocus
    assert window.protocol.start.focusPolicy() == Qt.FocusPolicy.NoFocus


def test_stop_without_a_run_latches_too(window: Window, qtbot: QtBot) -> None:
    qtbot.keyClick(window, KEY)
    assert window._controller.latched
    assert window.protocol.why_not == texts.LATCHED
