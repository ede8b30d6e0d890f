"""The window on a real session, from the form to the file."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from bench.app.gui.window import Window
from bench.datafile.reader import open_datafile
from tests.bench.app.gui.run_files import settle, show
from tests.patience import LONG_MS


@pytest.mark.usefixtures("qapp")
def test_from_the_form_to_the_file(window: Window, qtbot: QtBot, tmp_path: Path) -> None:
    page = window.protocol
    field = page.form.fields["cycles"]
    assert isinstance(field, QLineEdit)
    field.setText("6")
    page.realtime.setChecked(False)
    page.person.setChecked(True)
    page.check_plan()
    qtbot.waitUntil(page.start.isEnabled, timeout=LONG_MS)
    qtbot.mouseClick(page.start, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(window.prompt.isVisible, timeout=LONG_MS)
    assert window.header.word.text() == "WAITING"
    qtbot.waitUntil(window.prompt.done.isEnabled, timeout=LONG_MS)
    qtbot.mouseClick(window.prompt.done, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: window.pages.currentWidget() is window.results, timeout=LONG_MS)
    settle(window.results)
    assert "Run completed" in window.results.message.text()
    assert window.results.table.rowCount() == 1
    assert len(window.run.traces.ring) > 100
    with open_datafile(tmp_path / "run" / "campaign.h5") as record:
        assert record.status == "completed"
    # what was shown stays when another file cannot be read
    show(window.results, tmp_path / "nowhere.h5")
    assert "there is no such file" in window.results.message.text()
    assert window.results.table.rowCount() == 1
