"""The bench: its configuration, its devices, and the check of its loop."""

from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QSplitter, QVBoxLayout, QWidget

from bench.config.model import BenchConfiguration
from bench.config.specimen_file import read_specimen
from bench.config.toml import read_configuration, with_identified
from bench.gui import texts
from bench.gui.buttons import give_key
from bench.gui.check_panel import CheckPanel
from bench.gui.configuration_tree import ConfigurationTree
from bench.gui.controller import Controller
from bench.gui.devices_panel import DevicesPanel
from bench.gui.file_dialog import ask_for_files, why_no_dialog
from bench.gui.header import set_level
from bench.gui.palette import Theme
from sim.errors import RockbenchError


class SetupPage(QWidget):
    """A configuration is changed in its file; here another one is opened, while nothing runs."""

    opened = Signal(object)
    """The `BenchConfiguration` that every run is given from now on."""

    def __init__(
        self, controller: Controller, configuration: BenchConfiguration, path: Path | None, theme: Theme
    ) -> None:
        super().__init__()
        self._controller = controller
        self.configuration, self.path = configuration, path
        self._specimen: Path | None = None
        self.source = QLabel(wordWrap=True)
        self.open_file, self.open_specimen = QPushButton(texts.OPEN_CONFIGURATION), QPushButton(texts.OPEN_SPECIMEN)
        self.tree, self.devices = ConfigurationTree(), DevicesPanel(controller)
        self.loop = CheckPanel(controller, theme)
        self._arrange()
        self.open_file.clicked.connect(self._ask_configuration)
        self.open_specimen.clicked.connect(self._ask_specimen)
        controller.changed.connect(self._refresh)
        self._show()
        self._refresh()

    def open_configuration(self, path: Path) -> None:
        """Use the configuration in a file; one that is refused says why, and what was open stays."""
        try:
            configuration = read_configuration(path)
        except RockbenchError as error:
            self._say(f"▲ {texts.CONFIGURATION_KEPT.format(text=error)}", "alarm")
            return
        self._specimen = None
        self._use(configuration, path)

    def open_identified(self, path: Path) -> None:
        """Use what was identified of the specimen; a file that is refused says why, and what was open stays."""
        try:
            configuration = with_identified(self.configuration, read_specimen(path))
        except RockbenchError as error:
            self._say(f"▲ {texts.CONFIGURATION_KEPT.format(text=error)}", "alarm")
            return
        self._specimen = path
        self._use(configuration, self.path)

    def use_theme(self, theme: Theme) -> None:
        """Take the colours of another theme."""
        self.loop.use_theme(theme)

    def _use(self, configuration: BenchConfiguration, path: Path | None) -> None:
        self.configuration, self.path = configuration, path
        self._show()
        self.opened.emit(configuration)

    def _show(self) -> None:
        lines = [f"{texts.CONFIGURATION}: {self.path or texts.VIRTUAL}"]
        if self._specimen is not None:
            lines.append(texts.IDENTIFIED.format(path=self._specimen))
        self._say("\n".join(lines), "calm")
        self.tree.use(self.configuration)
        self.devices.use(self.configuration, self.path)
        self.loop.use(self.configuration)

    def _say(self, text: str, level: str) -> None:
        self.source.setText(text)
        set_level(self.source, level)

    def _ask_configuration(self) -> None:
        kinds, title = texts.CONFIGURATION_FILES, texts.OPEN_CONFIGURATION
        ask_for_files(self, self._controller, title, kinds, lambda paths: self.open_configuration(paths[0]))

    def _ask_specimen(self) -> None:
        kinds, title = texts.SPECIMEN_FILES, texts.OPEN_SPECIMEN
        ask_for_files(self, self._controller, title, kinds, lambda paths: self.open_identified(paths[0]))

    def _refresh(self) -> None:
        why = why_no_dialog(self._controller)
        for button, tip in (
            (self.open_file, texts.OPEN_CONFIGURATION_TIP),
            (self.open_specimen, texts.OPEN_SPECIMEN_TIP),
        ):
            button.setEnabled(not why)
            button.setToolTip(why or tip)

    def _arrange(self) -> None:
        give_key(self.open_file, "Ctrl+Shift+O")
        give_key(self.open_specimen, "Ctrl+Shift+P")
        self.source.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        left = QWidget()
        column = QVBoxLayout(left)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.source)
        buttons = QHBoxLayout()
        buttons.addWidget(self.open_file)
        buttons.addWidget(self.open_specimen)
        column.addLayout(buttons)
        column.addWidget(self.tree, 1)
        right = QSplitter(Qt.Orientation.Vertical)
        right.setChildrenCollapsible(False)
        for part in (self.devices, self.loop):
            right.addWidget(part)
        right.setSizes([150, 450])
        whole = QSplitter()
        whole.setChildrenCollapsible(False)
        whole.addWidget(left)
        whole.addWidget(right)
        whole.setSizes([410, 830])
        QVBoxLayout(self).addWidget(whole)
