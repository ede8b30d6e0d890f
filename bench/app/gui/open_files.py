"""The list of the open data files, in which they are selected."""

from enum import Enum, auto
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QListWidget,
    QListWidgetItem,
)

from bench.app.display import texts
from bench.app.display.run_file import RunFile


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
        place_of = next((row for row, each in enumerate(self._files) if each.real == file.real), None)
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
        """Tick or untick an open file; if no file is selected, it is also selected."""
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
        # without the disk, which may stall: a link to an open file is found when it has been read
        wanted = path.absolute()
        found = (row for row, each in enumerate(self._files) if wanted in (each.path.absolute(), each.real))
        return next(found, None)

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
