"""The file of a run: what it is, its points, and its gains on the predicted lines."""

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSplitter,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from bench.cli.words import ABSENT, clock
from bench.gui import texts
from bench.gui.controller import Controller
from bench.gui.gain_plot import GainPlot
from bench.gui.header import set_level
from bench.gui.palette import Theme
from bench.link.messages import Ended, Refused
from bench.results import FILE
from sim.errors import RockbenchError


class ResultsPage(QWidget):
    """Shows the run that has just ended, or any file."""

    def __init__(self, controller: Controller, theme: Theme) -> None:
        super().__init__()
        self._controller = controller
        self.told = QLabel(texts.RESULTS_EMPTY, wordWrap=True)
        self.told.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.open_file = QPushButton(texts.OPEN)
        self.open_file.setShortcut("Ctrl+O")
        self.open_file.clicked.connect(self._ask)
        self.table = QTableWidget(0, 0)
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setAccessibleName("points")
        self.gains = GainPlot(theme)
        row = QHBoxLayout()
        row.addWidget(self.told, 1)
        row.addWidget(self.open_file)
        parts = QSplitter(Qt.Orientation.Vertical)
        parts.addWidget(self.gains)
        parts.addWidget(self.table)
        parts.setSizes([420, 200])
        column = QVBoxLayout(self)
        column.addLayout(row)
        column.addWidget(parts, 1)
        controller.ended.connect(self.show_end)
        controller.changed.connect(self._refresh)
        self._refresh()

    def show_end(self, ended: Ended | Refused) -> None:
        """Say how the run ended, and open its file."""
        if isinstance(ended, Ended):
            self.show_file(ended.out / FILE)
            self._say(
                texts.ENDED.format(status=ended.status, reason=ended.reason, out=ended.out),
                "calm" if ended.status in ("completed", "stopped") else "alarm",
            )
        else:
            text = texts.FAILED if ended.failed else texts.REFUSED
            self._say(text.format(text=ended.text), "alarm")

    def show_file(self, path: Path) -> None:
        """Open a file of a run; one that cannot be read says why, and what was shown stays."""
        from bench.record.reader import open_record

        try:
            with open_record(path) as record:
                points, results, tables = record.points, record.results, record.tables
                length = clock(record.rows / record.sample_rate)
                told = f"{path}\n{record.start_time}, {record.status}: {record.summary} ({length} of samples)"
        except RockbenchError as error:
            self._say(str(error), "alarm")
            return
        self._say(told, "calm")
        self.gains.predict(tables.get("prediction", {}))
        self.gains.add_all(points)
        self.table.setColumnCount(len(results))
        self.table.setRowCount(len(points))
        for column, (name, of) in enumerate(results.items()):
            unit = "" if of.unit in ("", "1") else f" [{of.unit}]"
            header = QTableWidgetItem(f"{name}{unit}")
            header.setToolTip(of.description)
            self.table.setHorizontalHeaderItem(column, header)
            for row, point in enumerate(points):
                self.table.setItem(row, column, QTableWidgetItem(_cell(point[name])))
        self.table.resizeColumnsToContents()

    def _say(self, text: str, level: str) -> None:
        self.told.setText(f"▲ {text}" if level == "alarm" else text)
        set_level(self.told, level)

    def _ask(self) -> None:
        path, _ = QFileDialog.getOpenFileName(self, texts.OPEN, "runs", "campaign (*.h5)")
        if path:
            self.show_file(Path(path))

    def _refresh(self) -> None:
        self.open_file.setEnabled(not self._controller.armed)
        self.open_file.setToolTip(texts.OPEN_ARMED if self._controller.armed else texts.OPEN_TIP)


def _cell(value: object) -> str:
    if value is None:
        return ABSENT
    return f"{value:.5g}" if isinstance(value, float) else str(value)
