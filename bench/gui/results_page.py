"""Files of runs: what they are, their points and gains, compared, their samples, and what can be made of them."""

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSplitter,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from bench.gui import texts
from bench.gui.buttons import give_key
from bench.gui.comparison import compare
from bench.gui.controller import Controller
from bench.gui.file_dialog import ask_for_files, why_no_dialog
from bench.gui.file_list import FileList, Place
from bench.gui.gain_plot import GainPlot
from bench.gui.header import set_level
from bench.gui.history_view import HistoryView
from bench.gui.outputs import Outputs
from bench.gui.palette import Theme
from bench.gui.run_file import read_file
from bench.gui.tables import read_only, show_differences, show_points
from bench.link.messages import Ended, Refused
from bench.results import FILE
from sim.errors import RockbenchError


class ResultsPage(QWidget):
    """Shows the run that has just ended, or any files; those that are ticked are drawn together."""

    def __init__(self, controller: Controller, theme: Theme) -> None:
        super().__init__()
        self._controller = controller
        self.told, self.files = QLabel(texts.RESULTS_EMPTY, wordWrap=True), FileList()
        self.told.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
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
        self.histories, self.outputs = HistoryView(theme), Outputs()
        self.parts = QTabWidget()
        self._arrange()
        self.setAcceptDrops(True)
        controller.ended.connect(self.show_end)
        controller.changed.connect(self._refresh)
        self._refresh()

    def use_theme(self, theme: Theme) -> None:
        """Take these colours."""
        self.histories.use_theme(theme)
        self.gains.use_theme(theme)
        self._draw()

    def show_end(self, ended: Ended | Refused) -> None:
        """Say how the run ended, and open its file; a comparison that somebody is looking at stays as it is."""
        if isinstance(ended, Ended):
            compared = len(self.files.ticked) > 1
            self.show_file(ended.out / FILE, place=Place.ASIDE if compared else Place.ALONE)
            self._say(
                texts.ENDED.format(status=ended.status, reason=ended.reason, out=ended.out),
                "calm" if ended.status in ("completed", "stopped") else "alarm",
            )
        else:
            text = texts.FAILED if ended.failed else texts.REFUSED
            self._say(text.format(text=ended.text), "alarm")

    def show_file(self, path: Path, *, place: Place = Place.TOO) -> None:
        """Open a file of a run; one that cannot be read says why, and what was shown stays."""
        try:
            file = read_file(path)
        except (RockbenchError, OSError) as error:
            self._say(str(error), "alarm")
        else:
            self.files.put(file, place)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Take files of runs."""
        if any(url.toLocalFile().endswith(".h5") for url in event.mimeData().urls()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Open them."""
        for url in event.mimeData().urls():
            self.show_file(Path(url.toLocalFile()))

    def _choose(self) -> None:
        file = self.files.chosen
        self.remove.setEnabled(file is not None)
        self.outputs.use(None if file is None else file.path)
        self.histories.use(file)
        if file is None:
            show_points(self.table, {}, [])
            self._say(texts.RESULTS_EMPTY, "calm")
            return
        self._say(file.told, "calm")
        show_points(self.table, file.results, file.points)

    def _draw(self) -> None:
        """The gains of all that are ticked, on the lines of the first."""
        files = self.files.ticked
        self.gains.predict(files[0].prediction if files else {})
        for run, file in enumerate(files):
            self.gains.add_all(file.points, run, file.name if len(files) > 1 else "")
        others = [(file.name, compare(files[0].points, file.points)) for file in files[1:]]
        show_differences(self.differences, others)
        self.parts.setTabEnabled(self.parts.indexOf(self.differences), bool(others))

    def _say(self, text: str, level: str) -> None:
        self.told.setText(f"▲ {text}" if level == "alarm" else text)
        set_level(self.told, level)

    def _ask(self) -> None:
        ask_for_files(self, self._controller, texts.OPEN, texts.RUN_FILES, self._show_files, folder="runs", many=True)

    def _show_files(self, paths: list[Path]) -> None:
        for path in paths:
            self.show_file(path)

    def _open_typed(self) -> None:
        if self.path.text().strip():
            self.show_file(FileList.path_of(self.path.text()))

    def _refresh(self) -> None:
        why = why_no_dialog(self._controller)
        self.open_file.setEnabled(not why)
        self.open_file.setToolTip(texts.OPEN_BESIDE.format(why=why) if why else texts.OPEN_TIP)

    def _arrange(self) -> None:
        beside = QWidget()
        column = QVBoxLayout(beside)
        column.setContentsMargins(0, 0, 0, 0)
        buttons = QHBoxLayout()
        buttons.addWidget(self.open_file)
        buttons.addWidget(self.remove)
        column.addLayout(buttons)
        column.addWidget(self.path)
        column.addWidget(self.files, 1)
        points = QSplitter(Qt.Orientation.Vertical)
        points.addWidget(self.gains)
        points.addWidget(self.table)
        points.setSizes([380, 160])
        for part, name in (
            (points, texts.GAINS),
            (self.differences, texts.COMPARISON),
            (self.histories, texts.SAMPLES),
        ):
            self.parts.addTab(part, name)
        self.parts.setTabToolTip(1, texts.COMPARISON_TIP)
        self.parts.setTabEnabled(1, False)
        whole = QSplitter()
        whole.addWidget(beside)
        whole.addWidget(self.parts)
        whole.setSizes([250, 1000])
        rows = QVBoxLayout(self)
        rows.addWidget(self.told)
        rows.addWidget(whole, 1)
        rows.addWidget(self.outputs)
