"""The window: the header with STOP, the question that stands, what went wrong, and the pages."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QEvent, QObject, QSettings
from PySide6.QtGui import QCloseEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import QMainWindow, QTabWidget, QVBoxLayout, QWidget

from bench.config.model import BenchConfiguration
from bench.gui import texts
from bench.gui.controller import Controller
from bench.gui.header import Header
from bench.gui.layout import free_tab_key, remember, restore
from bench.gui.palette import Theme
from bench.gui.prompt import Prompt
from bench.gui.protocol_page import ProtocolPage
from bench.gui.queue_page import QueuePage
from bench.gui.queue_runner import QueueRunner
from bench.gui.results_page import ResultsPage
from bench.gui.run_page import RunPage
from bench.gui.setup_page import SetupPage
from bench.gui.tour import Tour
from bench.gui.trouble import TroublePanel
from bench.gui.troubles import Trouble
from bench.protocol import Protocol
from bench.queue.file import QueueFile
from bench.queue.queued import Queued
from sim.errors import RockbenchError

SMALLEST = (1280, 800)


class Window(QMainWindow):
    """Everything is a client of `controller`; closing the window leaves the session to itself.

    `settings` remembers the layout; None forgets it. `queue` is the file of the queue; None keeps it nowhere. With
    `tour` the first minute is guided.
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
        tour: bool = False,
    ) -> None:
        super().__init__()
        self._controller, self._settings = controller, settings
        self.setMinimumSize(*SMALLEST)
        self.header, self.prompt, self.trouble = Header(controller, theme), Prompt(controller), TroublePanel(controller)
        self.runner = self._runner(configuration, queue)
        self.setup = SetupPage(controller, configuration, path, theme)
        self.protocol = ProtocolPage(controller, configuration, entries, tour)
        # whoever takes the tour sees its end within a minute
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
        self.welcome = Tour(controller)
        if not tour:
            self.welcome.leave()
        for part in (self.prompt, self.trouble):
            part.installEventFilter(self)
        whole = QWidget()
        column = QVBoxLayout(whole)
        for part in (self.header, self.prompt, self.trouble, self.welcome):
            column.addWidget(part)
        column.addWidget(self.pages, 1)
        self.setCentralWidget(whole)
        self.pages.setCurrentWidget(self.protocol)
        free_tab_key(whole)
        self._connect()
        self._entitle()
        if settings is not None:
            restore(self, self.pages, settings)

    def use_theme(self, theme: Theme) -> None:
        """Take the colours of another theme, while whatever goes on goes on."""
        for part in (self.header, self.setup, self.run, self.results):
            part.use_theme(theme)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """The tour gives way to a question or a trouble that stands; nothing is taken from anybody."""
        if event.type() in (QEvent.Type.ShowToParent, QEvent.Type.HideToParent):
            self.welcome.give_way(watched.objectName(), to=event.type() == QEvent.Type.ShowToParent)
        return super().eventFilter(watched, event)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Remember the layout and let go of the session: nothing is asked, no run is harmed."""
        if self._settings is not None:
            remember(self, self.pages, self._settings)
        self._controller.close()
        self.runner.close()
        super().closeEvent(event)

    def _runner(self, configuration: BenchConfiguration, queue: Path | None) -> QueueRunner:
        """The queue of the file; when that cannot be read it is left alone, and the queue is kept nowhere."""
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
        # only what begins takes the place of the points of the last run: a plan that is checked does not
        for source in (runner, self.protocol, self.setup.loop):
            source.predicted.connect(self.run.predict)
        self.protocol.queued.connect(self._enqueue)
        self.protocol.saved.connect(runner.replace)
        self.protocol.left.connect(lambda: self.pages.setCurrentWidget(self.queue))
        self.queue.edit_asked.connect(self._edit)

    def _began(self) -> None:
        if self.pages.currentWidget() is self.protocol and not self.runner.going:
            self.pages.setCurrentWidget(self.run)

    def _ended(self) -> None:
        if self.pages.currentWidget() is self.run and not self.runner.going:
            self.pages.setCurrentWidget(self.results)

    def _configure(self, configuration: BenchConfiguration) -> None:
        self.protocol.use(configuration)
        self.runner.configuration = configuration
        self.welcome.give_way("a real bench", to=configuration.backend != "simulated")
        self._entitle()

    def _entitle(self) -> None:
        name = self.setup.path.name if self.setup.path is not None else texts.VIRTUAL_SHORT
        self.setWindowTitle(f"{texts.TITLE} · {name}")

    def _enqueue(self, test: Queued) -> None:
        if self.runner.do(lambda: self.runner.queue.add(test)):
            self.queue.table.setCurrentCell(len(self.runner.queue.tests) - 1, 0)
            self.pages.setCurrentWidget(self.queue)

    def _edit(self, test: Queued, number: int) -> None:
        self.protocol.edit(test, number)
        self.pages.setCurrentWidget(self.protocol)
