"""Texts of the window that are clipped, or covered by another one, on a screen.

    python -m tests.bench.app.gui.pixels [--theme THEME] [--files FILES] WIDTHxHEIGHT...

The screens have these sizes in physical pixels; `QT_SCALE_FACTOR` scales the window. Pictures of the pages are saved
under names that begin with FILES. With the argument `grid` alone, every size, scale and theme of `SCREENS`, `SCALES`
and `THEMES` is shown, in a process for each scale and theme.
"""

import argparse
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QPoint, QRect
from PySide6.QtWidgets import QAbstractButton, QApplication, QLabel, QScrollArea, QTabWidget, QWidget

from bench.app.catalogue import all_protocols
from bench.app.display.theme import DARK, LIGHT
from bench.app.gui.controller import Controller
from bench.app.gui.palette import dress
from bench.app.gui.widgets import ElidingLabel
from bench.app.gui.window import SMALLEST, Window
from bench.app.ipc.messages import Run
from bench.config.model import BenchConfiguration
from protocols.harmonic.protocol import HarmonicParameters

SCREENS = ((1024, 600), (1366, 768), (1920, 1080), (3840, 2160))
SCALES = ("1", "1.5", "2")
THEMES = {"light": LIGHT, "dark": DARK}
TITLE_BAR = 28
"""Height of the title bar and its panel [logical px]."""


def clipped(window: Window) -> list[str]:
    """What of the window cannot be seen in full: STOP, and texts of buttons and labels that neither wrap nor scroll."""
    found: list[str] = []
    stop = window.header.stop
    if not window.rect().contains(_place(stop, window)):
        found.append("STOP")
    for part in window.findChildren(QWidget):
        if not part.isVisible() or not isinstance(part, QLabel | QAbstractButton) or not part.text():
            continue
        if isinstance(part, ElidingLabel) or part.toolTip() or _scrolls(part):
            continue
        if isinstance(part, QLabel) and part.wordWrap():
            too_small = part.heightForWidth(part.width()) > part.height() + 1
        else:
            too_small = part.width() + 1 < part.minimumSizeHint().width()
        if too_small:
            found.append(f"{type(part).__name__} {part.text()!r}")
    return found


def overlapping(window: QWidget) -> list[str]:
    """Pairs of visible texts, labels or buttons, that share pixels."""
    found = [each for each in window.findChildren(QWidget) if isinstance(each, QLabel | QAbstractButton)]
    shown = [(each, _seen(each, window)) for each in found if each.isVisible() and each.text()]
    return [
        f"{one.text()!r} and {other.text()!r} overlap"
        for number, (one, place) in enumerate(shown)
        for other, there in shown[:number]
        if min(place.intersected(there).width(), place.intersected(there).height()) > 1
        and not (one.isAncestorOf(other) or other.isAncestorOf(one))
    ]


def _seen(part: QWidget, window: QWidget) -> QRect:
    """The part of a widget that its parents do not cut off."""
    seen, parent = _place(part, window), part.parentWidget()
    while parent is not None and parent is not window:
        seen = seen.intersected(_place(parent, window))
        parent = parent.parentWidget()
    return seen


def _place(part: QWidget, window: QWidget) -> QRect:
    return QRect(part.mapTo(window, QPoint(0, 0)), part.size())


def _scrolls(part: QWidget) -> bool:
    """Whether the widget is in an area that scrolls at present."""
    parent = part.parentWidget()
    while parent is not None:
        if isinstance(parent, QScrollArea) and (
            parent.verticalScrollBar().maximum() > 0 or parent.horizontalScrollBar().maximum() > 0
        ):
            return True
        parent = parent.parentWidget()
    return False


def show(sizes: Sequence[tuple[int, int]], theme: str, files: str = "") -> int:
    """Show every page on screens of these sizes [px]; prints and counts what is clipped or covered."""
    os.environ["ROCKBENCH_SESSIONS"] = "off"
    application = QApplication([])
    controller = Controller()
    window = Window(controller, BenchConfiguration(), all_protocols()[0], THEMES[theme], presets=Path("never"))
    # after the window is built, as in the program
    dress(application, THEMES[theme])
    scale = window.devicePixelRatioF()
    window.show()
    run = Run("harmonic", HarmonicParameters(omega=(14.0, 16.0), beta=(0.25, 0.4)), BenchConfiguration(), Path("never"))
    controller.began.emit(run)
    results, wrong = window.results, list[str]()

    def look(tabs: QTabWidget) -> None:
        for number in range(tabs.count()):
            tabs.setCurrentIndex(number)
            for _ in range(3):
                application.processEvents()
            where = f"{width}x{height}, {tabs.tabText(number)}"
            wrong.extend(f"{where}: {each}" for each in (*clipped(window), *overlapping(window)))
            if files and tabs is window.pages:
                window.grab().save(f"{files}-{width}-{scale:g}-{theme}-{number}.png")

    for width, height in sizes:
        window.resize(max(int(width / scale), SMALLEST[0]), max(int(height / scale) - TITLE_BAR, SMALLEST[1]))
        results.views.setCurrentWidget(results.browser)
        look(window.pages)
        results.show_run()
        look(results.parts)
    print("\n".join(wrong))
    window.leave()
    return len(wrong)


def grid() -> int:
    """Every screen, scale and theme."""
    wrong = 0
    for scale in SCALES:
        for theme in THEMES:
            sizes = [f"{width}x{height}" for width, height in SCREENS]
            command = [sys.executable, "-m", "tests.bench.app.gui.pixels", "--theme", theme, *sizes]
            environment = {"QT_QPA_PLATFORM": "offscreen", **os.environ, "QT_SCALE_FACTOR": scale}
            done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
            wrong += done.returncode != 0
            print(f"scale {scale}, {theme}: {done.stdout.strip() or 'whole'}", flush=True)
    return wrong


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("screens", nargs="+")
    parser.add_argument("--theme", choices=THEMES, default="light")
    parser.add_argument("--files", default="")
    asked = parser.parse_args()
    if asked.screens == ["grid"]:
        return min(grid(), 1)
    sizes = [(int(width), int(height)) for width, height in (each.split("x") for each in asked.screens)]
    return min(show(sizes, asked.theme, asked.files), 1)


if __name__ == "__main__":
    sys.exit(main())
