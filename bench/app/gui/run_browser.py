"""List of the runs of a folder, in which the user searches, opens and compares runs."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from time import monotonic
from typing import cast

from PySide6.QtCore import QFileSystemWatcher, QModelIndex, Qt, QTimer, Signal
from PySide6.QtGui import QHideEvent, QKeyEvent, QKeySequence, QShortcut, QShowEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QLineEdit,
    QPushButton,
    QTableView,
    QVBoxLayout,
    QWidget,
)

from bench.app.display import texts
from bench.app.display.run_list import Found, Listing, RunRow, list_runs, read_row
from bench.app.display.theme import Theme
from bench.app.gui.background import Reader
from bench.app.gui.run_model import DATE, PICTURE, RunModel
from bench.app.gui.widgets import ElidingLabel, give_key, set_level

RUNS = Path("runs")
"""Default folder of the results."""
BATCH = 0.1
"""Time for which the thread reads files before their rows are shown [s]."""
AGAIN, SETTLE = 5_000, 300
"""Interval between two listings of the shown folder, whose files may grow, and delay of a listing after a change of the
folder [ms].
"""
WIDTHS = (92, 116, 88, 0, 120, 84, 150, 84)
"""Initial widths of the columns [px]; the column of the result, with 0, takes the remaining width."""
RESULT = texts.RUN_TITLES.index("result")


def read_rows(found: Sequence[Found]) -> list[RunRow]:
    """The rows of the first files, as many as are read in `BATCH` seconds."""
    end, rows = monotonic() + BATCH, list[RunRow]()
    for each in found:
        rows.append(read_row(each))
        if monotonic() > end:
            break
    return rows


class _Table(QTableView):
    """Table of runs, with a signal for the Enter key."""

    entered_row = Signal(QModelIndex)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Emit `entered_row` with the selected row if Enter is pressed."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self.currentIndex().isValid():
            self.entered_row.emit(self.currentIndex())
        else:
            super().keyPressEvent(event)


class RunBrowser(QWidget):
    """The runs of `folder`. A thread finds and reads the files."""

    opened = Signal(object)
    """Emits the path of a run that is to be opened."""
    ticked = Signal(object, bool)
    """Emits the path of a run, and whether it is to be compared."""
    referred = Signal(object)
    """Emits the path of a run that is to be the reference."""

    def __init__(self, theme: Theme, folder: Path = RUNS) -> None:
        super().__init__()
        self.folder = folder
        self.held = False
        """Whether a run is under way, during which the window must not wait for the disk."""
        self._real = folder.absolute()
        self.model = RunModel(theme, self)
        self.search = QLineEdit(placeholderText=texts.RUNS_SEARCH, clearButtonEnabled=True)
        self.open, self.against = QPushButton(texts.RUNS_OPEN), QPushButton(texts.RUNS_AGAINST)
        self.choose, self.back = QPushButton(texts.RUNS_FOLDER), QPushButton(texts.RUNS_BACK)
        self.message, self.table = ElidingLabel(), _Table()
        self._unread = list[Found]()
        self._problem, self._warning, self._opening = "", "", ""
        self._compared = list[Path]()
        self._current: Path | None = None
        self._reader, self._watch = Reader(self), QFileSystemWatcher(self)
        self._again = QTimer(self, interval=AGAIN)
        self._soon = QTimer(self, interval=SETTLE, singleShot=True)
        self._arrange()
        self._reader.found.connect(self._take)
        self._watch.directoryChanged.connect(self._soon.start)
        for timer in (self._again, self._soon):
            timer.timeout.connect(self.look)
        self.search.textChanged.connect(self._search)
        self.model.ticked.connect(self.ticked)
        self.model.modelAboutToBeReset.connect(self._keep)
        self.model.modelReset.connect(self._restore)
        self.table.doubleClicked.connect(self._open)
        self.table.entered_row.connect(self._open)
        self.open.clicked.connect(lambda: self._open(self.table.currentIndex()))
        self.against.clicked.connect(self._refer)

    @property
    def selected(self) -> RunRow | None:
        """The row of the selected run; None if there is none, or it has not been read."""
        index = self.table.currentIndex()
        return self.model.row(self.model.shown[index.row()]) if index.isValid() else None

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self.model.use_theme(theme)

    def use_folder(self, folder: Path) -> None:
        """List the runs of another folder."""
        self.folder, self._real = folder, folder.absolute()
        self._warning = ""
        self._mark()
        self.look()

    def look(self) -> None:
        """List the folder again, in the thread."""
        self._reader.call(partial(list_runs, self.folder))

    def compare(self, compared: Sequence[Path]) -> None:
        """Mark the compared runs, given by paths without links; the first one is the reference."""
        self._compared = list(compared)
        self._mark()
        self._say()

    def warn(self, problem: str) -> None:
        """Show a problem until another file is opened, the list is searched, or another folder is listed."""
        self._warning = f"▲ {problem}"
        self._say()

    def show_opening(self, text: str) -> None:
        """Name the file that is being opened; an empty text ends it."""
        self._opening = text
        if text:
            self._warning = ""
        self._say()

    def showEvent(self, event: QShowEvent) -> None:
        """List the folder, and start the periodic listing."""
        super().showEvent(event)
        self.model.ratio = self.devicePixelRatioF()
        self.look()
        self._again.start()

    def hideEvent(self, event: QHideEvent) -> None:
        """Stop the periodic listing, and follow the folder no longer."""
        super().hideEvent(event)
        self._again.stop()
        self._follow("")

    def _take(self, found: object) -> None:
        if isinstance(found, Exception):
            self._fail(found)
            return
        self._problem = ""
        if isinstance(found, Listing):
            self._real = found.real
            self._unread = self.model.use(found.found)
            self._mark()
            if self.isVisible():
                self._follow(str(self.folder.absolute()))
        else:
            rows = cast("list[RunRow]", found)
            self.model.update(rows)
            self._unread = self._unread[len(rows) :]
        if self._unread:
            self._reader.call(partial(read_rows, self._unread))
        self._say()

    def _mark(self) -> None:
        """Mark the compared runs in the list, whose paths below `folder` may be relative."""
        inside = [(each, each.is_relative_to(self._real)) for each in self._compared]
        self.model.compare([self.folder / path.relative_to(self._real) if own else path for path, own in inside])

    def _follow(self, wanted: str) -> None:
        """Be notified of changes of a folder that has just been listed, or of none; the listing follows the others."""
        followed = self._watch.directories()
        # Qt asks the disk when a folder is added
        if followed != [wanted] and not (wanted and self.held):
            if followed:
                self._watch.removePaths(followed)
            if wanted:
                self._watch.addPath(wanted)

    def _fail(self, error: Exception) -> None:
        self._unread = self.model.use([])
        absent = isinstance(error, FileNotFoundError)
        why = error.strerror if isinstance(error, OSError) else error
        text = texts.RUNS_NO_FOLDER if absent else texts.RUNS_UNREAD
        self._problem = text.format(folder=self.folder.absolute(), why=why)
        self._say()

    def _search(self, text: str) -> None:
        self._warning = ""
        self.model.search(text)
        self._say()

    def _say(self) -> None:
        shown, every, folder = len(self.model.shown), self.model.all, self.folder.absolute()
        parts = [texts.RUNS_COUNT.format(shown=shown, all=every, folder=folder)]
        if len(self._compared) > 1:
            parts.insert(0, texts.RUNS_REFERENCE.format(name=self._compared[0].parent.name, n=len(self._compared) - 1))
        if self._unread:
            parts.append(texts.RUNS_READING.format(n=len(self._unread)))
        text = " · ".join(parts) if every else texts.RUNS_NONE.format(folder=folder)
        problem = self._problem or self._warning
        self.message.setText(problem or self._opening or text)
        set_level(self.message, "alarm" if problem.startswith("▲") else "calm")
        self._refresh()

    def _refresh(self) -> None:
        row = self.selected
        for button in (self.open, self.against):
            button.setEnabled(row is not None and row.usable)

    def _open(self, index: QModelIndex) -> None:
        if index.isValid() and index.column() >= 0:
            self.opened.emit(self.model.shown[index.row()])

    def _refer(self) -> None:
        if (row := self.selected) is not None:
            self.referred.emit(row.found.path)

    def _keep(self) -> None:
        index = self.table.currentIndex()
        if index.isValid():
            self._current = self.model.shown[index.row()]

    def _restore(self) -> None:
        """Select the same run again after its row has moved."""
        if self._current in self.model.shown:
            self.table.setCurrentIndex(self.model.index(self.model.shown.index(self._current), RESULT))
        self._refresh()

    def _arrange(self) -> None:
        self.search.setAccessibleName(texts.RUNS_SEARCH)
        for button, tip, key in (
            (self.open, texts.RUNS_OPEN_TIP, ""),
            (self.against, texts.RUNS_AGAINST_TIP, "Ctrl+Shift+B"),
            (self.choose, texts.RUNS_FOLDER_TIP, ""),
            (self.back, texts.RUNS_BACK_TIP, "Ctrl+B"),
        ):
            button.setToolTip(tip)
            if key:
                give_key(button, key)
        self.search.setToolTip(texts.RUNS_SEARCH_TIP)
        QShortcut(QKeySequence("Ctrl+F"), self.search, self.search.setFocus)
        table = self.table
        table.setModel(self.model)
        table.setAccessibleName(texts.RUNS)
        table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        table.setIconSize(PICTURE)
        table.setWordWrap(False)
        table.setShowGrid(False)
        table.setAlternatingRowColors(True)
        table.verticalHeader().hide()
        table.verticalHeader().setDefaultSectionSize(PICTURE.height() + 6)
        table.setSortingEnabled(True)
        table.sortByColumn(DATE, Qt.SortOrder.DescendingOrder)
        header = table.horizontalHeader()
        for column, width in enumerate(WIDTHS):
            if width:
                table.setColumnWidth(column, width)
        header.setSectionResizeMode(RESULT, QHeaderView.ResizeMode.Stretch)
        table.selectionModel().currentRowChanged.connect(self._refresh)
        above = QHBoxLayout()
        above.addWidget(self.search, 1)
        for button in (self.open, self.against, self.choose, self.back):
            above.addWidget(button)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(above)
        column.addWidget(table, 1)
        column.addWidget(self.message)
