"""Opening of data files, one after the other, without a wait of the window."""

from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import cast

from PySide6.QtCore import QObject, Signal

from bench.app.display.run_file import RunFile, read_path
from bench.app.gui.background import FileReader

Taken = Callable[[RunFile | Path | Exception], object]
"""Receives the file that was read, the path if it is that of a folder, or the error."""


class FileOpener(QObject):
    """Reads the requested paths in their order."""

    changed = Signal()
    """Emitted when `current` has changed."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._requests = deque[tuple[Path, Taken]]()
        self._reader = FileReader(self)
        self._reader.found.connect(self._take)

    @property
    def current(self) -> Path | None:
        """The path that is being read; None if there is none."""
        return self._requests[0][0] if self._requests else None

    def open(self, path: Path, taken: Taken) -> None:
        """Read a path and pass the result to `taken`."""
        self._requests.append((path, taken))
        if len(self._requests) == 1:
            self._next()

    def _next(self) -> None:
        if (path := self.current) is not None:
            self._reader.call(partial(read_path, path))
        self.changed.emit()

    def _take(self, found: object) -> None:
        _, taken = self._requests.popleft()
        self._next()
        taken(cast("RunFile | Path | Exception", found))
