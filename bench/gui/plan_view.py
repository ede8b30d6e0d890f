"""What a plan comes to, before it is started: margins, time, disk, warnings, or why it is refused."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QLabel,
    QSizePolicy,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from bench.cli.words import ABSENT, clock
from bench.gui import texts
from bench.gui.header import set_level
from bench.link.messages import Surveyed
from bench.preflight.margins import Margin


class PlanView(QWidget):
    """A verdict, a table of margins with the tightest first, and what else a person should know."""

    def __init__(self) -> None:
        super().__init__()
        self.verdict, self.details, self.warning = (QLabel(wordWrap=True) for _ in range(3))
        self.warning.hide()
        set_level(self.warning, "alarm")
        self.table = QTableWidget(0, len(texts.MARGINS))
        self.table.setHorizontalHeaderLabels(texts.MARGINS)
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.verticalHeader().hide()
        self.table.setWordWrap(False)
        self.table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.table.horizontalHeader().setStretchLastSection(True)
        self.table.setAccessibleName(texts.NAMES["margins"])
        # the whole of it is shown: the table scrolls, this does not
        self.details.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Minimum)
        self.table.setMinimumHeight(120)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        for part in (self.warning, self.verdict, self.table, self.details):
            layout.addWidget(part)
        layout.setStretch(2, 1)

    def warn(self, text: str) -> None:
        """Say something whatever the plan comes to; empty: nothing."""
        self.warning.setText(f"▲ {text}")
        self.warning.setVisible(bool(text))

    def say(self, text: str) -> None:
        """Nothing is known but `text`."""
        self._show("calm", text, "", ())

    def refuse(self, why: str) -> None:
        """The plan cannot even be computed."""
        self._show("alarm", "▲ " + texts.MAY_NOT.format(why=why), "", ())

    def show_plan(self, found: Surveyed) -> None:
        """Show what a survey found."""
        lines = [f"▲ {warning}" for warning in found.warnings]
        if found.margins:
            bound = found.margins[0].bound
            lines.append(texts.TIGHTEST.format(name=bound.name, owner=bound.owner))
        else:
            lines.append(texts.NO_MARGINS)
        if found.duration is not None and found.needed is not None and found.free is not None:
            size = {"needed": found.needed / 1e6, "free": found.free / 1e6}
            lines.append(texts.TIME_AND_DISK.format(duration=clock(found.duration), **size))
        verdict = texts.MAY_RUN if found.refusal is None else "▲ " + texts.MAY_NOT.format(why=found.refusal)
        self._show("good" if found.refusal is None else "alarm", verdict, "\n".join(lines), found.margins)

    def _show(self, level: str, verdict: str, details: str, margins: tuple[Margin, ...]) -> None:
        self.verdict.setText(verdict)
        set_level(self.verdict, level)
        self.details.setText(details)
        self.table.setRowCount(len(margins))
        for row, margin in enumerate(margins):
            for column, text in enumerate(_cells(margin)):
                item = QTableWidgetItem(text)
                if 2 <= column <= 5:
                    item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                item.setToolTip(text)
                self.table.setItem(row, column, item)


def _cells(each: Margin) -> tuple[str, ...]:
    def number(value: float | None) -> str:
        return ABSENT if value is None else f"{value:.4g}"

    share = ABSENT if each.margin is None else f"{100.0 * each.margin:.1f}"
    demand = each.demand
    numbers = (number(demand.value), number(demand.likely), number(each.bound.limit))
    return (each.bound.name, each.bound.unit, *numbers, share, demand.where)
