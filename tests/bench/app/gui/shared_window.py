"""One window for one test after the other. Building and styling a window takes most of the time of a test that presses
a few buttons, so a window is used again if, put back, it is to the last text and switch as it was at first.
"""

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from typing import TypeVar

from PySide6.QtCore import QCoreApplication, QEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QComboBox,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QProgressBar,
    QSpinBox,
    QTableWidget,
    QTabWidget,
    QWidget,
)

from bench.app.catalogue import all_protocols
from bench.app.display import texts
from bench.app.display.session_state import SessionState
from bench.app.display.theme import LIGHT, Theme
from bench.app.gui import window as parts
from bench.app.gui.controller import Controller
from bench.app.gui.header import application
from bench.app.gui.palette import dress
from bench.app.gui.results_page import ResultsPage
from bench.app.gui.window import FIRST, Window
from bench.app.queue.queue import Queue, Queued
from tests.bench.app.gui.run_files import close_files, settle
from tests.bench.app.ipc.experiment import SHAKING, bench

PROTOCOLS = tuple(each for each in all_protocols()[0] if each.name != SHAKING.name)
"""Those of the project."""

Page = TypeVar("Page", bound=QWidget)
Kind = tuple[object, ...]
Looks = list[tuple[object, ...]]


@contextmanager
def page_alone(kind: Callable[[Controller, Theme], Page], height: int) -> Generator[Page]:
    """A page without its window, with a controller of its own; not shown yet."""
    controller = Controller()
    page = kind(controller, LIGHT)
    page.resize(1200, height)
    yield page
    controller.close()
    page.close()
    page.deleteLater()


class NoPlots(QWidget):
    """Stands in for the pages with plots, which take most of the time that a window needs to come."""

    def __init__(self, *_given: object) -> None:
        super().__init__()
        self.predicted: list[object] = []

    def predict(self, prediction: object) -> None:
        self.predicted.append(prediction)

    def use_theme(self, theme: object) -> None: ...

    def reuse_through(self, setup: object) -> None: ...


def delete_closed() -> None:
    """Delete the windows that were closed, as Qt does in its next main loop: whoever lives takes a new style too."""
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@contextmanager
def undressed() -> Generator[None]:
    """Within, windows are built without a theme, as by the program: with one, every insertion of a widget would style
    its children again. Beside another window, which takes longer to undress and to dress than a new one takes to be
    built in its theme, the theme stays.
    """
    running = application()
    if any(each.isVisible() for each in running.topLevelWidgets()):
        yield
        return
    running.setStyleSheet("")
    try:
        yield
    finally:
        dress(running, LIGHT)


class _Shared:
    """The window that is kept, shown, between two tests."""

    def __init__(self) -> None:
        self.window: Window | None = None
        self._kind: Kind = ()
        self._first: Looks = []

    def take(self) -> Window:
        """A window as new, shown, with the pages that the module of the window has now."""
        kind = (parts.RunPage, parts.ResultsPage)
        shown = self.window if kind == self._kind else None
        if shown is not None:
            # a replaced part of the application that the window had noticed is in place again
            shown.activateWindow()
            shown._controller.changed.emit()
            QApplication.processEvents()
        if shown is None or _looks(shown) != self._first:
            self.close()
            with undressed():
                shown = Window(Controller(), bench(), (SHAKING, *PROTOCOLS), LIGHT)
            shown.show()
            QApplication.processEvents()
            self.window, self._kind, self._first = shown, kind, _looks(shown)
        return shown

    def give_back(self) -> None:
        """Put the window back, or close it if it is closed already."""
        if self.window is not None and not _put_back(self.window):
            self.close()

    def close(self) -> None:
        if self.window is not None:
            self.window.leave()
            self.window.deleteLater()
            self.window = None
            delete_closed()


SHARED = _Shared()


def _put_back(window: Window) -> bool:
    """End whatever a test has begun, and undo the usual; False if the window was closed."""
    controller, page, runner = window._controller, window.protocol, window.runner
    if not window.isVisible():
        return False
    runner.pause()
    for by in list(controller._plan_checks):
        controller.cancel_check(by)
    if controller._link is not None:
        controller._link.leave()
    controller._link, controller._running, controller.latched, controller.elsewhere = None, False, False, None
    controller.session = SessionState()
    controller._waiting.clear()
    controller.question_changed.emit(None)
    runner.queue, runner._begun, runner.why, runner.configuration = Queue(), None, "", bench()
    runner._check.forget()
    runner.changed.emit()
    window.queue.copies.setValue(1)
    window.prompt._operator_event = None
    window.sounds._left, window.sounds._aborted = 0, False
    page._began, page._made = False, None
    page.leave_editing()
    page.leave.hide()
    page._forms.clear()
    page.choice.setCurrentIndex(0)
    page._choose(0)
    page._show_plan()
    page.options.load(Queued(protocol=SHAKING.name, realtime=True))
    setup = window.setup
    if (setup.configuration, setup.path, setup.source.property("level")) != (bench(), None, "calm"):
        setup._given, setup._notices, setup.path = bench(), (), None
        setup.use_given()
    if isinstance(window.run, NoPlots):
        window.run.predicted.clear()
    if isinstance(window.results, ResultsPage):
        settle(window.results)
        if window.results.files.count():
            close_files(window.results)
        window.results.views.setCurrentWidget(window.results.browser)
        window.results.message.setText(texts.RESULTS_EMPTY)
    for panel in (window.prompt, window.trouble, window.leave_panel):
        panel.hide()
    window.resize(*FIRST)
    window.pages.setCurrentWidget(page)
    window.activateWindow()
    controller.changed.emit()
    QApplication.processEvents()
    return window.isVisible()


def _looks(window: Window) -> Looks:
    """What is written and set in every widget, and whether it can be seen and used; without panels that are hidden,
    which are filled when they are shown, and without the pages with plots, which begin anew with every run or file.
    """
    panels = (window.prompt, window.trouble, window.leave_panel, window.welcome, window.protocol.help)
    left_out = [window.run, window.results, *(panel for panel in panels if panel.isHidden())]
    looks = [
        (type(each).__name__, each.isVisibleTo(window), each.isEnabled(), each.toolTip(), *contents)
        for each in window.findChildren(QWidget)
        if (contents := [*_contents(each)]) and not any(part.isAncestorOf(each) for part in left_out)
    ]
    return sorted(looks, key=str)


def _contents(widget: QWidget) -> Iterator[object]:
    if (level := widget.property("level")) is not None:
        yield level
    match widget:
        case QAbstractButton():
            yield from (widget.text(), widget.isChecked())
        case QLabel() | QLineEdit():
            yield widget.text()
        case QPlainTextEdit():
            yield widget.toPlainText()
        case QComboBox():
            yield from (widget.currentText(), widget.count())
        case QSpinBox() | QProgressBar():
            yield widget.value()
        case QTabWidget():
            yield widget.currentIndex()
        case QTableWidget():
            yield widget.rowCount()
        case _:
            pass
