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
    ("width", "height", "scale", "theme"),
    [(1024, 600, "2", "light"), (1366, 768, "1.5", "dark"), (3840, 2160, "2", "light")],
)
def test_nothing_is_clipped(width: int, height: int, scale: str, theme: str) -> None:
    """In a process of its own, because Qt reads the scale factor once."""
    command = [sys.executable, "-m", "tests.bench.app.gui.pixels", str(width), str(height), theme]
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
