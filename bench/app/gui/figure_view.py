"""The figures that a run wrote next to its data file, and its normalised errors below them."""

from functools import partial
from pathlib import Path
from typing import cast

from PySide6.QtCore import QBuffer, Qt
from PySide6.QtGui import QImage, QPixmap, QResizeEvent
from PySide6.QtWidgets import QComboBox, QLabel, QSizePolicy, QVBoxLayout, QWidget

from bench.app.display import texts
from bench.app.display.theme import Theme
from bench.app.gui.background import Reader, png_reader
from bench.app.gui.score_strip import ScoreStrip


def find_figures(folder: Path) -> list[Path]:
    """The pictures in a folder, by name."""
    return sorted(folder.glob("*.png"))


def read_figure(path: Path) -> QImage:
    """A picture. Raises OSError."""
    data = QBuffer()
    data.setData(path.read_bytes())
    return png_reader(data).read()


class FigureView(QWidget):
    """The selected figure, as large as the space allows, above the strip of the normalised errors E_n. Threads read the
    folder and the figure.
    """

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.scores = ScoreStrip(theme)
        self.choice, self.picture = QComboBox(), QLabel(alignment=Qt.AlignmentFlag.AlignCenter)
        self.choice.setAccessibleName(texts.FIGURE)
        self.picture.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Ignored)
        self._pixmap = QPixmap()
        self._finder, self._loader = Reader(self), Reader(self)
        self._finder.found.connect(self._list)
        self._loader.found.connect(self._show)
        self.choice.currentIndexChanged.connect(self._load)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.choice)
        column.addWidget(self.picture, 1)
        column.addWidget(self.scores)

    def use(self, file: Path | None) -> None:
        """List the figures in the folder of this data file for selection."""
        self._list([])
        # also without a file, so that the figures of the file before are not listed
        self._finder.call(list if file is None else partial(find_figures, file.parent))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Scale the figure to the new size."""
        super().resizeEvent(event)
        self._fit()

    def _list(self, found: object) -> None:
        self.choice.blockSignals(True)
        self.choice.clear()
        for path in cast("list[Path]", found) if isinstance(found, list) else []:
            self.choice.addItem(path.stem.replace("_", " "), str(path))
        self.choice.blockSignals(False)
        self._load()

    def _load(self) -> None:
        path = self.choice.currentData()
        self._show(QImage())
        self._loader.call(QImage if path is None else partial(read_figure, Path(path)))

    def _show(self, found: object) -> None:
        self._pixmap = QPixmap.fromImage(found) if isinstance(found, QImage) else QPixmap()
        self._fit()

    def _fit(self) -> None:
        if self._pixmap.isNull():
            self.picture.setText(texts.FIGURE_READING if self._finder.busy or self._loader.busy else texts.NO_FIGURE)
            return
        ratio = self.devicePixelRatioF()
        scaled = self._pixmap.scaled(
            self.picture.size() * ratio, Qt.AspectRatioMode.KeepAspectRatio, Qt.TransformationMode.SmoothTransformation
        )
        scaled.setDevicePixelRatio(ratio)
        self.picture.setPixmap(scaled)
