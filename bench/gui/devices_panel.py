"""Which devices there are: the answer of `rockbench devices`, asked in a process of its own."""

from pathlib import Path

from PySide6.QtWidgets import QHBoxLayout, QLabel, QPlainTextEdit, QPushButton, QVBoxLayout, QWidget

from bench.config.model import BenchConfiguration
from bench.gui import texts
from bench.gui.background import Command
from bench.gui.buttons import give_key
from bench.gui.controller import Controller
from bench.gui.header import set_level


class DevicesPanel(QWidget):
    """Looks only when asked, and never while a run or the queue has the devices."""

    def __init__(self, controller: Controller) -> None:
        super().__init__()
        self._controller = controller
        self._path: Path | None = None
        self._command: Command | None = None
        self.ask = QPushButton(texts.FIND)
        give_key(self.ask, "Ctrl+D")
        self.told = QLabel(texts.FIND_EMPTY, wordWrap=True)
        self.found = QPlainTextEdit(readOnly=True)
        self.found.setAccessibleName(texts.NAMES["devices"])
        self.found.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        row = QHBoxLayout()
        row.addWidget(self.told, 1)
        row.addWidget(self.ask)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(row)
        column.addWidget(self.found, 1)
        self.ask.clicked.connect(self.look)
        controller.changed.connect(self._refresh)
        self._refresh()

    def use(self, configuration: BenchConfiguration, path: Path | None) -> None:
        """Look on the server and the ports of this configuration, which was read from `path`."""
        self._path = path
        simulated = configuration.backend == "simulated"
        self._say(texts.FIND_SIMULATED if simulated else texts.FIND_EMPTY, "calm")
        self.found.clear()

    def look(self) -> None:
        """Ask; the answer comes some seconds later."""
        if self._command is not None or not self.ask.isEnabled():
            return
        self._command = Command(["devices", *(["--config", str(self._path)] if self._path else [])], self)
        self._command.over.connect(self._over)
        self._say(texts.FINDING, "wait")
        self._refresh()

    def _over(self, code: int, text: str) -> None:
        if self._command is not None:
            self._command.deleteLater()
        self._command = None
        if code == 0:
            self._say(texts.FOUND, "calm")
            self.found.setPlainText(text)
        else:
            self._say(f"▲ {texts.FIND_FAILED.format(text=text.splitlines()[-1] if text else code)}", "alarm")
        self._refresh()

    def _say(self, text: str, level: str) -> None:
        self.told.setText(text)
        set_level(self.told, level)

    def _refresh(self) -> None:
        why = texts.START_BUSY if self._controller.running else self._controller.held
        self.ask.setEnabled(not why and self._command is None)
        self.ask.setToolTip(why or texts.FIND_TIP)
