"""The configuration that the window was opened with, as the text of its file."""

from pathlib import Path

from PySide6.QtWidgets import QLabel, QPlainTextEdit, QVBoxLayout, QWidget

from bench.config.dump import as_toml
from bench.config.model import BenchConfiguration
from bench.gui import texts


class SetupPage(QWidget):
    """Read only: a configuration is changed in its file, and every run is told the same one."""

    def __init__(self, configuration: BenchConfiguration, path: Path | None) -> None:
        super().__init__()
        self.source = QLabel(f"{texts.CONFIGURATION}: {path or texts.VIRTUAL}", wordWrap=True)
        self.text = QPlainTextEdit(as_toml(configuration), readOnly=True)
        self.text.setAccessibleName("configuration")
        layout = QVBoxLayout(self)
        layout.addWidget(self.source)
        layout.addWidget(self.text, 1)
