"""STOP and every text are whole on a small, a usual and a large screen; `pixels grid` covers all of them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from PySide6.QtWidgets import QLabel, QWidget
from pytestqt.qtbot import QtBot

from tests.bench.app.gui.pixels import overlapping

ROOT = Path(__file__).parents[4]


@pytest.mark.parametrize(
    ("scale", "theme", "screens"),
    [("2", "light", ["1024x600", "3840x2160"]), ("1.5", "dark", ["1366x768"])],
)
def test_nothing_is_clipped(scale: str, theme: str, screens: list[str]) -> None:
    """In a process for each scale factor, because Qt reads it once."""
    command = [sys.executable, "-m", "tests.bench.app.gui.pixels", "--theme", theme, *screens]
    environment = {"QT_QPA_PLATFORM": "offscreen", **os.environ, "QT_SCALE_FACTOR": scale}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, ""), done.stderr


def test_texts_that_share_pixels_are_found(qtbot: QtBot) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    first, second = QLabel("first", window), QLabel("second", window)
    window.show()
    second.move(first.width() // 2, 0)
    assert overlapping(window) == ["'second' and 'first' overlap"]
    second.move(first.width(), 0)
    assert overlapping(window) == []
