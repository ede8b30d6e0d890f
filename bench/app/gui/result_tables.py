"""Tables of the Results page: points, all fields, and differences between runs."""

from collections.abc import Mapping, Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableWidget, QTableWidgetItem

from bench.app.display import texts
from bench.app.display.gains import Difference
from bench.app.display.point_table import every_field, rows_of
from bench.app.display.typography import typeset
from bench.app.formatting import ABSENT, number
from bench.datafile.tables import Column


def read_only(name: str) -> QTableWidget:
    """An empty read-only table with the accessible name `name`."""
    table = QTableWidget(0, 0)
    table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
    table.setAccessibleName(name)
    return table


def show_points(
    table: QTableWidget,
    results: Mapping[str, Column],
    points: Sequence[Mapping[str, object]],
    labels: Mapping[str, str],
    *,
    everything: bool,
) -> None:
    """Show the quantities of every point with prediction and verdict; with `everything`, every field of the file.
    `labels` are the displayed names of fields.
    """
    if everything:
        headings, rows = every_field(results, points)
        _fill(table, headings, [typeset(of.description) for of in results.values()], rows)
    else:
        _fill(table, texts.POINT_TITLES, texts.POINT_TIPS, [each.cells for each in rows_of(results, points, labels)])
    header = table.horizontalHeader()
    header.setSectionResizeMode(QHeaderView.ResizeMode.Interactive)
    if not everything:
        # keep all six columns in view: a long quantity is elided, and its tooltip shows the full text
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)


def show_differences(table: QTableWidget, runs: Sequence[tuple[str, Sequence[Difference]]]) -> None:
    """Show the points of each run compared with those of the reference."""
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
