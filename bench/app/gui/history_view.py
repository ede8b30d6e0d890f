# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
"""Plot of the samples of one channel of one run at screen resolution, reloaded after a zoom."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from bench.app.display import texts
from bench.app.display.theme import Theme
from bench.app.display.typography import in_screen_unit, label
from bench.app.gui.background import Reader
from bench.app.gui.open_files import DRIVE, RunFile
from bench.app.gui.widgets import colour_axes
from bench.app.ipc.messages import extremes

CHUNK = 1_000_000
"""Number of rows read at a time, because an hour of samples does not fit into memory."""


PARTS = 1200
"""Number of parts of the visible range, with two points each."""
SETTLE = 150
"""Delay between a zoom and the reading of the file [ms]."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Samples of a channel from `begin` to `end` [s] as a line through the minimum and the maximum of each of its
    parts in turn. Both arrays have shape (n,); values are in the channel's unit.
    """

    time: NDArray[np.float64]
    values: NDArray[np.float32]
    channel: str
    unit: str
    begin: float
    end: float


def read_stretch(path: Path, run: int, channel: str, begin: float, end: float, parts: int) -> Stretch:
    """Samples of channel `channel` of run `run` between two times [s] since the rig was armed, in at most `parts`
    parts.

    An interval with fewer than two samples per part is returned sample by sample. Raises RockbenchError.
    """
    from bench.datafile.reader import open_datafile

    with open_datafile(path) as record:
        rate = record.sample_rate
        rows = next(each.rows for each in record.runs if each.number == run)
        first = rows.start + min(max(int(begin * rate), 0), len(rows))
        last = rows.start + min(max(int(np.ceil(end * rate)) + 1, 0), len(rows))
        unit = "V" if channel == DRIVE else next(each.unit for each in record.channels if each.name == channel)
        width = max((last - first) // max(parts, 1), 1)
        lows, highs = [np.zeros(0, np.float32)], [np.zeros(0, np.float32)]
        step = max(CHUNK // width, 1) * width
        for at in range(first, last, step):
            part = slice(at, min(at + step, last))
            values = record.drive(part).astype(np.float64) if channel == DRIVE else record.values(channel, part)
            low, high = extremes(values[:, None], width)
            lows.append(low[:, 0])
            highs.append(high[:, 0])
    low, high = np.concatenate(lows), np.concatenate(highs)
    time = (first - rows.start + width * np.arange(low.size, dtype=np.float64)) / rate
    if width == 1:
        return Stretch(time, low, channel, unit, begin, end)
    return Stretch(np.repeat(time, 2), np.column_stack((low, high)).ravel(), channel, unit, begin, end)


class HistoryView(QWidget):
    """Plot of a channel; the wheel zooms in time, dragging pans, and a thread reads the file."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._file: RunFile | None = None
        self.shown: Stretch | None = None
        self.run, self.channel = QComboBox(), QComboBox()
        self.run.setAccessibleName(texts.RUN)
        self.channel.setAccessibleName(texts.CHANNEL)
        self.whole, self.message = QPushButton(texts.WHOLE), QLabel()
        self._plot = plot = pg.PlotWidget(enableMenu=False)
        plot.setAccessibleName(texts.NAMES["history"])
        self._item: Any = plot.getPlotItem()
        self._item.setMouseEnabled(x=True, y=False)
        self._item.hideButtons()
        self._item.showGrid(x=True, y=True, alpha=0.25)
        self.curve: Any = self._item.plot()
        self.use_theme(theme)
        row = QHBoxLayout()
        for name, choice in ((texts.RUN, self.run), (texts.CHANNEL, self.channel)):
            row.addWidget(QLabel(name))
            row.addWidget(choice)
        row.addWidget(self.whole)
        row.addWidget(self.message, 1)
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
        self._plot.setBackground(theme.raised)
        colour_axes(self._item, theme)
        self._item.setLabel("bottom", texts.SINCE_ARMED, color=theme.text)
        self.curve.setPen(pg.mkPen(theme.lines[1], width=1))

    def use(self, file: RunFile | None) -> None:
        """Show the samples of this file."""
        self._file = file
        kept = self.channel.currentData()
        for choice in (self.run, self.channel):
            choice.blockSignals(True)
            choice.clear()
        if file is not None:
            self.run.addItems([texts.RUN_ITEM.format(number=run, seconds=length) for run, length in file.runs.items()])
            for name in file.channels:
                self.channel.addItem(label(name), name)
            chosen = kept if kept in file.channels else next(iter(file.channels), DRIVE)
            self.channel.setCurrentIndex(self.channel.findData(chosen))
        for choice in (self.run, self.channel):
            choice.blockSignals(False)
        self.curve.setData([], [])
        self.shown = None
        self.show_whole()

    def show_whole(self) -> None:
        if self._file is not None and self.run.currentIndex() >= 0:
            length = list(self._file.runs.values())[self.run.currentIndex()]
            self._item.setXRange(0.0, max(length, 1e-3), padding=0.0)
            self._wait.stop()
            self.read()

    def read(self) -> None:
        file = self._file
        if file is None or self.run.currentIndex() < 0 or self.channel.currentIndex() < 0:
            return
        (begin, end), _ = self._item.viewRange()
        run = list(file.runs)[self.run.currentIndex()]
        self._reader.call(partial(read_stretch, file.path, run, str(self.channel.currentData()), begin, end, PARTS))

    def _look_closer(self) -> None:
        self._wait.start()

    def _draw(self, found: object) -> None:
        if not isinstance(found, Stretch):
            self.message.setText(f"▲ {found}")
            return
        self.shown = found
        self.message.setText("")
        factor, unit = in_screen_unit(found.unit)
        self._item.setLabel("left", f"{label(found.channel)} [{unit}]")
        self.curve.setData(found.time, factor * found.values, connect="finite")
        self._item.enableAutoRange(axis="y")
