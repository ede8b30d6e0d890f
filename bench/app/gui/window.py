"""The operator's window, with the header, the panels and the pages, and Qt's main loop."""

import signal
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

from PySide6.QtCore import QByteArray, QEvent, QObject, QSettings, QStandardPaths
from PySide6.QtGui import QCloseEvent, QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import (
    QAbstractItemView,
    QApplication,
    QMainWindow,
    QPlainTextEdit,
    QSplitter,
    QTabWidget,
    QTextEdit,
    QVBoxLayout,
    QWidget,
)

from bench.app.display import texts
from bench.app.display.theme import Theme
from bench.app.display.trouble import Trouble
from bench.app.gui.attach import SessionWatch
from bench.app.gui.background import end_reading as end_reading
from bench.app.gui.controller import Controller
from bench.app.gui.header import Header, StopFilter
from bench.app.gui.palette import chosen_theme, dress
from bench.app.gui.panels import LeavePanel, PanelArea, Prompt
from bench.app.gui.protocol_page import ProtocolPage
from bench.app.gui.queue_page import QueuePage
from bench.app.gui.queue_runner import QueueRunner
from bench.app.gui.results_page import ResultsPage
from bench.app.gui.run_page import RunPage
from bench.app.gui.setup_page import SetupPage
from bench.app.gui.sound import Sounds
from bench.app.gui.tour import Place, Tour
from bench.app.gui.trouble import OwnErrors, TroublePanel
from bench.app.ipc.messages import Run
from bench.app.queue.file import QueueFile
from bench.app.queue.queue import Queued
from bench.config.model import BenchConfiguration
from bench.protocol import Protocol
from sim.errors import RockbenchError


def remember(window: QMainWindow, pages: QTabWidget, settings: QSettings) -> None:
    """Store size and position of the window, and the positions of the splitters of its pages."""
    settings.setValue("geometry", window.saveGeometry())
    for key, splitter in _splitters(pages):
        settings.setValue(key, splitter.saveState())


def restore(window: QMainWindow, pages: QTabWidget, settings: QSettings) -> None:
    """Restore the stored layout; parts that were not stored, or no longer fit, stay unchanged."""
    kept = settings.value("geometry")
    if isinstance(kept, QByteArray):
        window.restoreGeometry(kept)
    for key, splitter in _splitters(pages):
        state = settings.value(key)
        if isinstance(state, QByteArray):
            splitter.restoreState(state)


def _splitters(pages: QTabWidget) -> list[tuple[str, QSplitter]]:
    """Each splitter with its name, composed of its page, its index on the page, and its number of parts."""
    return [
        (f"splitters/{pages.tabText(place)}/{number}-{splitter.count()}", splitter)
        for place in range(pages.count())
        if (page := pages.widget(place)) is not None
        for number, splitter in enumerate(page.findChildren(QSplitter))
    ]


def free_tab_key(whole: QWidget) -> None:
    """Make Tab move to the next field from everywhere, including lists and text fields."""
    for view in whole.findChildren(QAbstractItemView):
        view.setTabKeyNavigation(False)
    for kind in (QPlainTextEdit, QTextEdit):
        for text in whole.findChildren(kind):
            text.setTabChangesFocus(True)


SMALLEST = (500, 260)
"""Minimum size of the window [px]: a 1024x600 screen at 200 % scale, less the title bar."""
FIRST = (1280, 800)
_SOUNDS = "sounds"
"""Setting of the signal tones: on or off."""


