"""Opens the window and turns its main loop."""

import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from types import FrameType, TracebackType

from PySide6.QtCore import QSettings
from PySide6.QtWidgets import QApplication

from bench.cli.catalogue import Entry
from bench.cli.scene import Notice
from bench.config.model import BenchConfiguration
from bench.gui import texts
from bench.gui.controller import Controller
from bench.gui.palette import Theme, desktop_theme, qt_palette, style_sheet
from bench.gui.stop import StopKey
from bench.gui.window import Window


def open_window(configuration: BenchConfiguration, entries: Sequence[Entry], path: Path | None) -> int:
    """Show the window until it is closed; returns the exit code of Qt's main loop."""
    application = QApplication(sys.argv[:1])
    application.setOrganizationName("rocking-bench")
    application.setApplicationName("rocking-bench")
    theme = desktop_theme()
    dress(application, theme)
    controller = Controller()
    application.installEventFilter(StopKey(controller))
    window = Window(controller, configuration, entries, theme, path=path, settings=QSettings(), tour=path is None)
    _keep_going(controller, application)
    window.show()
    code = application.exec()
    controller.close()
    return code


def _keep_going(controller: Controller, application: QApplication) -> None:
    """An error of the window is a line of its log and no end of anything; Ctrl-C in the terminal closes the window."""
    before = sys.excepthook

    def tell(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        before(kind, error, trace)
        text = texts.OWN_ERROR.format(error=f"{kind.__name__}: {error}")
        controller.noticed.emit(Notice(controller.scene.time, "window", text, grave=True))

    sys.excepthook = tell

    def close(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        application.quit()

    signal.signal(signal.SIGINT, close)


def dress(application: QApplication, theme: Theme) -> None:
    """Give every widget the theme."""
    application.setStyle("Fusion")
    application.setPalette(qt_palette(theme))
    application.setStyleSheet(style_sheet(theme))
