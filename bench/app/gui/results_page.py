"""The Results page: the runs of a folder, and the points, gains and samples of the opened runs, with comparison, report
and export.
"""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QDragEnterEvent, QDropEvent, QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSplitter,
    QStackedWidget,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from bench.app.display import texts
from bench.app.display.gains import compare, kind_of
from bench.app.display.point_table import rows_of, summary_of
from bench.app.display.run_file import RunFile
from bench.app.display.theme import Theme
from bench.app.display.typography import typeset
from bench.app.gui.background import start_reading
from bench.app.gui.controller import Controller
from bench.app.gui.figure_view import FigureView
from bench.app.gui.file_opener import FileOpener
from bench.app.gui.gain_plot import GainPlot
from bench.app.gui.history_view import HistoryView
from bench.app.gui.open_files import FileList, Place
from bench.app.gui.outputs import Outputs
from bench.app.gui.result_tables import read_only, show_differences, show_points
from bench.app.gui.run_browser import RunBrowser
from bench.app.gui.setup_page import SetupPage
from bench.app.gui.use_result import UseResult
from bench.app.gui.widgets import FITTING, ElidingLabel, ask_for_files, give_key, scrolling, set_level, why_no_dialog
from bench.app.ipc.messages import Ended, Refused
from bench.datafile.tables import Column
from bench.results import FILE


