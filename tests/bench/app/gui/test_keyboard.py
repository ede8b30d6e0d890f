"""Everything works from the keyboard: in the tab order or with a key of its own, and says what it does."""

from collections import Counter
from pathlib import Path

import pytest
from PySide6.QtCore import QByteArray, QSettings, Qt
from PySide6.QtGui import QShortcut
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QPlainTextEdit,
    QScrollBar,
    QSplitter,
    QTabBar,
    QWidget,
)
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.display.theme import DARK, LIGHT
from bench.app.gui.controller import Controller
from bench.app.gui.header import StopButton
from bench.app.gui.window import Window
from bench.app.ipc.messages import Question
from bench.app.queue.queue import Queued
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.gui.shared_window import PROTOCOLS, undressed
from tests.bench.app.ipc.experiment import SHAKING, bench, order
from tests.patience import LONG_MS

OPERATED = (QAbstractButton, QLineEdit, QComboBox, QAbstractSpinBox, QAbstractItemView, QPlainTextEdit, QTabBar)
MANY = 200


def _operated(window: Window) -> list[QWidget]:
    """What a person could click on now, parts of other widgets left out."""
    found = [each for each in window.findChildren(QWidget) if isinstance(each, OPERATED)]
    inner = (QAbstractSpinBox, QComboBox, QAbstractItemView, QTabBar)
    return [
        each
        for each in found
        if each.isVisible() and each.isEnabled() and not isinstance(each.parent(), inner) and _outside_lists(each)
    ]


def _outside_lists(widget: QWidget) -> bool:
    parent = widget.parent()
    while parent is not None:
        if isinstance(parent, QAbstractItemView | QScrollBar | QComboBox):
            return False
        parent = parent.parent()
    return True


@pytest.fixture
def ready(window: Window) -> Window:
    """Something is in every list."""
    for _ in range(3):
        window.runner.do(lambda: window.runner.queue.add(Queued(protocol="shaking", parameters={"cycles": 5})))
    return window


@pytest.mark.parametrize("page", range(len(texts.PAGES)), ids=texts.PAGES)
def test_tab_reaches_whatever_has_no_key_of_its_own(page: int, ready: Window, qtbot: QtBot) -> None:
    ready.pages.setCurrentIndex(page)
    ready.pages.tabBar().setFocus()
    reached: set[QWidget] = set()
    for _ in range(MANY):
        focused = QApplication.focusWidget()
        assert focused is not None
        if focused in reached:
            break
        reached.add(focused)
        qtbot.keyClick(focused, Qt.Key.Key_Tab)
    else:
        pytest.fail("the focus does not come round")
    missed = [
        each.accessibleName() or each.text() if isinstance(each, QAbstractButton) else each.objectName() or repr(each)
        for each in _operated(ready)
        if each not in reached
        and not isinstance(each, StopButton)
        and not (isinstance(each, QAbstractButton) and _key_of(each))
        and not any(inner in reached for inner in each.findChildren(QWidget))
    ]
    assert missed == []


@pytest.mark.parametrize("page", range(len(texts.PAGES)), ids=texts.PAGES)
def test_no_key_is_claimed_twice_and_every_button_says_what_it_does(page: int, ready: Window) -> None:
    ready.pages.setCurrentIndex(page)
    # what comes and goes, all at once
    for part in (ready.prompt, ready.trouble, ready.protocol.leave, ready.header.clear):
        part.show()
    buttons = [each for each in ready.findChildren(QAbstractButton) if each.isVisible() and _outside_lists(each)]
    keys = Counter(key for each in buttons if (key := _key_of(each)))
    keys.update(f"Ctrl+{number + 1}" for number in range(len(texts.PAGES)))
    keys.update(["F12"])
    assert [key for key, times in keys.items() if times > 1] == []
    owned = [each for each in buttons if not isinstance(each.parent(), QTabBar) and each.text()]
    assert [each.text() for each in owned if not each.toolTip() and each.text() != texts.WELCOME_CLOSE] == []


def test_a_question_is_answered_by_a_key_of_its_own(window: Window, spoken: type[ScriptedClient], qtbot: QtBot) -> None:
    window._controller.start(order(Path("never")))
    spoken.latest.said = [Question(3, "Clamp the table to the ground.")]
    window._controller._look()
    for key in (Qt.Key.Key_Return, Qt.Key.Key_Space, Qt.Key.Key_Escape):
        qtbot.keyClick(window.run, key)
    qtbot.wait(150)
    assert spoken.latest.asked == []
    qtbot.waitUntil(window.prompt.done.isEnabled, timeout=LONG_MS)
    both = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier
    with qtbot.waitSignal(window.prompt.done.clicked, timeout=LONG_MS):
        qtbot.keyClick(window.run, Qt.Key.Key_Return, both)
    assert spoken.latest.asked == [(3, True)]


def test_a_layout_is_remembered(qtbot: QtBot, tmp_path_factory: pytest.TempPathFactory) -> None:
    settings = QSettings(str(tmp_path_factory.mktemp("kept") / "kept.ini"), QSettings.Format.IniFormat)

    def opened() -> Window:
        with undressed():
            window = Window(Controller(), bench(), (SHAKING, *PROTOCOLS), LIGHT, settings=settings)
        qtbot.addWidget(window)
        window.show()
        return window

    first = opened()
    # a size that the screen of the tests allows again
    first.resize(780, 700)
    qtbot.wait(50)
    splitters = first.setup.findChildren(QSplitter)
    first.pages.setCurrentWidget(first.setup)
    for splitter in splitters:
        splitter.setSizes([splitter.width() // 3, 2 * splitter.width() // 3])
    qtbot.wait(50)
    sizes = [splitter.sizes() for splitter in splitters]
    first.close()
    assert isinstance(settings.value("geometry"), QByteArray)
    again = opened()
    again.pages.setCurrentWidget(again.setup)
    qtbot.wait(50)
    for splitter, kept in zip(again.setup.findChildren(QSplitter), sizes, strict=True):
        # the window is as large as the screen allows
        shares = [size / sum(splitter.sizes()) for size in splitter.sizes()]
        assert shares == pytest.approx([size / sum(kept) for size in kept], abs=0.03)
    again.close()


def test_the_window_takes_another_theme_while_it_is_open(window: Window) -> None:
    before = window.header.lamp.grab().toImage()
    window.use_theme(DARK)
    after = window.header.lamp.grab().toImage()
    centre = before.width() // 2
    assert before.pixelColor(centre, 8).name() == LIGHT.calm
    assert after.pixelColor(centre, 8).name() == DARK.calm


def _key_of(button: QAbstractButton) -> str:
    """The key that was given to the button; empty when none was."""
    given = button.findChild(QShortcut)
    return given.key().toString() if isinstance(given, QShortcut) else ""