class Window(QMainWindow):
    """The operator's window, whose parts communicate with the session through `controller`. `settings` stores the
    layout and the recent files, `queue` is the file of the queue, and `presets` the folder of the presets; if one of
    these is None, its contents are not stored. With `tour`, the guided tour is shown.
    """

    def __init__(
        self,
        controller: Controller,
        configuration: BenchConfiguration,
        entries: Sequence[Protocol[Any]],
        theme: Theme,
        *,
        path: Path | None = None,
        settings: QSettings | None = None,
        queue: Path | None = None,
        presets: Path | None = None,
        tour: bool = False,
    ) -> None:
        super().__init__()
        self._controller, self._settings = controller, settings
        self.setMinimumSize(*SMALLEST)
        self.resize(*FIRST)
        self._leaving = False
        self._goes_on = False
        self.sessions = SessionWatch(controller, self)
        self.header = Header(controller, theme, self.sessions.toggle)
        self.prompt, self.trouble = Prompt(controller), TroublePanel(controller)
        self.runner = self._runner(configuration, queue)
        self.setup = SetupPage(controller, configuration, path, theme, settings)
        self.protocol = ProtocolPage(controller, configuration, entries, tour, presets)
        # not in real time, so that the tour takes less than a minute
        self.protocol.realtime.setChecked(not tour)
        self.queue = QueuePage(controller, self.runner, entries)
        self.run, self.results = RunPage(controller, theme), ResultsPage(controller, theme)
        self.pages = QTabWidget()
        for number, (name, page) in enumerate(
            zip(texts.PAGES, (self.setup, self.protocol, self.queue, self.run, self.results), strict=True)
        ):
            self.pages.addTab(page, name)
            self.pages.setTabToolTip(number, f"Ctrl+{number + 1}")
            QShortcut(QKeySequence(f"Ctrl+{number + 1}"), self, partial(self.pages.setCurrentIndex, number))
        self.sounds = Sounds(controller, self)
        self.welcome = Tour(controller)
        if tour:
            self._guide()
        else:
            self.welcome.leave()
        self.leave_panel = LeavePanel(self.leave)
        for part in (self.prompt, self.trouble, self.leave_panel):
            part.installEventFilter(self)
        self.panels = PanelArea((self.leave_panel, self.prompt, self.trouble, self.welcome))
        whole = QWidget()
        column = QVBoxLayout(whole)
        column.setContentsMargins(6, 6, 6, 6)
        for part in (self.header, self.panels):
            column.addWidget(part)
        column.addWidget(self.pages, 1)
        self.setCentralWidget(whole)
        self.pages.setCurrentWidget(self.protocol)
        free_tab_key(whole)
        self._connect()
        self._update_title()
        if settings is not None:
            restore(self, self.pages, settings)
            self.setup.sounds.setChecked(settings.value(_SOUNDS, "on") == "on")

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        for part in (self.header, self.setup, self.run, self.results):
            part.use_theme(theme)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Choose the size of header and panels."""
        self.header.fit(self.width(), self.height())
        self.panels.fit(self.height() - self.header.height())
        super().resizeEvent(event)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Hide the tour while a question to the operator, a fault report or the question before closing is shown."""
        if event.type() in (QEvent.Type.ShowToParent, QEvent.Type.HideToParent):
            self.welcome.give_way(watched.objectName(), to=event.type() == QEvent.Type.ShowToParent)
        return super().eventFilter(watched, event)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Ask before closing during a run that this window controls; otherwise store the layout and disconnect."""
        drives = self._controller.running and self._controller.session.attached is None
        if drives and not self._leaving:
            self.leave_panel.ask(goes_on=self._goes_on)
            event.ignore()
            return
        if self._settings is not None:
            remember(self, self.pages, self._settings)
        self._controller.close()
        self.runner.close()
        self.sounds.muted = True
        super().closeEvent(event)

    def leave(self) -> None:
        """Close without asking: a run ramps out, or continues if its options allow it."""
        self._leaving = True
        self.close()

    def _runner(self, configuration: BenchConfiguration, queue: Path | None) -> QueueRunner:
        """The queue stored in the file. A file that cannot be read is not changed, and the queue is then not saved."""
        try:
            store = None if queue is None else QueueFile(queue)
            return QueueRunner(self._controller, configuration, store, self)
        except RockbenchError as error:
            self.trouble.show_trouble(Trouble(str(error), texts.QUEUE_UNREAD_DID, texts.QUEUE_UNREAD_NOW))
            return QueueRunner(self._controller, configuration, parent=self)

    def _connect(self) -> None:
        controller, runner = self._controller, self.runner
        controller.began.connect(self._began)
        controller.ended.connect(self._ended)
        runner.troubled.connect(self.trouble.show_trouble)
        self.setup.opened.connect(self._configure)
        self.setup.sounds.toggled.connect(self._mute)
        self.results.reuse_through(self.setup)
        # the points of the last run stay until a run begins; a plan check does not remove them
        for source in (runner, self.protocol, self.setup.loop):
            source.predicted.connect(self.run.predict)
        self.protocol.queued.connect(self._enqueue)
        self.protocol.saved.connect(runner.replace)
        self.protocol.left.connect(lambda: self.pages.setCurrentWidget(self.queue))
        self.queue.edit_requested.connect(self._edit)

    def _guide(self) -> None:
        """Set the locations of the tour's steps; opening the figure of the run completes the tour."""
        pages, results = self.pages, self.results
        self.welcome.guide(
            [
                Place(partial(pages.setCurrentWidget, self.protocol), self.protocol.check),
                Place(partial(pages.setCurrentWidget, self.protocol), self.protocol.start),
                Place(partial(pages.setCurrentWidget, self.run)),
                Place(partial(pages.setCurrentWidget, results), results.parts),
            ]
        )

        def opened(place: int) -> None:
            if results.parts.widget(place) is results.figures:
                self.welcome.read_results()

        results.parts.currentChanged.connect(opened)
        # the tab of the figure may be selected already
        results.parts.tabBarClicked.connect(opened)

    def _began(self, run: Run) -> None:
        self._goes_on = run.keep_going
        if self._controller.session.attached is not None:
            self.welcome.leave()
        if self.pages.currentWidget() is self.protocol and not self.runner.going:
            self.pages.setCurrentWidget(self.run)

    def _ended(self) -> None:
        self.leave_panel.hide()
        if self.pages.currentWidget() is self.run and not self.runner.going:
            self.pages.setCurrentWidget(self.results)

    def _configure(self, configuration: BenchConfiguration) -> None:
        self.protocol.use(configuration)
        self.runner.configuration = configuration
        self.welcome.give_way("a real bench", to=configuration.backend != "simulated")
        self._update_title()

    def _mute(self, sounds: bool) -> None:
        self.sounds.muted = not sounds
        if self._settings is not None:
            self._settings.setValue(_SOUNDS, "on" if sounds else "off")

    def _update_title(self) -> None:
        name = self.setup.path.name if self.setup.path is not None else texts.VIRTUAL_SHORT
        self.setWindowTitle(f"{texts.TITLE} · {name}")

    def _enqueue(self, test: Queued) -> None:
        if self.runner.do(lambda: self.runner.queue.add(test)):
            self.queue.table.setCurrentCell(len(self.runner.queue.tests) - 1, 0)
            self.pages.setCurrentWidget(self.queue)

    def _edit(self, test: Queued, number: int) -> None:
        self.protocol.edit(test, number)
        self.pages.setCurrentWidget(self.protocol)


