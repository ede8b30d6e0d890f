"""Opens the window and turns its main loop."""

import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import Any

from PySide6.QtCore import QSettings
from PySide6.QtWidgets import QApplication

from bench.config.model import BenchConfiguration
from bench.gui.controller import Controller
from bench.gui.own_errors import OwnErrors
from bench.gui.palette import Theme, desktop_theme, qt_palette, style_sheet
from bench.gui.stop import StopFilter
from bench.gui.window import Window
from bench.protocol import Protocol


def open_window(
    configuration: BenchConfiguration, entries: Sequence[Protocol[Any]], path: Path | None, queue: Path | None
) -> int:
    """Show the window until it is closed; returns the exit code of Qt's main loop."""
    application = QApplication(sys.argv[:1])
    application.setOrganizationName("rocking-bench")
    application.setApplicationName("rocking-bench")
    theme = desktop_theme()
    dress(application, theme)
    controller = Controller()
    window = Window(
        controller, configuration, entries, theme, path=path, settings=QSettings(), queue=queue, tour=path is None
    )
    undo = attend(window, controller, application)
    _follow_desktop(window, application)
    window.show()
    code = application.exec()
    controller.close()
    undo()
    return code


def attend(window: Window, controller: Controller, application: QApplication) -> Callable[[], None]:
    """What belongs to the whole program: the filter of STOP, errors of the window itself, and Ctrl-C in the terminal,
    which closes the window. Returns what undoes it.
    """
    stop = StopFilter(controller, window.header.stop)
    application.installEventFilter(stop)
    forget = OwnErrors(controller, window.trouble).install()

    def close(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        application.quit()

    before = signal.signal(signal.SIGINT, close)

    def undo() -> None:
        application.removeEventFilter(stop)
        forget()
        signal.signal(signal.SIGINT, before)

    return undo


def _follow_desktop(window: Window, application: QApplication) -> None:
    """Light or dark as the desktop has it, also when that changes while the window is open."""

    def follow() -> None:
        theme = desktop_theme()
        dress(application, theme)
        window.use_theme(theme)

    application.styleHints().colorSchemeChanged.connect(follow)


def dress(application: QApplication, theme: Theme) -> None:
    """Give every widget the theme."""
    application.setStyle("Fusion")
    application.setPalette(qt_palette(theme))
    application.setStyleSheet(style_sheet(theme))