class ResultsPage(QWidget):
    """Two views: the list of all runs, and the results of the opened runs, of which those ticked are drawn together."""

    def __init__(self, controller: Controller, theme: Theme) -> None:
        super().__init__()
        self._controller = controller
        self.message, self.files = QLabel(texts.RESULTS_EMPTY, wordWrap=True), FileList()
        self.reading, self.opener = ElidingLabel(), FileOpener(self)
        self.reading.hide()
        self.opener.changed.connect(self._show_reading)
        self.browser, self.views, self.view = RunBrowser(theme), QStackedWidget(), QWidget()
        self.all_runs = QPushButton(texts.RUNS_ALL)
        give_key(self.all_runs, "Ctrl+B")
        self.all_runs.setToolTip(texts.RUNS_ALL_TIP)
        self.all_runs.clicked.connect(self.browse)
        self.browser.back.clicked.connect(self.show_run)
        self.browser.choose.clicked.connect(self._ask_folder)
        self.browser.opened.connect(self._open_run)
        self.browser.ticked.connect(self._tick_run)
        self.browser.referred.connect(self._compare_against)
        # one line is enough, because the table below lists every point
        self.verdict = ElidingLabel()
        self.verdict.setProperty("role", "verdict")
        self.verdict.setAccessibleName(texts.NAMES["alpha"])
        self.verdict.hide()
        self.message.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.open_file, self.remove = QPushButton(texts.OPEN), QPushButton(texts.REMOVE)
        give_key(self.open_file, "Ctrl+O")
        self.open_file.clicked.connect(self._ask)
        self.remove.clicked.connect(self.files.remove_chosen)
        self.remove.setToolTip(texts.REMOVE_TIP)
        self.path = QLineEdit(placeholderText=texts.PATH)
        self.path.setAccessibleName(texts.PATH)
        self.path.returnPressed.connect(self._open_typed)
        self.files.chosen_changed.connect(self._choose)
        self.files.ticked_changed.connect(self._draw)
        self.gains, self.table, self.differences = (
            GainPlot(theme),
            read_only(texts.POINTS),
            read_only(texts.COMPARISON),
        )
        self.histories, self.outputs, self.figures = HistoryView(theme), Outputs(), FigureView(theme)
        self.reuse = UseResult(controller)
        self.everything = QCheckBox(texts.EVERYTHING)
        self.everything.setToolTip(texts.EVERYTHING_TIP)
        self.everything.setShortcut("Ctrl+Shift+F")
        self.everything.toggled.connect(self._list)
        self.parts = QTabWidget()
        self._arrange()
        self.setAcceptDrops(True)
        # ready when the file of the run is to be shown
        controller.began.connect(start_reading)
        controller.ended.connect(self.show_end)
        controller.changed.connect(self._refresh)
        self._refresh()

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self.histories.use_theme(theme)
        self.gains.use_theme(theme)
        self.figures.scores.use_theme(theme)
        self.browser.use_theme(theme)
        self._draw()

    def reuse_through(self, setup: SetupPage) -> None:
        """Connect this page to the Setup page, which uses selected results for the following runs."""
        self.reuse.wanted.connect(setup.use_result)
        self.reuse.returned.connect(setup.use_given)
        setup.used.connect(self.reuse.show_used)
        setup.refused.connect(self.reuse.show_refusal)

    def browse(self) -> None:
        """Show the list of all runs."""
        self.views.setCurrentWidget(self.browser)
        self.browser.table.setFocus()

    def show_run(self) -> None:
        """Show the opened run."""
        self.views.setCurrentWidget(self.view)
        self.files.setFocus()

    def show_end(self, ended: Ended | Refused) -> None:
        """Show the status of the finished run and open its file, without changing a displayed comparison."""
        # without the focus, which may be where the operator types
        self.views.setCurrentWidget(self.view)
        if isinstance(ended, Ended):
            compared = len(self.files.ticked) > 1
            text = texts.ENDED.format(status=ended.status, reason=ended.reason, out=ended.out)
            say = partial(self._say, text, "calm" if ended.status in ("completed", "stopped") else "alarm")
            say()
            # again, because the file that is shown states its own summary
            self.show_file(ended.out / FILE, place=Place.ASIDE if compared else Place.ALONE, then=say, said=text)
        else:
            text = texts.FAILED if ended.failed else texts.REFUSED
            self._say(text.format(text=ended.text), "alarm")

    def show_file(
        self, path: Path, *, place: Place = Place.TOO, then: Callable[[], None] | None = None, said: str = ""
    ) -> None:
        """Open a data file, or list the runs of a folder: the reading process reads it, and `then` is called when it
        is shown. A read error is reported below the text `said`, and leaves the page unchanged.
        """

        def take(found: RunFile | Path | Exception) -> None:
            if isinstance(found, Exception):
                self._say("\n".join(filter(None, (said, str(found)))), "alarm")
                self.browser.warn(str(found))
            elif isinstance(found, Path):
                self._use_folder(found)
            else:
                self.files.put(found, place)
                if then is not None:
                    then()

        self.opener.open(path, take)

    def showEvent(self, event: QShowEvent) -> None:
        """Prepare the opening of files."""
        super().showEvent(event)
        start_reading()

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Accept data files."""
        if any(url.toLocalFile().endswith(".h5") for url in event.mimeData().urls()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Open the dropped files."""
        self._show_files([Path(url.toLocalFile()) for url in event.mimeData().urls()])

    def _open_run(self, path: Path) -> None:
        """Open a run from the list, and untick the others unless two or more are compared."""
        self.show_file(path, place=Place.TOO if len(self.files.ticked) > 1 else Place.ALONE, then=self.show_run)

    def _tick_run(self, path: Path, on: bool) -> None:
        self._when_open(path, lambda: self.files.tick(path, on=on))

    def _compare_against(self, path: Path) -> None:
        def refer() -> None:
            self.files.make_first(path)
            self.files.tick(path, on=True)

        self._when_open(path, refer)

    def _when_open(self, path: Path, then: Callable[[], None]) -> None:
        if self.files.holds(path):
            then()
        else:
            self.show_file(path, place=Place.ASIDE, then=then)

    def _show_reading(self) -> None:
        """Show the path of the file that is being read, if any."""
        path = self.opener.current
        text = "" if path is None else texts.OPENING.format(path=path)
        self.reading.setText(text)
        self.reading.setVisible(bool(text))
        self.browser.show_opening(text)

    def _choose(self) -> None:
        file = self.files.chosen
        self.remove.setEnabled(file is not None)
        self.browser.back.setEnabled(file is not None)
        self.outputs.use(None if file is None else file.path)
        self.reuse.use(None if file is None else file.path)
        self.histories.use(file)
        self.figures.use(None if file is None else file.path)
        self._list()
        if file is None:
            self._say(texts.RESULTS_EMPTY, "calm")
            return
        self._say(typeset(file.headline), "calm")

    def _list(self) -> None:
        file = self.files.chosen
        results: Mapping[str, Column] = {} if file is None else file.results
        points = [] if file is None else file.points
        labels: Mapping[str, str] = {} if file is None else file.labels
        show_points(self.table, results, points, labels, everything=self.everything.isChecked())
        rows = rows_of(results, points, labels)
        self.figures.scores.use(rows)
        verdict = summary_of(rows)
        self.verdict.setText(verdict)
        self.verdict.setVisible(bool(verdict))

    def _draw(self) -> None:
        """Draw the gains of all ticked files, with the predicted lines of the first."""
        files = self.files.ticked
        self.browser.compare([file.real for file in files])
        self.histories.compare(files)
        self.gains.predict(files[0].prediction if files else {})
        for run, file in enumerate(files):
            self.gains.add_all(file.points, run, file.name if len(files) > 1 else "")
        others = [(file.name, compare(files[0].points, file.points)) for file in files[1:]]
        show_differences(self.differences, others)
        self.parts.setTabEnabled(self.parts.indexOf(self.differences), bool(others))
        # for a protocol without gains only the table is shown
        self.gains.setVisible(not files or any(kind_of(file.prediction) or file.has_gains for file in files))

    def _say(self, text: str, level: str) -> None:
        self.message.setText(f"▲ {text}" if level == "alarm" else text)
        set_level(self.message, level)

    def _ask(self) -> None:
        ask_for_files(self, self._controller, texts.OPEN, texts.RUN_FILES, self._show_files, folder="runs", many=True)

    def _show_files(self, paths: list[Path]) -> None:
        for path in paths:
            self.show_file(path, then=self.show_run)

    def _ask_folder(self) -> None:
        title = texts.RUNS_FOLDER
        ask_for_files(
            self, self._controller, title, "", lambda paths: self._use_folder(paths[0]), folder="runs", folders=True
        )

    def _use_folder(self, folder: Path) -> None:
        self.browser.use_folder(folder)
        self.browse()

    def _open_typed(self) -> None:
        if self.path.text().strip():
            self._show_files([FileList.path_of(self.path.text())])

    def _refresh(self) -> None:
        why = why_no_dialog(self._controller)
        self.open_file.setEnabled(not why)
        self.open_file.setToolTip(why or texts.OPEN_TIP)
        self.browser.choose.setEnabled(not why)
        self.browser.choose.setToolTip(why or texts.RUNS_FOLDER_TIP)
        self.browser.held = self._controller.running

    def _arrange(self) -> None:
        beside = QWidget()
        column = QVBoxLayout(beside)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.all_runs)
        buttons = QHBoxLayout()
        buttons.addWidget(self.open_file)
        buttons.addWidget(self.remove)
        column.addLayout(buttons)
        column.addWidget(self.path)
        column.addWidget(self.files, 1)
        points = QSplitter(Qt.Orientation.Vertical)
        points.addWidget(self.gains)
        rows_below = QWidget()
        below = QVBoxLayout(rows_below)
        below.setContentsMargins(0, 0, 0, 0)
        below.addWidget(self.everything)
        below.addWidget(self.table, 1)
        points.addWidget(rows_below)
        points.setSizes([340, 200])
        for part, name in (
            (points, texts.GAINS),
            (self.figures, texts.FIGURE),
            (self.differences, texts.COMPARISON),
            (self.histories, texts.SAMPLES),
        ):
            self.parts.addTab(part, name)
        comparison = self.parts.indexOf(self.differences)
        self.parts.setTabToolTip(comparison, texts.COMPARISON_TIP)
        self.parts.setTabEnabled(comparison, False)
        whole = QSplitter()
        whole.addWidget(beside)
        whole.addWidget(self.parts)
        whole.setSizes([250, 1000])
        rows = QVBoxLayout(self.view)
        rows.setContentsMargins(0, 0, 0, 0)
        rows.addWidget(self.verdict)
        rows.addWidget(self.message)
        rows.addWidget(self.reading)
        rows.addWidget(whole, 1)
        rows.addWidget(self.reuse)
        rows.addWidget(self.outputs)
        for each in (self.browser, self.view):
            self.views.addWidget(each)
        self.browser.back.setEnabled(False)
        QVBoxLayout(self).addWidget(scrolling(self.views, *FITTING))