def open_window(
    configuration: BenchConfiguration, entries: Sequence[Protocol[Any]], path: Path | None, queue: Path | None
) -> int:
    """Show the window until it is closed; returns the exit code of Qt's main loop."""
    application = QApplication(sys.argv[:1])
    application.setOrganizationName("rocking-bench")
    application.setApplicationName("rocking-bench")
    settings = QSettings()
    theme = chosen_theme(str(settings.value("theme", "")))
    controller = Controller()
    kept = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.AppConfigLocation)
    window = Window(
        controller,
        configuration,
        entries,
        theme,
        path=path,
        settings=settings,
        queue=queue,
        presets=Path(kept, "presets"),
        tour=path is None,
    )
    # after the window is built, because in a styled application every insertion of a widget styles its children again
    dress(application, theme)
    undo = attend(window, controller, application)
    follow_choice(window, application, settings)
    window.show()
    code = application.exec()
    controller.close()
    undo()
    return code


def attend(window: Window, controller: Controller, application: QApplication) -> Callable[[], None]:
    """Install the STOP filter, the handler of uncaught errors, and a handler of Ctrl-C in the terminal, which closes
    the window. Returns a function that removes them.
    """
    stop = StopFilter(controller, window.header.stop)
    application.installEventFilter(stop)
    forget = OwnErrors(controller, window.trouble).install()

    def close(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        window.leave()
        application.quit()

    before = signal.signal(signal.SIGINT, close)

    def undo() -> None:
        application.removeEventFilter(stop)
        forget()
        signal.signal(signal.SIGINT, before)

    return undo


def follow_choice(window: Window, application: QApplication, settings: QSettings) -> None:
    """Use the theme that is selected on the Setup page and kept in `settings`; without a selection, follow the desktop,
    also when it changes.
    """
    choice = window.setup.theme
    choice.setCurrentIndex(max(choice.findData(settings.value("theme", "")), 0))

    def follow() -> None:
        theme = chosen_theme(str(choice.currentData()))
        dress(application, theme)
        window.use_theme(theme)

    def choose() -> None:
        settings.setValue("theme", choice.currentData())
        follow()

    choice.currentIndexChanged.connect(choose)
    application.styleHints().colorSchemeChanged.connect(follow)
