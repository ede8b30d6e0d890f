"""The campaign as a table of its points."""

from datetime import datetime
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QBrush, QColor
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableWidget, QTableWidgetItem

from bench.app.display import texts
from bench.app.display.campaign import Campaign
from bench.app.display.theme import Theme
from bench.app.ipc.messages import Run
from bench.datafile.tables import Table
from bench.events import Event, PointFinished
from bench.protocol import Axis, Protocol


class MatrixView(QTableWidget):
    """Table of the points; hidden for a protocol whose points do not form a matrix of two parameters."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self.campaign: Campaign | None = None
        self._axes: tuple[Axis, Axis] | None = None
        self.setAccessibleName(texts.NAMES["matrix"])
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.hide()

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self._theme = theme
        self.refresh(float("nan"))

    def begin(self, protocol: Protocol[Any], run: Run) -> None:
        """Show the points of a new run."""
        self.campaign, self._axes = Campaign(protocol, run), protocol.view.matrix
        self.setVisible(self._axes is not None)
        self.open({})

    def open(self, prediction: Table) -> None:
        """Label the points with the names in the prediction of the run."""
        campaign, axes = self.campaign, self._axes
        if campaign is not None and axes is not None:
            campaign.name_points(prediction)
            self.setRowCount(len(campaign.rows))
            self.setColumnCount(len(campaign.columns))
            self.setVerticalHeaderLabels([axes[0].text(value) for value in campaign.rows])
            self.setHorizontalHeaderLabels([axes[1].text(value) for value in campaign.columns])
            self.refresh(float("nan"))

    def follow(self, event: Event, remaining: float) -> None:
        """Update with an event; `remaining` is the remaining time of the run [s]."""
        if self.campaign is None:
            return
        before = self.campaign.current
        self.campaign.follow(event)
        if before != self.campaign.current or isinstance(event, PointFinished):
            self.refresh(remaining)

    def end(self) -> None:
        """Show the points of a run that has ended."""
        if self.campaign is not None:
            self.campaign.end()
            self.refresh(float("nan"))

    def refresh(self, remaining: float) -> None:
        """Show every point, and the expected end of each one that is not finished; `remaining` as in `follow`."""
        campaign = self.campaign
        if campaign is None:
            return
        now = datetime.now()
        for (row, column), cell in campaign.cells.items():
            end = campaign.expected((row, column), remaining, now)
            mark, level = texts.POINT_MARKS.get(cell.status, texts.POINT_MARKS[texts.POINT_DONE])
            later = "" if end is None else texts.EXPECTED.format(time=end)
            item = QTableWidgetItem(" ".join(part for part in (mark, cell.result or later) if part))
            item.setForeground(QBrush(QColor(getattr(self._theme, level))))
            item.setTextAlignment(Qt.AlignmentFlag.AlignCenter)
            item.setToolTip(" · ".join(part for part in (cell.status, cell.result, later) if part))
            self.setItem(row, column, item)
