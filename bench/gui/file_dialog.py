"""Asks for files in a dialog that blocks nothing and never stands over a bench that may move."""

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QWidget

from bench.gui import texts
from bench.gui.controller import Controller


def why_no_dialog(controller: Controller) -> str:
    """Why no dialog can be open now; empty when one can."""
    return texts.START_BUSY if controller.running else controller.held


def ask_for_files(
    parent: QWidget,
    controller: Controller,
    title: str,
    kinds: str,
    taken: Callable[[list[Path]], None],
    *,
    folder: str = "",
    many: bool = False,
) -> None:
    """Show the dialog and return; `taken` is called with what was chosen. A run or a queue that begins shuts it."""
    dialog = QFileDialog(parent, title, folder, kinds)
    # a dialog of the desktop blocks the window it belongs to, and STOP with it
    dialog.setOption(QFileDialog.Option.DontUseNativeDialog)
    dialog.setFileMode(QFileDialog.FileMode.ExistingFiles if many else QFileDialog.FileMode.ExistingFile)
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)

    def shut() -> None:
        if why_no_dialog(controller):
            dialog.reject()

    def take(names: list[str]) -> None:
        if not why_no_dialog(controller):
            taken([Path(name) for name in names])

    def let_go(_result: int) -> None:
        # a closure is no slot of the dialog's, and would outlive it
        controller.changed.disconnect(shut)

    controller.changed.connect(shut)
    dialog.filesSelected.connect(take)
    dialog.finished.connect(let_go)
    # `open` would make it modal to the window
    dialog.show()
