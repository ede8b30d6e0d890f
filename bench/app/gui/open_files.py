# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
"""The open data files: their descriptions, the list in which they are selected, and the plot of their samples.

The plot shows one channel of one run at screen resolution, and is reloaded after a zoom.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from bench.app.catalogue import load_protocol
from bench.app.formatting import clock
from bench.app.gui import texts
from bench.app.gui.background import Reader
from bench.app.gui.gains import mark_of
from bench.app.gui.palette import Theme
from bench.app.gui.widgets import colour_axes, in_screen_unit, label
from bench.app.ipc.messages import extremes
from bench.datafile.tables import Column, Table
from bench.document.typography import moment
from sim.errors import RockbenchError

DRIVE = "drive"
CHUNK = 1_000_000
"""Number of rows read at a time, because an hour of samples does not fit into memory."""


@dataclass(frozen=True, eq=False)
class RunFile:
    """Description of a file, its points and its prediction; `runs` holds the numbers of its runs and their durations
    [s].
    """

    path: Path
    headline: str
    points: list[dict[str, Any]]
    results: Mapping[str, Column]
    prediction: Table
    channels: Mapping[str, str]
    """Name and unit of every channel, the drive last."""
    runs: Mapping[int, float]
    labels: Mapping[str, str] = field(default_factory=dict[str, str])
    """Printed names of fields of a point, as declared by the protocol."""

    @property
    def has_gains(self) -> bool:
        """Whether any point has the fields of a gain."""
        return any(mark_of(point) is not None for point in self.points)

    @property
    def name(self) -> str:
        """Short name: the name of the folder, since the files of all runs have the same name."""
        return self.path.resolve().parent.name or self.path.stem


@dataclass(frozen=True, eq=False)
class Stretch:
    """Samples of a channel from `begin` to `end` [s] as a line through the minimum and maximum of each part in turn.
    Both arrays have shape (n,); values are in the channel's unit.
    """

    time: NDArray[np.float64]
    values: NDArray[np.float32]
    channel: str
    unit: str
    begin: float
    end: float


def read_file(path: Path) -> RunFile:
    """Read the description of a file. Raises RockbenchError for a file that is unreadable or of another format."""
    from bench.datafile.reader import open_datafile

    with open_datafile(path) as record:
        length = clock(record.rows / record.sample_rate)
        return RunFile(
            path,
            texts.FILE_TOLD.format(
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
    """Printed names of the results of a protocol; empty for a protocol that is not installed."""
    try:
        return load_protocol(protocol).view.labels
    except RockbenchError:
        return {}


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


class Place(Enum):
    """Selection of an added file: ticked in addition to others (TOO), ticked ALONE, or only listed (ASIDE)."""

    TOO = auto()
    ALONE = auto()
    ASIDE = auto()


class FileList(QListWidget):
    """The open files, in the order of opening."""

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
        """Add `file`; replaces an earlier reading of the same file."""
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
        # a file that is only listed causes no redrawing
        if row == self.currentRow():
            self.chosen_changed.emit()
        if self.item(row).checkState() == Qt.CheckState.Checked:
            self.ticked_changed.emit()

    def _tick(self, row: int, *, alone: bool) -> None:
        for each in range(self.count()):
            if each == row or alone:
                self.item(each).setCheckState(Qt.CheckState.Checked if each == row else Qt.CheckState.Unchecked)

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
        """The path in pasted text."""
        return Path(text.strip().strip("'\"")).expanduser()


PARTS = 1200
"""Number of parts of the visible range, with two points each."""
SETTLE = 150
"""Delay between a zoom and the reading of the file [ms]."""


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
