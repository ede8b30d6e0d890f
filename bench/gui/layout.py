"""What is remembered of the window, and what is made right for the keyboard, for all pages alike."""

from PySide6.QtCore import QByteArray, QSettings
from PySide6.QtWidgets import QAbstractItemView, QMainWindow, QPlainTextEdit, QSplitter, QTabWidget, QTextEdit, QWidget


def remember(window: QMainWindow, pages: QTabWidget, settings: QSettings) -> None:
    """Keep size and place of the window, and where the splitters of its pages stand."""
    settings.setValue("geometry", window.saveGeometry())
    for key, splitter in _splitters(pages):
        settings.setValue(key, splitter.saveState())


def restore(window: QMainWindow, pages: QTabWidget, settings: QSettings) -> None:
    """As it was kept; what was not, or no longer fits, stays as it is."""
    kept = settings.value("geometry")
    if isinstance(kept, QByteArray):
        window.restoreGeometry(kept)
    for key, splitter in _splitters(pages):
        state = settings.value(key)
        if isinstance(state, QByteArray):
            splitter.restoreState(state)


def _splitters(pages: QTabWidget) -> list[tuple[str, QSplitter]]:
    """Each with a name that says which page it is on, which one it is there, and how many parts it has."""
    return [
        (f"splitters/{pages.tabText(place)}/{number}-{splitter.count()}", splitter)
        for place in range(pages.count())
        if (page := pages.widget(place)) is not None
        for number, splitter in enumerate(page.findChildren(QSplitter))
    ]


def free_tab_key(whole: QWidget) -> None:
    """Tab goes to the next field from everywhere; lists and texts would keep it for themselves."""
    for view in whole.findChildren(QAbstractItemView):
        view.setTabKeyNavigation(False)
    for kind in (QPlainTextEdit, QTextEdit):
        for text in whole.findChildren(kind):
            text.setTabChangesFocus(True)
