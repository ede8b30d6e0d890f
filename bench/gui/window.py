"""The window: the header with STOP, the question that stands, and the pages."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from PySide6.QtCore import QByteArray, QSettings
from PySide6.QtGui import QCloseEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QMainWindow, QPushButton, QTabWidget, QVBoxLayout, QWidget

from bench.cli.catalogue import Entry
from bench.config.model import BenchConfiguration
from bench.gui import texts
from bench.gui.controller import Controller
from bench.gui.header import Header
from bench.gui.palette import Theme
from bench.gui.prompt import Prompt
from bench.gui.protocol_page import ProtocolPage
from bench.gui.results_page import ResultsPage
from bench.gui.run_page import RunPage
from bench.gui.setup_page import SetupPage
from bench.link.messages import Surveyed

SMALLEST = (1280, 800)


class Window(QMainWindow):
    """Everything is a client of `controller`; closing the window leaves the session to itself.

    `settings` remembers the layout; None forgets it. With `tour` the first minute is guided.
    """

    def __init__(
        self,
        controller: Controller,
        configuration: BenchConfiguration,
        entries: Sequence[Entry],
        theme: Theme,
        *,
        path: Path | None = None,
        settings: QSettings | None = None,
        tour: bool = False,
    ) -> None:
        super().__init__()
        self._controller, self._settings = controller, settings
        self.setWindowTitle(texts.TITLE)
        self.setMinimumSize(*SMALLEST)
        self.header, self.prompt = Header(controller, theme), Prompt(controller)
        self.setup = SetupPage(configuration, path)
        self.protocol = ProtocolPage(controller, configuration, entries, tour)
        self.run, self.results = RunPage(controller, theme), ResultsPage(controller, theme)
        self.pages = QTabWidget()
        for number, (name, page) in enumerate(
            zip(texts.PAGES, (self.setup, self.protocol, self.run, self.results), strict=True)
        ):
            self.pages.addTab(page, name)
            self.pages.setTabToolTip(number, f"Ctrl+{number + 1}")
            QShortcut(QKeySequence(f"Ctrl+{number + 1}"), self, partial(self.pages.setCurrentIndex, number))
        self.welcome = _welcome()
        self.welcome.setVisible(tour)
        whole = QWidget()
        column = QVBoxLayout(whole)
        for part in (self.header, self.prompt, self.welcome):
            column.addWidget(part)
        column.addWidget(self.pages, 1)
        self.setCentralWidget(whole)
        self.pages.setCurrentWidget(self.protocol)
        controller.surveyed.connect(self._surveyed)
        controller.began.connect(self.welcome.hide)
        controller.began.connect(lambda: self.pages.setCurrentWidget(self.run))
        controller.ended.connect(lambda: self.pages.setCurrentWidget(self.results))
        kept = settings.value("geometry") if settings is not None else None
        if isinstance(kept, QByteArray):
            self.restoreGeometry(kept)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Remember the layout and let go of the session: nothing is asked, no run is harmed."""
        if self._settings is not None:
            self._settings.setValue("geometry", self.saveGeometry())
        self._controller.close()
        super().closeEvent(event)

    def _surveyed(self, found: object) -> None:
        if isinstance(found, Surveyed):
            self.run.predict(found.prediction)


def _welcome() -> QFrame:
    frame = QFrame()
    frame.setObjectName("welcome")
    hide = QPushButton(texts.WELCOME_CLOSE)
    hide.clicked.connect(frame.hide)
    row = QHBoxLayout(frame)
    row.addWidget(QLabel(texts.WELCOME, wordWrap=True), 1)
    row.addWidget(hide)
    return frame
