# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
"""What was recorded: one channel of one run, as coarse as the screen and read anew where it is looked at closer."""

from functools import partial
from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from bench.gui import texts
from bench.gui.axes import colour_axes
from bench.gui.background import Reader
from bench.gui.palette import Theme
from bench.gui.run_file import DRIVE, RunFile, Stretch, read_stretch

PARTS = 1200
"""Parts of what is seen, with two points each."""
SETTLE = 150
"""Rest after a zoom before the file is read [ms]."""


class HistoryView(QWidget):
    """The wheel zooms in time, dragging moves; the file is read in a thread."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._file: RunFile | None = None
        self.shown: Stretch | None = None
        self.run, self.channel = QComboBox(), QComboBox()
        self.run.setAccessibleName(texts.RUN)
        self.channel.setAccessibleName(texts.CHANNEL)
        self.whole, self.told = QPushButton(texts.WHOLE), QLabel()
        self._plot = plot = pg.PlotWidget()
        plot.setAccessibleName(texts.NAMES["history"])
        self._item: Any = plot.getPlotItem()
        self._item.setMouseEnabled(x=True, y=False)
        self._item.setMenuEnabled(False)
        self._item.hideButtons()
        self._item.showGrid(x=True, y=True, alpha=0.25)
        self.curve: Any = self._item.plot()
        self.use_theme(theme)
        row = QHBoxLayout()
        for name, field in ((texts.RUN, self.run), (texts.CHANNEL, self.channel)):
            row.addWidget(QLabel(name))
            row.addWidget(field)
        row.addWidget(self.whole)
        row.addWidget(self.told, 1)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(row)
        column.addWidget(plot, 1)
        self._reader = Reader(self)
        self._reader.found.connect(self._draw)
        self._wait = QTimer(self, interval=SETTLE, singleShot=True)
        self._wait.timeout.connect(self.read)
        self.run.currentIndexChanged.connect(self.show_whole)
        self.channel.currentIndexChanged.connect(self.read)
        self.whole.clicked.connect(self.show_whole)
        self._item.sigXRangeChanged.connect(self._look_closer)

    def use_theme(self, theme: Theme) -> None:
        """Take these colours."""
        self._plot.setBackground(theme.raised)
        colour_axes(self._item, theme)
        self._item.setLabel("bottom", texts.SINCE_ARMED, color=theme.text)
        self.curve.setPen(pg.mkPen(theme.lines[1], width=1))

    def use(self, file: RunFile | None) -> None:
        """Show the samples of this file."""
        self._file = file
        kept = self.channel.currentText()
        for field in (self.run, self.channel):
            field.blockSignals(True)
            field.clear()
        if file is not None:
            self.run.addItems([texts.RUN_ITEM.format(number=run, seconds=length) for run, length in file.runs.items()])
            self.channel.addItems(list(file.channels))
            self.channel.setCurrentText(kept if kept in file.channels else next(iter(file.channels), DRIVE))
        for field in (self.run, self.channel):
            field.blockSignals(False)
        self.curve.setData([], [])
        self.shown = None
        self.show_whole()

    def show_whole(self) -> None:
        """The whole of the run."""
        if self._file is not None and self.run.currentIndex() >= 0:
            length = list(self._file.runs.values())[self.run.currentIndex()]
            self._item.setXRange(0.0, max(length, 1e-3), padding=0.0)
            self._wait.stop()
            self.read()

    def read(self) -> None:
        """Read what is seen."""
        file = self._file
        if file is None or self.run.currentIndex() < 0 or not self.channel.currentText():
            return
        (begin, end), _ = self._item.viewRange()
        run = list(file.runs)[self.run.currentIndex()]
        self._reader.call(partial(read_stretch, file.path, run, self.channel.currentText(), begin, end, PARTS))

    def _look_closer(self) -> None:
        self._wait.start()

    def _draw(self, found: object) -> None:
        if not isinstance(found, Stretch):
            self.told.setText(f"▲ {found}")
            return
        self.shown = found
        self.told.setText("")
        self._item.setLabel("left", f"{found.channel} [{found.unit}]")
        self.curve.setData(found.time, found.values, connect="finite")
        self._item.enableAutoRange(axis="y")
