"""Reports and exports of a data file, created by `rockbench report` and `rockbench export`; existing files are never
overwritten.
"""

from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

from PySide6.QtCore import QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QPushButton, QSizePolicy, QWidget

from bench.app.catalogue import format_names
from bench.app.display import texts
from bench.app.export.format import load_format
from bench.app.gui.background import Command, Reader
from bench.app.gui.widgets import set_level
from sim.errors import InvalidInput

FORMS = {"HTML": ("report", "--html"), "PDF": ("report", "--pdf")}


def free(path: Path) -> Path:
    """`path`, or the first of path-2, path-3, ... that does not exist."""
    number, found = 1, path
    while found.exists():
        number += 1
        found = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return found


class Outputs(QWidget):
    """Row of controls that create a report or an export of a file: format and button for each, and the result."""

    def __init__(self) -> None:
        super().__init__()
        self._file: Path | None = None
        self._made: Path | None = None
        self._command: Command | None = None
        self._arguments: Sequence[str] = ()
        self._reader = Reader(self)
        self._reader.found.connect(self._run)
        self.form, self.format = QComboBox(), QComboBox()
        self.form.addItems(list(FORMS))
        self.form.setAccessibleName(texts.REPORT)
        for name in format_names():
            with suppress(InvalidInput):
                self.format.addItem(load_format(name).title, name)
        self.format.setCurrentIndex(max(self.format.findData("mat"), 0))
        self.format.setAccessibleName(texts.EXPORT)
        self.report, self.export = QPushButton(texts.REPORT), QPushButton(texts.EXPORT)
        self.report.setToolTip(texts.REPORT_TIP)
        self.export.setToolTip(texts.EXPORT_TIP)
        self.message, self.open_made = QLabel(wordWrap=True), QPushButton(texts.OPEN_MADE)
        self.message.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.report.clicked.connect(self._report)
        self.export.clicked.connect(self._export)
        self.open_made.clicked.connect(self._open)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        for part in (self.form, self.report, self.format, self.export):
            row.addWidget(part)
        row.addWidget(self.message, 1)
        row.addWidget(self.open_made)
        self.open_made.hide()
        self._refresh()

    def use(self, file: Path | None) -> None:
        """Set the data file to be reported on or exported."""
        self._file = file
        self._refresh()

    def _report(self) -> None:
        file = self._file
        if file is not None:
            command, flag = FORMS[self.form.currentText()]
            ending = flag.removeprefix("--")
            self._make(file.with_suffix(f".report.{ending}"), command, str(file), flag)

    def _export(self) -> None:
        file = self._file
        if file is not None:
            to = str(self.format.currentData())
            self._make(file.with_name(f"{file.stem}-{to}"), "export", str(file), "--to", to, "--out")

    def _make(self, wanted: Path, *arguments: str) -> None:
        """Start the command, with an unused name that a thread searches: the disk may stall."""
        self._arguments = arguments
        self._reader.call(partial(free, wanted))
        self._say(texts.MAKING.format(path=wanted), "calm")
        self.open_made.hide()
        self._refresh()

    def _run(self, made: object) -> None:
        if isinstance(made, Path):
            self._made = made
            self._command = Command([*self._arguments, str(made)], self)
            self._command.over.connect(self._over)
            self._say(texts.MAKING.format(path=made), "calm")
        else:
            self._say(texts.NOT_MADE.format(text=made), "alarm")
        self._refresh()

    def _over(self, code: int, text: str) -> None:
        done = code == 0
        self._say(
            texts.MADE.format(path=self._made) if done else texts.NOT_MADE.format(text=text),
            "calm" if done else "alarm",
        )
        self.open_made.setVisible(done)
        if self._command is not None:
            self._command.deleteLater()
        self._command = None
        self._refresh()

    def _open(self) -> None:
        if self._made is not None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(self._made.resolve())))

    def _say(self, text: str, level: str) -> None:
        self.message.setText(f"▲ {text}" if level == "alarm" else text)
        set_level(self.message, level)

    def _refresh(self) -> None:
        for button in (self.report, self.export):
            button.setEnabled(self._file is not None and self._command is None and not self._reader.busy)
