"""The files that are open: one is chosen, some are ticked."""

from enum import Enum, auto
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QListWidget, QListWidgetItem

from bench.gui import texts
from bench.gui.run_file import RunFile


class Place(Enum):
    """What becomes of the others when a file is taken in: ticked TOO, it ALONE, or it only put ASIDE."""

    TOO = auto()
    ALONE = auto()
    ASIDE = auto()


class FileList(QListWidget):
    """In the order of their opening."""

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
        """The file that is chosen."""
        row = self.currentRow()
        return self._files[row] if 0 <= row < len(self._files) else None

    @property
    def ticked(self) -> list[RunFile]:
        """The files that are ticked."""
        checked = Qt.CheckState.Checked
        return [file for row, file in enumerate(self._files) if self.item(row).checkState() == checked]

    def put(self, file: RunFile, place: Place = Place.TOO) -> None:
        """Take in `file`, in the place of an older reading of it."""
        places = [row for row, each in enumerate(self._files) if each.path.resolve() == file.path.resolve()]
        row = places[0] if places else len(self._files)
        self.blockSignals(True)
        if places:
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
        # nothing that is looked at is drawn anew for a file that is put aside
        if row == self.currentRow():
            self.chosen_changed.emit()
        if self.item(row).checkState() == Qt.CheckState.Checked:
            self.ticked_changed.emit()

    def _tick(self, row: int, *, alone: bool) -> None:
        for each in range(self.count()):
            if each == row or alone:
                self.item(each).setCheckState(Qt.CheckState.Checked if each == row else Qt.CheckState.Unchecked)

    def remove_chosen(self) -> None:
        """Forget the chosen file."""
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
        """A path as a person pastes it."""
        return Path(text.strip().strip("'\"")).expanduser()
