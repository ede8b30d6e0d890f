"""The Setup page: configuration, devices, and loop check."""

from pathlib import Path

from PySide6.QtCore import QSettings, Qt, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from bench.app.display import texts
from bench.app.display.theme import Theme
from bench.app.gui.background import Command
from bench.app.gui.check_panel import CheckPanel
from bench.app.gui.configuration_tree import ConfigurationTree
from bench.app.gui.controller import Controller
from bench.app.gui.recent_files import RecentFiles
from bench.app.gui.widgets import FITTING, ask_for_files, give_key, ignore_wheel, scrolling, set_level, why_no_dialog
from bench.app.result_use import UsableResult
from bench.config.model import BenchConfiguration
from bench.config.toml import former_keys, read_configuration
from sim.errors import RockbenchError


class DevicesPanel(QWidget):
    """Panel that searches for devices, only on request and never during a run or while the queue runs."""

    def __init__(self, controller: Controller) -> None:
        super().__init__()
        self._controller = controller
        self._path: Path | None = None
        self._command: Command | None = None
        self._wanted = False
        """Whether the result of the search is for the present configuration."""
        self.ask = QPushButton(texts.FIND)
        give_key(self.ask, "Ctrl+D")
        self.message = QLabel(texts.FIND_EMPTY, wordWrap=True)
        self.found = QPlainTextEdit(readOnly=True)
        self.found.setAccessibleName(texts.NAMES["devices"])
        self.found.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        row = QHBoxLayout()
        row.addWidget(self.message, 1)
        row.addWidget(self.ask)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(row)
        column.addWidget(self.found, 1)
        self.ask.clicked.connect(self.look)
        controller.changed.connect(self._refresh)
        self._refresh()

    def use(self, configuration: BenchConfiguration, path: Path | None) -> None:
        """Use this configuration, read from `path`, for the next search, and clear the displayed result."""
        if path != self._path:
            # the devices of a search that is under way are those of another configuration
            self._wanted = False
        self._path = path
        simulated = configuration.backend == "simulated"
        self._say(texts.FIND_SIMULATED if simulated else texts.FIND_EMPTY, "calm")
        self.found.clear()

    def look(self) -> None:
        """Start the search, which takes a few seconds."""
        if self._command is not None or not self.ask.isEnabled():
            return
        self._wanted = True
        self._command = Command(["devices", *(["--config", str(self._path)] if self._path else [])], self)
        self._command.over.connect(self._over)
        self._say(texts.FINDING, "wait")
        self._refresh()

    def _over(self, code: int, text: str) -> None:
        if self._command is not None:
            self._command.deleteLater()
        self._command = None
        if not self._wanted:
            self._refresh()
            return
        if code == 0:
            self._say(texts.FOUND, "calm")
            self.found.setPlainText(text)
        else:
            self._say(f"▲ {texts.FIND_FAILED.format(text=text.splitlines()[-1] if text else code)}", "alarm")
        self._refresh()

    def _say(self, text: str, level: str) -> None:
        self.message.setText(text)
        set_level(self.message, level)

    def _refresh(self) -> None:
        why = texts.START_BUSY if self._controller.running else self._controller.held
        self.ask.setEnabled(not why and self._command is None)
        self.ask.setToolTip(why or texts.FIND_TIP)


class SetupPage(QWidget):
    """Shows the configuration, and opens another one while no run is active. A configuration is edited in its file."""

    opened = Signal(object)
    """Emits the `BenchConfiguration` for the following runs."""
    used = Signal(object)
    """Emits the paths of the result files that the following runs use instead of the configured ones, by kind."""
    refused = Signal(str)
    """Emits the reason why a result file is not used."""

    def __init__(
        self,
        controller: Controller,
        configuration: BenchConfiguration,
        path: Path | None,
        theme: Theme,
        settings: QSettings | None = None,
    ) -> None:
        super().__init__()
        self._controller = controller
        self.configuration, self.path = configuration, path
        self._given, self._used = configuration, dict[str, Path]()
        self._notices = () if path is None else former_keys(path)
        self.source = QLabel(wordWrap=True)
        self.open_file, self.open_specimen = QPushButton(texts.OPEN_CONFIGURATION), QPushButton(texts.OPEN_SPECIMEN)
        self.recent = RecentFiles(settings)
        self.tree, self.devices = ConfigurationTree(), DevicesPanel(controller)
        self.loop = CheckPanel(controller, theme)
        self.theme = QComboBox()
        for name, text in texts.THEMES.items():
            self.theme.addItem(text, name)
        self.theme.setAccessibleName(texts.THEME)
        self.theme.setToolTip(texts.THEME_TIP)
        ignore_wheel(self.theme)
        self.sounds = QCheckBox(texts.SOUNDS)
        self.sounds.setChecked(True)
        self.sounds.setToolTip(texts.SOUNDS_TIP)
        self._arrange()
        self.open_file.clicked.connect(self._ask_configuration)
        self.open_specimen.clicked.connect(self._ask_specimen)
        self.recent.chosen.connect(self.open_configuration)
        controller.changed.connect(self._refresh)
        self._show()
        self._refresh()

    def open_configuration(self, path: Path) -> None:
        """Use the configuration in a file; for an invalid file, show the reason and keep the current configuration."""
        try:
            configuration, notices = read_configuration(path), former_keys(path)
        except RockbenchError as error:
            self._say(f"▲ {texts.CONFIGURATION_KEPT.format(text=error)}\n{self._in_use()}", "alarm")
            return
        self._given, self._used, self._notices = configuration, {}, notices
        self._use(configuration, path)

    def open_identified(self, path: Path) -> None:
        """Use the identified specimen in a file, as in `use_result`."""
        self.use_result(UsableResult(path, "specimen"))

    def use_result(self, result: UsableResult) -> None:
        """Use a result of a run for the following runs; for an invalid file, show the reason and keep the current
        configuration.
        """
        try:
            configuration = result.applied(self.configuration)
        except RockbenchError as error:
            text = texts.CONFIGURATION_KEPT.format(text=error)
            self._say(f"▲ {text}\n{self._in_use()}", "alarm")
            self.refused.emit(text)
            return
        self._used[result.kind] = result.path
        self._use(configuration, self.path)

    def use_given(self) -> None:
        """Use the configuration as it was opened, without the results selected since then."""
        self._used = {}
        self._use(self._given, self.path)

    def use_theme(self, theme: Theme) -> None:
        self.loop.use_theme(theme)

    def _use(self, configuration: BenchConfiguration, path: Path | None) -> None:
        self.configuration, self.path = configuration, path
        self._show()
        self.opened.emit(configuration)
        self.used.emit(dict(self._used))

    def _in_use(self) -> str:
        lines = [f"{texts.CONFIGURATION}: {self.path or texts.VIRTUAL}"]
        lines += [texts.IDENTIFIED.format(kind=kind.capitalize(), path=path) for kind, path in self._used.items()]
        return "\n".join((*lines, *self._notices))

    def _show(self) -> None:
        self._say(self._in_use(), "calm")
        if self.path is not None:
            self.recent.add(self.path)
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
        self.recent.hold(why)

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
        column.addWidget(self.recent)
        column.addWidget(self.tree, 1)
        colours = QHBoxLayout()
        colours.addWidget(QLabel(texts.THEME))
        colours.addWidget(self.theme, 1)
        colours.addWidget(self.sounds)
        column.addLayout(colours)
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
        QVBoxLayout(self).addWidget(scrolling(whole, *FITTING))
