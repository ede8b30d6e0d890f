"""Samples of one or more channels at screen resolution, with cursors and the spectrum of the visible range."""

from collections.abc import Sequence
from functools import partial
from math import isfinite
from typing import cast

import numpy as np
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QHBoxLayout,
    QMenu,
    QPushButton,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from bench.app.display import texts
from bench.app.display.run_file import RunFile
from bench.app.display.samples import DRIVE, Probe, Spectrum, Stretch, Track, probe, read_spectra, read_stretches
from bench.app.display.theme import Theme
from bench.app.display.typography import in_screen_unit
from bench.app.formatting import number
from bench.app.gui.background import FileReader
from bench.app.gui.sample_plot import Line, SamplePlot
from bench.app.gui.widgets import ElidingLabel
from bench.document.typography import label

PARTS = 1200
"""Smallest number of parts of the visible range, each drawn as its minimum and maximum. With fewer than twice as many
samples, each sample is drawn.
"""
SETTLE = 150
"""Delay from a zoom or a cursor movement to the reading of the file [ms]."""
MOST = 12
"""Largest number of drawn lines."""
LEAST = 1e-12
"""Lower bound of the drawn amplitudes, because the axis is logarithmic."""


class HistoryView(QWidget):
    """Plots of channels of a run, and of the same channels of the other ticked files, read by the reading process."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._file: RunFile | None = None
        self._others: Sequence[RunFile] = ()
        self.shown: list[Stretch] = []
        self._problems = dict[str, str]()
        """Errors by what they concern."""
        self.run, self.channel, self.further = QComboBox(), QComboBox(), QPushButton(texts.FURTHER)
        self._menu = QMenu(self)
        self.overlay = QCheckBox(texts.OVERLAY)
        self.with_cursors, self.with_spectrum = QCheckBox(texts.CURSORS), QCheckBox(texts.SPECTRUM)
        self.whole, self.message, self.reading = QPushButton(texts.WHOLE), ElidingLabel(), ElidingLabel()
        self.plot = SamplePlot(theme, texts.SINCE_ARMED, "")
        self.spectrum = SamplePlot(theme, texts.SPECTRUM_AXIS, texts.AMPLITUDE, log=True)
        self._readers = [FileReader(self) for _ in range(3)]
        self._wait, self._probe = (QTimer(self, interval=SETTLE, singleShot=True) for _ in range(2))
        self._arrange()
        for reader, take in zip(self._readers, (self._draw, self._draw_spectrum, self._read_out), strict=True):
            reader.found.connect(take)
        self._wait.timeout.connect(self.read)
        self._probe.timeout.connect(self._read_cursors)
        self.run.currentIndexChanged.connect(self.show_whole)
        self.channel.currentIndexChanged.connect(self._choose_channel)
        self.whole.clicked.connect(self.show_whole)
        self._menu.triggered.connect(self.read)
        self.overlay.toggled.connect(self.read)
        self.with_cursors.toggled.connect(self._show_cursors)
        self.with_spectrum.toggled.connect(self._show_spectrum)
        self.plot.range_changed.connect(self._wait.start)
        self.plot.cursors_moved.connect(self._move_cursors)

    @property
    def tracks(self) -> list[Track]:
        """The channels to be drawn: those of the selected file, then the same ones of the other ticked files; at most
        `MOST`.
        """
        file, row = self._file, self.run.currentIndex()
        if file is None or row < 0 or self.channel.currentIndex() < 0:
            return []
        run = list(file.runs)[row]
        names = [str(self.channel.currentData())]
        names += [str(each.data()) for each in self._menu.actions() if each.isChecked() and each.data() not in names]
        others = [each for each in self._others if each is not file] if self.overlay.isChecked() else []
        found = [
            Track(each.path, run, name, f"{each.name}: {label(name)}" if others else label(name))
            for each in (file, *others)
            for name in names
            if name in each.channels and run in each.runs
        ]
        return found[:MOST]

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self.plot.use_theme(theme)
        self.spectrum.use_theme(theme)

    def use(self, file: RunFile | None) -> None:
        """Show the samples of this file, with the same channels as before, as far as the file contains them."""
        self._file = file
        self._problems.clear()
        self._show_problems()
        kept, checked = self.channel.currentData(), {each.data() for each in self._menu.actions() if each.isChecked()}
        for choice in (self.run, self.channel):
            choice.blockSignals(True)
            choice.clear()
        self._menu.clear()
        if file is not None:
            self.run.addItems([texts.RUN_ITEM.format(number=run, seconds=length) for run, length in file.runs.items()])
            for name in file.channels:
                self.channel.addItem(label(name), name)
                action = self._menu.addAction(label(name))
                action.setData(name)
                action.setCheckable(True)
                action.setChecked(name in checked)
            chosen = kept if kept in file.channels else next(iter(file.channels), DRIVE)
            self.channel.setCurrentIndex(self.channel.findData(chosen))
        for choice in (self.run, self.channel):
            choice.blockSignals(False)
        self.shown = []
        self.plot.draw(())
        self.spectrum.draw(())
        self.reading.setText("")
        self._choose_channel()
        self.show_whole()

    def compare(self, files: Sequence[RunFile]) -> None:
        """Offer to draw the same channels of the ticked `files` as well."""
        self._others = files
        self.overlay.setEnabled(len(files) > 1)
        if self.overlay.isChecked():
            self.read()

    def show_whole(self) -> None:
        """Show the whole run."""
        if self._file is not None and self.run.currentIndex() >= 0:
            length = list(self._file.runs.values())[self.run.currentIndex()]
            rate = self._file.sample_rate
            self.plot.samples = (1.0 / rate, max(round(length * rate) - 1, 0))
            self.plot.show_range(0.0, max(length, 1e-3))
            self._wait.stop()
            self.read()

    def read(self) -> None:
        """Read the visible range."""
        if tracks := self.tracks:
            begin, end = self.plot.visible
            self._readers[0].call(partial(read_stretches, tracks, begin, end, PARTS))
            if self.with_spectrum.isChecked():
                self._readers[1].call(partial(read_spectra, tracks, begin, end))
            self._probe.start()
        else:
            # the results of earlier calls belong to another file
            for reader in self._readers:
                reader.drop()

    def _choose_channel(self) -> None:
        for action in self._menu.actions():
            action.setEnabled(action.data() != self.channel.currentData())
        self.read()

    def _show_cursors(self, on: bool) -> None:
        self._report(texts.CURSORS, None)
        self.plot.show_cursors(on=on)

    def _show_spectrum(self, on: bool) -> None:
        self._report(texts.SPECTRUM, None)
        self.spectrum.setVisible(on)
        self.read()

    def _draw(self, found: object) -> None:
        if not self._report(texts.SAMPLES, found):
            self.shown = cast("list[Stretch]", found)
            lines = list[Line]()
            for each in self.shown:
                factor, unit = in_screen_unit(each.unit)
                lines.append(Line(each.track.name, unit, each.time, factor * each.values))
            self.plot.draw(lines)

    def _draw_spectrum(self, found: object) -> None:
        if not self.with_spectrum.isChecked():
            return
        if self._report(texts.SPECTRUM, found):
            self.spectrum.draw(())
            return
        lines = list[Line]()
        for each in cast("list[Spectrum]", found):
            factor, unit = in_screen_unit(each.unit)
            lines.append(Line(each.track.name, unit, each.frequency, np.maximum(factor * each.amplitude, LEAST)))
        self.spectrum.draw(lines)
        if lines:
            self.spectrum.show_range(0.0, max(float(line.x[-1]) for line in lines))

    def _report(self, of: str, found: object) -> bool:
        """Whether `found` is an error, which is shown until its subject `of` is read without one or is hidden."""
        self._problems.pop(of, None)
        failed = isinstance(found, Exception)
        if failed:
            self._problems[of] = texts.PROBLEM.format(of=of, why=found)
        self._show_problems()
        return failed

    def _show_problems(self) -> None:
        self.message.setText(f"▲ {' · '.join(self._problems.values())}")
        self.message.setVisible(bool(self._problems))

    def _move_cursors(self) -> None:
        cursors = self.plot.cursors
        self.reading.setVisible(cursors is not None)
        if cursors is not None:
            self.reading.setText(_times(*cursors))
            self._probe.start()

    def _read_cursors(self) -> None:
        if self.plot.cursors is not None and (tracks := self.tracks):
            self._readers[2].call(partial(probe, tracks, self.plot.cursors))

    def _read_out(self, found: object) -> None:
        if self.plot.cursors is None or self._report(texts.CURSORS, found):
            return
        read = cast(Probe, found)
        parts = [_times(*read.times)]
        units = dict[str, str]() if self._file is None else self._file.channels
        for track, (first, second) in zip(read.tracks, read.values, strict=True):
            factor, unit = in_screen_unit(units.get(track.channel, ""))
            a, b = (number(factor * value) for value in (first, second))
            step = f"{factor * (second - first):+.4g}" if isfinite(second - first) else texts.NO_VALUE
            parts.append(texts.CURSOR_VALUES.format(name=track.name, a=a, b=b, step=step, unit=unit))
        self.reading.setText(" · ".join(parts))

    def _arrange(self) -> None:
        self.run.setAccessibleName(texts.RUN)
        self.channel.setAccessibleName(texts.CHANNEL)
        self.plot.setAccessibleName(texts.NAMES["history"])
        self.spectrum.setAccessibleName(texts.SPECTRUM)
        self.further.setMenu(self._menu)
        for part, tip in (
            (self.further, texts.FURTHER_TIP),
            (self.overlay, texts.OVERLAY_TIP),
            (self.with_cursors, texts.CURSORS_TIP),
            (self.with_spectrum, texts.SPECTRUM_TIP),
        ):
            part.setToolTip(tip)
        self.overlay.setEnabled(False)
        # narrow buttons, so that the row fits a screen 1024 px wide
        for button in (self.further, self.whole):
            button.setProperty("tight", "yes")
        row = QHBoxLayout()
        for part in (
            *(self.run, self.channel, self.further, self.overlay),
            *(self.with_cursors, self.with_spectrum, self.whole),
        ):
            row.addWidget(part)
        row.addStretch(1)
        plots = QSplitter()
        plots.setChildrenCollapsible(False)
        for part in (self.plot, self.spectrum):
            plots.addWidget(part)
        plots.setSizes([600, 400])
        for part in (self.spectrum, self.reading, self.message):
            part.hide()
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(row)
        column.addWidget(plots, 1)
        column.addWidget(self.reading)
        column.addWidget(self.message)


def _times(first: float, second: float) -> str:
    step = second - first
    rate = number(1.0 / abs(step)) if step else texts.NO_VALUE
    return texts.CURSOR_TIMES.format(a=first, b=second, step=step, rate=rate)
