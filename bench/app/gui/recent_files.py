"""The list of recent configurations."""

from pathlib import Path
from typing import cast

from PySide6.QtCore import QSettings, Qt, Signal
from PySide6.QtWidgets import QComboBox

from bench.app.display import texts
from bench.app.gui.widgets import ignore_wheel

MOST = 10
"""Largest number of listed files."""

_KEY = "recent configurations"


class RecentFiles(QComboBox):
    """List of files, the most recently used one first, stored in `settings`; hidden while it is empty. A missing file
    stays listed: its disk may be mounted again.
    """

    chosen = Signal(Path)

    def __init__(self, settings: QSettings | None) -> None:
        super().__init__()
        self._settings = settings
        kept = None if settings is None else settings.value(_KEY)
        # QSettings returns a list of one string as a plain string
        texts_kept = [kept] if isinstance(kept, str) else cast(list[object], kept) if isinstance(kept, list) else []
        self.paths = [Path(text) for text in texts_kept if isinstance(text, str)]
        self.setPlaceholderText(texts.RECENT)
        self.setAccessibleName(texts.RECENT)
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(10)
        ignore_wheel(self)
        self.activated.connect(self._choose)
        self._list()

    def add(self, path: Path) -> None:
        """Move a file to the top of the list, or add it there."""
        used = path.absolute()
        self.paths = [used, *(each for each in self.paths if each != used)][:MOST]
        if self._settings is not None:
            self._settings.setValue(_KEY, [str(each) for each in self.paths])
        self._list()

    def hold(self, why: str) -> None:
        """Disable the list, with the reason `why` as its tooltip; an empty `why` enables it."""
        self.setEnabled(not why)
        self.setToolTip(why or texts.RECENT_TIP)

    def _list(self) -> None:
        self.clear()
        for path in self.paths:
            self.addItem(f"{path.name} · {path.parent}", str(path))
            self.setItemData(self.count() - 1, str(path), Qt.ItemDataRole.ToolTipRole)
        self.setCurrentIndex(-1)
        if not self.paths:
            self.hide()
        elif self.parent() is not None:
            self.show()

    def _choose(self, place: int) -> None:
        path = self.paths[place]
        self.setCurrentIndex(-1)
        self.chosen.emit(path)
