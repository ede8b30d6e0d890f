"""Row of controls to use a result of the selected run for the following runs."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import cast

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QPushButton, QWidget

from bench.app.display import texts
from bench.app.gui.background import Reader
from bench.app.gui.controller import Controller
from bench.app.gui.widgets import ElidingLabel, give_key, set_level, why_no_dialog
from bench.app.result_use import UsableResult, results_in


class UseResult(QWidget):
    """Choice of a result, and buttons to use it and to return to the configured values; hidden while there is no result
    to use and none in use.
    """

    wanted = Signal(object)
    """Emits a `UsableResult` that is to be used."""
    returned = Signal()
    """Emitted when the configured values are to be used again."""

    def __init__(self, controller: Controller) -> None:
        super().__init__()
        self._controller = controller
        self._used: Mapping[str, Path] = {}
        self._reader = Reader(self)
        self._reader.found.connect(self._offer)
        self.choice, self.message = QComboBox(), ElidingLabel()
        self.choice.setAccessibleName(texts.USE_CHOICE)
        self.use_it, self.back = QPushButton(texts.USE), QPushButton(texts.USE_BACK)
        give_key(self.use_it, "Ctrl+U")
        give_key(self.back, "Ctrl+Shift+U")
        self.use_it.clicked.connect(self._want)
        self.back.clicked.connect(self.returned)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        for part in (self.choice, self.use_it, self.back):
            row.addWidget(part)
        row.addWidget(self.message, 1)
        controller.changed.connect(self._refresh)
        self._refresh()

    def use(self, file: Path | None) -> None:
        """Offer the results in the folder of this data file, which a thread lists; a refusal concerned another one."""
        self.show_used(self._used)
        self._offer([])
        self._reader.call(list if file is None else partial(results_in, file.parent))

    def show_used(self, used: Mapping[str, Path]) -> None:
        """Show the result files that the following runs use, by kind."""
        self._used = used
        files = ", ".join(f"{kind} {path.absolute().parent.name}/{path.name}" for kind, path in used.items())
        self._say(texts.USED.format(files=files) if files else "", "good")
        self._refresh()

    def show_refusal(self, text: str) -> None:
        """Show the reason why a result is not used."""
        self._say(f"▲ {text}", "alarm")
        self._refresh()

    def _offer(self, found: object) -> None:
        self.choice.clear()
        for result in cast("list[UsableResult]", found) if isinstance(found, list) else []:
            self.choice.addItem(texts.USE_ITEM.format(kind=result.kind, name=result.path.name), result)
        self._refresh()

    def _want(self) -> None:
        if self.use_it.isEnabled() and self.choice.currentIndex() >= 0:
            self.wanted.emit(self.choice.currentData())

    def _say(self, text: str, level: str) -> None:
        self.message.setText(text)
        set_level(self.message, level)

    def _refresh(self) -> None:
        why, offered = why_no_dialog(self._controller), self.choice.count() > 0
        for part in (self.choice, self.use_it):
            part.setVisible(offered)
        self.back.setVisible(bool(self._used))
        for button, tip in ((self.use_it, texts.USE_TIP), (self.back, texts.USE_BACK_TIP)):
            button.setEnabled(not why)
            button.setToolTip(why or tip)
        self.setVisible(offered or bool(self._used))
