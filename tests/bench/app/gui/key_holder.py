"""A small window that holds the key of STOP while it has no focus, as the header does, and tells so on standard
output.
"""

import sys

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QLineEdit

from bench.app.gui.global_key import GlobalKey


class Field(QLineEdit):
    """Tells that it received the key because it has the focus."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_F12:
            print("typed", flush=True)


class Holder:
    """Window, key, and what was told last."""

    def __init__(self, title: str) -> None:
        self.field = Field()
        self.field.setWindowTitle(title)
        self.key = GlobalKey(self.field)
        self.key.pressed.connect(lambda: print("pressed", flush=True))
        self.told = ""

    def look(self) -> None:
        idle = QApplication.activeWindow() is None
        self.key.hold(wanted=idle and bool(self.told))
        now = "held" if self.key.held else "refused" if idle else "active"
        # before the window is shown, it has no focus either
        if now != self.told and (self.told or now == "active"):
            self.told = now
            print(now, flush=True)


if __name__ == "__main__":
    application = QApplication(sys.argv[:1])
    holder = Holder(sys.argv[1])
    timer = QTimer(interval=20)
    timer.timeout.connect(holder.look)
    holder.field.show()
    timer.start()
    application.exec()
