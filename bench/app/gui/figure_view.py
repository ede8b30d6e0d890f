"""The figures that a run wrote next to its data file, and its normalised errors below them."""

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QPixmap, QResizeEvent
from PySide6.QtWidgets import QComboBox, QLabel, QSizePolicy, QVBoxLayout, QWidget

from bench.app.display import texts
from bench.app.display.theme import Theme
from bench.app.gui.score_strip import ScoreStrip


class FigureView(QWidget):
    """The selected figure, as large as the space allows, above the strip of the normalised errors E_n."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.scores = ScoreStrip(theme)
        self.choice, self.picture = QComboBox(), QLabel(alignment=Qt.AlignmentFlag.AlignCenter)
        self.choice.setAccessibleName(texts.FIGURE)
        self.picture.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Ignored)
        self._pixmap = QPixmap()
        self.choice.currentIndexChanged.connect(self._load)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.choice)
        column.addWidget(self.picture, 1)
        column.addWidget(self.scores)

    def use(self, file: Path | None) -> None:
        """List the figures in the folder of this data file for selection."""
        found = [] if file is None else sorted(file.parent.glob("*.png"))
        self.choice.blockSignals(True)
        self.choice.clear()
        for path in found:
            self.choice.addItem(path.stem.replace("_", " "), str(path))
        self.choice.blockSignals(False)
        self._load()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Scale the figure to the new size."""
        super().resizeEvent(event)
        self._fit()

    def _load(self) -> None:
        path = self.choice.currentData()
        self._pixmap = QPixmap() if path is None else QPixmap(str(path))
        self._fit()

    def _fit(self) -> None:
        if self._pixmap.isNull():
            self.picture.setText(texts.NO_FIGURE)
            return
        ratio = self.devicePixelRatioF()
        scaled = self._pixmap.scaled(
            self.picture.size() * ratio, Qt.AspectRatioMode.KeepAspectRatio, Qt.TransformationMode.SmoothTransformation
        )
        scaled.setDevicePixelRatio(ratio)
        self.picture.setPixmap(scaled)
