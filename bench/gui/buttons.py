"""Buttons with a key of their own."""

from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QAbstractButton


def give_key(button: QAbstractButton, key: str) -> None:
    """Press the button with `key` while it can be seen and pressed. A key that is held down counts once: a shortcut of
    the button's own would repeat.
    """
    shortcut = QShortcut(QKeySequence(key), button, autoRepeat=False)
    shortcut.activated.connect(button.click)
