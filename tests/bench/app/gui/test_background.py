"""Work beside the window: its answers and its errors come in the window's thread."""

import subprocess
import sys
import traceback

from PySide6.QtCore import QObject
from pytestqt.qtbot import QtBot

from bench.app.gui.background import Reader
from tests.patience import LONG, LONG_MS


def test_an_error_of_the_program_is_raised_in_the_thread_of_the_window(qtbot: QtBot) -> None:
    owner = QObject()
    reader, found = Reader(owner), list[object]()
    reader.found.connect(found.append)

    def wrong() -> object:
        raise ZeroDivisionError("a mistake of ours")

    with qtbot.captureExceptions() as raised:
        reader.call(wrong)
        qtbot.waitUntil(lambda: bool(found and raised), timeout=LONG_MS)
    assert [kind for kind, _, _ in raised] == [ZeroDivisionError]
    assert "_tell" in [frame.name for frame in traceback.extract_tb(raised[0][2])], "not in the pool's thread"
    reader.call(lambda: 7)
    qtbot.waitUntil(lambda: found[-1] == 7, timeout=LONG_MS)


DELETED = """
import sys, time
from PySide6.QtCore import QCoreApplication, QEvent, QObject
from bench.app.gui.background import Reader

sys.setswitchinterval(1e-6)
application = QCoreApplication([])
for _ in range(30):
    window = QObject()
    for reader in [Reader(window) for _ in range(40)]:
        reader.call(lambda: None)
    window.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    application.processEvents()
time.sleep(0.2)
"""


def test_a_window_may_be_deleted_while_its_threads_answer() -> None:
    """In a process of its own: whoever answers through a deleted object ends the process."""
    done = subprocess.run([sys.executable, "-c", DELETED], capture_output=True, text=True, check=False, timeout=LONG)
    assert done.returncode == 0, done.stderr
