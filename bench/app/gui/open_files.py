# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
"""The open data files: their descriptions, and the list in which they are selected."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QListWidget,
    QListWidgetItem,
)

from bench.app.catalogue import load_protocol
from bench.app.display import texts
from bench.app.display.gains import mark_of
from bench.app.display.samples import DRIVE
from bench.app.formatting import clock
from bench.datafile.tables import Column, Table
from bench.document.typography import moment
from sim.errors import RockbenchError


@dataclass(frozen=True, eq=False)
class RunFile:
    """Description of a file, its points and its prediction; `runs` maps the number of each run to its duration [s]."""

    path: Path
    headline: str
    points: list[dict[str, Any]]
    results: Mapping[str, Column]
    prediction: Table
    channels: Mapping[str, str]
    """Unit of every channel by name, the drive last."""
    runs: Mapping[int, float]
    labels: Mapping[str, str] = field(default_factory=dict[str, str])
    """Displayed names of fields of a point, as declared by the protocol."""

    @property
    def has_gains(self) -> bool:
        """Whether any point has the fields of a gain."""
        return any(mark_of(point) is not None for point in self.points)

    @property
    def name(self) -> str:
        """Short name: the name of the folder, since the files of all runs have the same name."""
        return self.path.resolve().parent.name or self.path.stem


def read_file(path: Path) -> RunFile:
    """Read the description of a file. Raises RockbenchError for a file that is unreadable or of another format."""
    from bench.datafile.reader import open_datafile

    with open_datafile(path) as record:
        length = clock(record.rows / record.sample_rate)
        return RunFile(
            path,
            texts.FILE_SUMMARY.format(
                path=path, start=moment(record.start_time), status=record.status, summary=record.summary, length=length
            ),
            record.points,
            record.results,
            record.tables.get("prediction", {}),
            {**{channel.name: channel.unit for channel in record.channels}, DRIVE: "V"},
            {run.number: len(run.rows) / record.sample_rate for run in record.runs},
            _labels(str(record.metadata.get("protocol", ""))),
        )


def _labels(protocol: str) -> Mapping[str, str]:
    """Displayed names of the results of a protocol; empty for a protocol that is not installed."""
    try:
        return load_protocol(protocol).view.labels
    except RockbenchError:
        return {}


class Place(Enum):
    """Selection of an added file: ticked in addition to others (TOO), ticked alone (ALONE), or only listed (ASIDE)."""

    TOO = auto()
    ALONE = auto()
    ASIDE = auto()


class FileList(QListWidget):
    """List of the open files, in the order in which they were opened, except that `make_first` moves one to the top."""

    chosen_changed = Signal()
    ticked_changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._files: list[RunFile] = []
        self.setAccessibleName(texts.FILES)
        self.setToolTip(texts.FILES_TIP)
        self.currentRowChanged.connect(self.chosen_changed)
        self.itemChanged.connect(self.ticked_changed)

    @property
    def chosen(self) -> RunFile | None:
        row = self.currentRow()
        return self._files[row] if 0 <= row < len(self._files) else None

    @property
    def ticked(self) -> list[RunFile]:
        checked = Qt.CheckState.Checked
        return [file for row, file in enumerate(self._files) if self.item(row).checkState() == checked]

    def put(self, file: RunFile, place: Place = Place.TOO) -> None:
        """Add `file`, or replace the description of the same file that was read earlier."""
        place_of = self._place(file.path)
        row = len(self._files) if place_of is None else place_of
        self.blockSignals(True)
        if place_of is not None:
            self._files[row] = file
        else:
            self._files.append(file)
            item = QListWidgetItem(file.name)
            item.setFlags(item.flags() | Qt.ItemFlag.ItemIsUserCheckable)
            item.setToolTip(str(file.path))
            item.setCheckState(Qt.CheckState.Unchecked)
            self.addItem(item)
        if place is not Place.ASIDE:
            self._tick(row, alone=place is Place.ALONE)
            self.setCurrentRow(row)
        self.blockSignals(False)
        # a file that is neither selected nor ticked causes no redrawing
        if row == self.currentRow():
            self.chosen_changed.emit()
        if self.item(row).checkState() == Qt.CheckState.Checked:
            self.ticked_changed.emit()

    def _tick(self, row: int, *, alone: bool) -> None:
        for each in range(self.count()):
            if each == row or alone:
                self.item(each).setCheckState(Qt.CheckState.Checked if each == row else Qt.CheckState.Unchecked)

    def holds(self, path: Path) -> bool:
        """Whether a file is open."""
        return self._place(path) is not None

    def tick(self, path: Path, *, on: bool) -> None:
        """Tick or untick an open file; it is also selected if no file is."""
        if (row := self._place(path)) is not None:
            self.item(row).setCheckState(Qt.CheckState.Checked if on else Qt.CheckState.Unchecked)
            if self.currentRow() < 0:
                self.setCurrentRow(row)

    def make_first(self, path: Path) -> None:
        """Move an open file to the top of the list, where the first ticked file is the reference."""
        if (row := self._place(path)) is not None:
            self.blockSignals(True)
            chosen = self.currentItem()
            self._files.insert(0, self._files.pop(row))
            self.insertItem(0, self.takeItem(row))
            self.setCurrentItem(chosen)
            self.blockSignals(False)
            self.ticked_changed.emit()

    def _place(self, path: Path) -> int | None:
        wanted = path.resolve()
        return next((row for row, each in enumerate(self._files) if each.path.resolve() == wanted), None)

    def remove_chosen(self) -> None:
        row = self.currentRow()
        if 0 <= row < len(self._files):
            self.blockSignals(True)
            del self._files[row]
            self.takeItem(row)
            self.blockSignals(False)
            self.chosen_changed.emit()
            self.ticked_changed.emit()

    @staticmethod
    def path_of(text: str) -> Path:
        """The path in pasted text, without quotation marks."""
        return Path(text.strip().strip("'\"")).expanduser()
