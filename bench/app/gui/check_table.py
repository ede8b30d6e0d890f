"""Table of the lines of a check with their verdicts."""

from PySide6.QtGui import QColor
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QLabel,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from bench.app.display import texts
from bench.app.display.theme import Theme
from bench.app.display.typography import spaced
from bench.live_view import Checklist

ROW = 22
"""Height of a line [px]."""


class CheckTable(QWidget):
    """Table of the checks in order; a line above it states how many have each verdict."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._shown = Checklist(())
        self.counts = QLabel()
        self.table = QTableWidget(0, len(texts.LIVE_CHECK_TITLES))
        self.table.setHorizontalHeaderLabels(texts.LIVE_CHECK_TITLES)
        self.table.setAccessibleName(texts.NAMES["check"])
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setTabKeyNavigation(False)
        self.table.verticalHeader().hide()
        self.table.setWordWrap(False)
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        self.table.verticalHeader().setDefaultSectionSize(ROW)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.counts)
        column.addWidget(self.table, 1)

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self._theme = theme
        self.show_checks(self._shown)

    def show_checks(self, checklist: Checklist) -> None:
        """Show these checks, and scroll to the last one that is not pending."""
        self._shown, checks = checklist, checklist.checks
        counted = [sum(each.verdict == verdict for each in checks) for verdict in texts.LIVE_CHECK_MARKS]
        words = (
            texts.LIVE_CHECK_COUNT.format(n=n, verdict=texts.LIVE_CHECK_MARKS[verdict][1])
            for n, verdict in zip(counted, texts.LIVE_CHECK_MARKS, strict=True)
            if n
        )
        self.counts.setText(" · ".join(words))
        self.table.setRowCount(len(checks))
        last = 0
        for row, check in enumerate(checks):
            mark, word, level = texts.LIVE_CHECK_MARKS[check.verdict]
            for place, text in enumerate((f"{mark} {word}", spaced(check.what), spaced(check.text))):
                item = QTableWidgetItem(text)
                item.setToolTip(text)
                if place == 0:
                    item.setForeground(QColor(str(getattr(self._theme, level))))
                self.table.setItem(row, place, item)
            last = last if check.verdict == "pending" else row
        self.table.scrollTo(self.table.model().index(last, 0))
