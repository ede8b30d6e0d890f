"""The log of a run: all lines or those that contain a search text, and the field for the operator's notes."""

from collections import deque

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QPlainTextEdit, QPushButton, QVBoxLayout, QWidget

from bench.app.display import texts
from bench.app.display.typography import typeset
from bench.app.formatting import clock
from bench.app.gui.controller import Controller
from bench.app.run_display import Notice
from bench.events import State

LOG_LINES = 2000
"""Largest number of stored lines; older ones are discarded."""


class LogPanel(QWidget):
    """Lines of the log, oldest first. A note appears in the log once it is stored in the data file."""

    def __init__(self, controller: Controller) -> None:
        super().__init__()
        self._controller = controller
        self._lines = deque[str](maxlen=LOG_LINES)
        self.text = QPlainTextEdit(readOnly=True, maximumBlockCount=LOG_LINES)
        self.text.setMinimumHeight(50)
        self.text.setAccessibleName(texts.NAMES["log"])
        self.filter, self.note = QLineEdit(), QLineEdit()
        for field, hint, tip, key in (
            (self.filter, texts.LOG_FILTER, texts.LOG_FILTER_TIP, "Ctrl+Shift+L"),
            (self.note, texts.NOTE_FIELD, texts.NOTE_ADD_TIP, "Ctrl+Shift+N"),
        ):
            field.setPlaceholderText(hint)
            field.setAccessibleName(hint)
            field.setToolTip(tip)
            QShortcut(QKeySequence(key), field, field.setFocus)
        self.add_note = QPushButton(texts.NOTE_ADD)
        self.add_note.setToolTip(texts.NOTE_ADD_TIP)
        self.add_note.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.filter.textChanged.connect(self._show)
        self.note.returnPressed.connect(self._send)
        self.add_note.clicked.connect(self._send)
        row = QHBoxLayout()
        row.addWidget(self.filter, 1)
        row.addWidget(self.note, 2)
        row.addWidget(self.add_note)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.text, 1)
        column.addLayout(row)
        controller.noticed.connect(self._add)
        controller.changed.connect(self._refresh)
        self._refresh()

    def clear(self) -> None:
        """Clear the log for a new run."""
        self._lines.clear()
        self.text.clear()

    def _add(self, notice: Notice) -> None:
        mark = "▲ " if notice.grave else ""
        line = f"{clock(notice.time):>8}  {mark}{notice.kind}: {typeset(notice.text)}"
        self._lines.append(line)
        if self._shown(line):
            self.text.appendPlainText(line)

    def _shown(self, line: str) -> bool:
        return self.filter.text().casefold() in line.casefold()

    def _show(self) -> None:
        self.text.setPlainText("\n".join(line for line in self._lines if self._shown(line)))
        bar = self.text.verticalScrollBar()
        bar.setValue(bar.maximum())

    @property
    def _stores(self) -> bool:
        """Whether a note would be stored: the data file is closed before the figures are drawn."""
        return self._controller.running and self._controller.session.scene.state is not State.CLOSED

    def _send(self) -> None:
        if self._stores and self.note.text().strip():
            self._controller.note(self.note.text())
            self.note.clear()

    def _refresh(self) -> None:
        for part in (self.note, self.add_note):
            part.setEnabled(self._stores)
