"""Tables that are only read."""

from collections.abc import Mapping, Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractItemView, QTableWidget, QTableWidgetItem

from bench.cli.words import ABSENT, number
from bench.gui import texts
from bench.gui.comparison import Difference
from bench.record.tables import Column


def read_only(name: str) -> QTableWidget:
    """An empty table that a screen reader calls `name`."""
    table = QTableWidget(0, 0)
    table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
    table.setAccessibleName(name)
    return table


def show_points(table: QTableWidget, results: Mapping[str, Column], points: Sequence[Mapping[str, object]]) -> None:
    """Every field of every point; the headings have the units, their tooltips the descriptions."""
    headings = [f"{name} [{of.unit}]" if of.unit not in ("", "1") else name for name, of in results.items()]
    tips = [of.description for of in results.values()]
    _fill(table, headings, tips, [[_cell(point[name]) for name in results] for point in points])


def show_differences(table: QTableWidget, runs: Sequence[tuple[str, Sequence[Difference]]]) -> None:
    """Each run's points against those of the reference, one below the other."""
    rows = [
        [
            name,
            each.point,
            *(number(value) for value in (each.reference, each.other, each.value, each.uncertainty, each.score)),
            _verdict(each),
        ]
        for name, differences in runs
        for each in differences
    ]
    _fill(table, texts.DIFFERENCES, texts.DIFFERENCE_TIPS, rows)


def _verdict(each: Difference) -> str:
    if each.score != each.score:
        return ABSENT
    return texts.WITHIN if each.score <= 1.0 else texts.BEYOND


def _fill(table: QTableWidget, headings: Sequence[str], tips: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    table.setColumnCount(len(headings))
    table.setRowCount(len(rows))
    for column, (heading, tip) in enumerate(zip(headings, tips, strict=True)):
        header = QTableWidgetItem(heading)
        header.setToolTip(tip)
        table.setHorizontalHeaderItem(column, header)
        for row, cells in enumerate(rows):
            item = QTableWidgetItem(cells[column])
            item.setToolTip(cells[column])
            item.setTextAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
            table.setItem(row, column, item)
    table.resizeColumnsToContents()


def _cell(value: object) -> str:
    if value is None:
        return ABSENT
    return f"{value:.5g}" if isinstance(value, float) else str(value)
