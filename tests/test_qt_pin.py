"""PySide6 6.12.0 drops a reference to None in most calls that return nothing; on Python 3.11 that kills a live plot."""

import sys

from pytestqt.qtbot import QtBot


def test_calls_that_return_nothing_keep_their_references_to_none(qtbot: QtBot) -> None:
    from PySide6.QtWidgets import QLabel

    label = QLabel()
    qtbot.addWidget(label)
    before = sys.getrefcount(None)
    for _ in range(200):
        label.setText("12.5")
    assert sys.getrefcount(None) - before > -20
