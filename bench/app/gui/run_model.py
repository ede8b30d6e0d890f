"""Table model of the runs of a folder: search, sorting, marks of compared runs, and pictures loaded on demand."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, cast

from PySide6.QtCore import (
    QAbstractTableModel,
    QBuffer,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    QSize,
    Qt,
    Signal,
)
from PySide6.QtGui import QColor, QFont, QImage, QPainter, QPixmap

from bench.app.display import texts
from bench.app.display.run_list import Found, RunRow
from bench.app.display.theme import Theme
from bench.app.gui.background import Reader, png_reader

PICTURE = QSize(64, 40)
"""Size of a picture in the list [px]."""
AT_ONCE = 8
"""Number of pictures that the thread loads in one call."""
CHOICE, STATUS, DATE = 0, texts.RUN_TITLES.index("status"), texts.RUN_TITLES.index("date")
Index = QModelIndex | QPersistentModelIndex
Picture = tuple[Path, tuple[int, ...]]
NOWHERE = QModelIndex()
"""Invalid index, which denotes the root of a table model."""


def load_pictures(wanted: Sequence[Picture], size: QSize) -> dict[Picture, QImage]:
    """The pictures, each centred in an image of this size [physical px]; null for one that cannot be read."""
    return {each: _fitted(each[0], size) for each in wanted}


def _fitted(path: Path, size: QSize) -> QImage:
    # read by Python, which lets the other threads continue while the disk stalls
    data = QBuffer()
    try:
        data.setData(path.read_bytes())
    except OSError:
        return QImage()
    reader = png_reader(data)
    whole = reader.size()
    if not whole.isValid():
        return QImage()
    scaled = whole.scaled(size, Qt.AspectRatioMode.KeepAspectRatio)
    # decode at twice the size and smooth afterwards, because the decoder scales without a filter
    reader.setScaledSize(scaled * 2)
    found = reader.read()
    if found.isNull():
        return QImage()
    image = QImage(size, QImage.Format.Format_ARGB32_Premultiplied)
    image.fill(Qt.GlobalColor.transparent)
    painter = QPainter(image)
    found = found.scaled(scaled, Qt.AspectRatioMode.IgnoreAspectRatio, Qt.TransformationMode.SmoothTransformation)
    painter.drawImage((size.width() - scaled.width()) // 2, (size.height() - scaled.height()) // 2, found)
    painter.end()
    return image


class RunModel(QAbstractTableModel):
    """The files that match the search, in the selected order. A file without a `RunRow` has not been read yet."""

    ticked = Signal(object, bool)
    """Emits the path of a run, and whether it was ticked or unticked."""

    def __init__(self, theme: Theme, parent: QObject) -> None:
        super().__init__(parent)
        self._theme, self.ratio = theme, 1.0
        self._found = dict[Path, Found]()
        self._rows = dict[Path, RunRow]()
        self._searched = dict[Path, str]()
        self.shown = list[Path]()
        """Paths of the listed files."""
        self._words, self._column, self._falls = tuple[str, ...](), DATE, True
        self._compared, self._reference = frozenset[Path](), None
        self._pixmaps = dict[Picture, QPixmap]()
        self._wanted = list[Picture]()
        self._loading = False
        self._loader = Reader(self)
        self._loader.found.connect(self._take_pictures)

    @property
    def all(self) -> int:
        """Number of all files, including those that do not match the search."""
        return len(self._found)

    def row(self, path: Path) -> RunRow | None:
        """The row of a file; None if the file has not been read."""
        return self._rows.get(path)

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self._theme = theme
        self._repaint()

    def use(self, found: Sequence[Found]) -> list[Found]:
        """List these files; returns those to be read, in the same order."""
        self._found = {each.path: each for each in found}
        self._rows = {path: row for path, row in self._rows.items() if path in self._found}
        self.arrange()
        return [each for each in found if (row := self._rows.get(each.path)) is None or row.found != each or row.stale]

    def update(self, rows: Sequence[RunRow]) -> None:
        """Show files that have been read."""
        for row in rows:
            if row.found.path in self._found:
                self._rows[row.found.path] = row
                self._searched[row.found.path] = row.searched
        self.arrange()
        self._repaint()

    def search(self, text: str) -> None:
        """List only the files whose texts contain all words of `text`."""
        self._words = tuple(text.lower().split())
        self.arrange()

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        """Order the files by a column."""
        self._column, self._falls = column, order == Qt.SortOrder.DescendingOrder
        self.arrange()

    def compare(self, compared: Sequence[Path]) -> None:
        """Mark the compared runs, given by their paths; the first is the reference."""
        self._compared, self._reference = frozenset(compared), compared[0] if compared else None
        self._repaint()

    def arrange(self) -> None:
        """Apply search and order; the view is only reset if its rows change."""
        paths = [path for path in self._found if self._matches(path)]
        paths.sort(key=self._key, reverse=self._falls)
        if paths != self.shown:
            self.beginResetModel()
            self.shown = paths
            self.endResetModel()

    def _matches(self, path: Path) -> bool:
        text = self._searched.get(path) or str(path).lower()
        return all(word in text for word in self._words)

    def _key(self, path: Path) -> tuple[Any, ...]:
        row = self._rows.get(path)
        began = self._found[path].changed if row is None else row.began
        if self._column == DATE:
            return (began,)
        if self._column == CHOICE:
            return (path in self._compared, began)
        return ("" if row is None else row.cells[self._column - 1].lower(), began)

    def rowCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else len(self.shown)

    def columnCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else len(texts.RUN_TITLES)

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if orientation is not Qt.Orientation.Horizontal:
            return None
        if role == Qt.ItemDataRole.DisplayRole:
            return texts.RUN_TITLES[section]
        return texts.RUN_TITLE_TIPS[section] if role == Qt.ItemDataRole.ToolTipRole else None

    def flags(self, index: Index) -> Qt.ItemFlag:
        found = Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable
        row = self._rows.get(self.shown[index.row()])
        checkable = index.column() == CHOICE and row is not None and row.usable
        return found | Qt.ItemFlag.ItemIsUserCheckable if checkable else found

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        path, column = self.shown[index.row()], index.column()
        row = self._rows.get(path)
        match role:
            case Qt.ItemDataRole.DisplayRole if column != CHOICE:
                last = column == len(texts.RUN_TITLES) - 1
                return row.cells[column - 1] if row else path.parent.name if last else "…" if column == STATUS else ""
            case Qt.ItemDataRole.ToolTipRole:
                return str(path) if row is None or column == CHOICE else row.tips[column - 1]
            case Qt.ItemDataRole.DecorationRole if column == CHOICE:
                return self._picture(row)
            case Qt.ItemDataRole.CheckStateRole if column == CHOICE and row is not None and row.usable:
                return Qt.CheckState.Checked if path in self._compared else Qt.CheckState.Unchecked
            case Qt.ItemDataRole.FontRole if path == self._reference:
                font = QFont()
                font.setBold(True)
                return font
            case Qt.ItemDataRole.ForegroundRole if row is not None and column == STATUS:
                return self._colour(row)
            case Qt.ItemDataRole.ForegroundRole if row is None or not row.usable:
                return QColor(self._theme.faint)
            case _:
                return None

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        if role != Qt.ItemDataRole.CheckStateRole or index.column() != CHOICE:
            return False
        self.ticked.emit(self.shown[index.row()], Qt.CheckState(value) == Qt.CheckState.Checked)
        return True

    def _colour(self, row: RunRow) -> QColor:
        status, theme = row.cells[STATUS - 1], self._theme
        if status == texts.RUN_GOING:
            return QColor(theme.wait)
        return QColor(theme.text if status in ("completed", "stopped") else theme.alarm)

    def _picture(self, row: RunRow | None) -> QPixmap | None:
        if row is None or row.figure is None:
            return None
        key = (row.figure, row.found.stamp)
        if key not in self._pixmaps and key not in self._wanted:
            self._wanted.append(key)
            self._load()
        return self._pixmaps.get(key)

    def _load(self) -> None:
        # the pictures that were requested last are the visible ones
        self._wanted = self._wanted[-4 * AT_ONCE :]
        if self._wanted and not self._loading:
            self._loading = True
            self._loader.call(partial(load_pictures, self._wanted[-AT_ONCE:], PICTURE * self.ratio))

    def _take_pictures(self, found: object) -> None:
        self._loading = False
        if isinstance(found, dict):
            images = cast("dict[Picture, QImage]", found)
            for key, image in images.items():
                pixmap = QPixmap.fromImage(image)
                pixmap.setDevicePixelRatio(self.ratio)
                self._pixmaps[key] = pixmap
            self._wanted = [key for key in self._wanted if key not in images]
            self._repaint()
        self._load()

    def _repaint(self) -> None:
        if self.shown:
            self.dataChanged.emit(self.index(0, 0), self.index(len(self.shown) - 1, len(texts.RUN_TITLES) - 1))
