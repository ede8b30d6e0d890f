"""Result of a plan check: margins, time, disk and warnings, or the reason for a refusal."""

from math import inf, isfinite

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

from bench.app.display import texts
from bench.app.display.typography import in_screen_unit, typeset
from bench.app.formatting import ABSENT, clock
from bench.app.gui.widgets import set_level
from bench.app.ipc.messages import PlanChecked
from bench.document.typography import label
from bench.preflight.margins import Margin


class PlanView(QWidget):
    """Verdict, table of margins (tightest first) and notes of a plan check."""

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
        # the details are always shown in full: only the table scrolls
        self.details.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Minimum)
        self.table.setMinimumHeight(120)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        for part in (self.warning, self.verdict, self.table, self.details):
            layout.addWidget(part)
        layout.setStretch(2, 1)

    def warn(self, text: str) -> None:
        """Show a warning that does not depend on the plan; an empty `text` hides it."""
        self.warning.setText(f"▲ {text}")
        self.warning.setVisible(bool(text))

    def show_text(self, text: str) -> None:
        """Show `text` instead of a result."""
        self._show("calm", text, "", ())

    def refuse(self, why: str) -> None:
        """Show why the plan could not be computed."""
        self._show("alarm", "▲ " + texts.MAY_NOT.format(why=typeset(why)), "", ())

    def show_plan(self, found: PlanChecked) -> None:
        """Show the result of a plan check."""
        lines = [f"▲ {typeset(warning)}" for warning in found.warnings]
        margins = tuple(sorted(found.margins, key=_left))
        if margins:
            bound = margins[0].bound
            lines.append(texts.TIGHTEST.format(name=label(bound.name), owner=label(bound.owner)))
        else:
            lines.append(texts.NO_MARGINS)
        if found.duration is not None and found.needed is not None and found.free is not None:
            size = {"needed": found.needed / 1e6, "free": found.free / 1e6}
            lines.append(texts.TIME_AND_DISK.format(duration=clock(found.duration), **size))
        verdict = texts.MAY_RUN if found.refusal is None else "▲ " + texts.MAY_NOT.format(why=typeset(found.refusal))
        self._show("good" if found.refusal is None else "alarm", verdict, "\n".join(lines), margins)

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
                item.setToolTip(_tip(margin) if column == 5 else text)
                self.table.setItem(row, column, item)


def _left(each: Margin) -> float:
    """Margin kept by 95 % of the specimens or, if that is unknown, the margin of the nominal specimen; infinite if
    neither is predicted.
    """
    left = each.margin if each.likely is None else each.likely
    return inf if left is None else left


def _tip(each: Margin) -> str:
    if each.margin is None or each.likely is None:
        return typeset(each.demand.where)
    return texts.MARGIN_TIP.format(margin=100.0 * each.margin, likely=100.0 * each.likely)


def _cells(each: Margin) -> tuple[str, ...]:
    def number(value: float | None) -> str:
        return ABSENT if value is None else f"{factor * value:.4g}"

    share = ABSENT if not isfinite(_left(each)) else f"{100.0 * _left(each):.1f}"
    demand = each.demand
    factor, unit = in_screen_unit(each.bound.unit)
    numbers = (number(demand.value), number(demand.likely), number(each.bound.limit))
    return (label(each.bound.name), unit, *numbers, share, typeset(demand.where))
