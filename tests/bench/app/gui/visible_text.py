"""All texts of the widgets of a window, those of its plots and its own paintings included."""

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QAbstractItemModel, QAbstractListModel, QModelIndex, Qt
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QApplication,
    QComboBox,
    QGraphicsTextItem,
    QGraphicsView,
    QGroupBox,
    QHeaderView,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QTabWidget,
    QTextEdit,
    QTreeWidget,
    QWidget,
)

ROLES = (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.ToolTipRole)


def widget_texts(whole: QWidget) -> Iterator[tuple[str, str]]:
    """Every text in `whole` and its children, hidden ones included, with the kind of the widget."""
    for part in (whole, *whole.findChildren(QWidget)):
        # a model of a combo box has a view of its own
        if isinstance(part, QAbstractItemView) and isinstance(part.parent(), QComboBox):
            continue
        for text in _texts(part):
            if text:
                yield type(part).__name__, text


def _texts(part: QWidget) -> Iterator[str]:
    yield from (part.toolTip(), part.statusTip(), part.whatsThis(), part.accessibleName(), part.windowTitle())
    if isinstance(part, QLabel | QAbstractButton):
        yield part.text()
    elif isinstance(part, QLineEdit):
        yield from (part.text(), part.placeholderText())
    elif isinstance(part, QPlainTextEdit | QTextEdit):
        yield part.toPlainText()
    elif isinstance(part, QGroupBox):
        yield part.title()
    elif isinstance(part, QTabWidget):
        for place in range(part.count()):
            yield from (part.tabText(place), part.tabToolTip(place))
    elif isinstance(part, QComboBox):
        yield from _model_texts(part.model(), QModelIndex())
    elif isinstance(part, QGraphicsView):
        for item in part.scene().items():
            if isinstance(item, QGraphicsTextItem):
                yield item.toPlainText()
    elif isinstance(part, QAbstractItemView) and not isinstance(part, QHeaderView):
        yield from _header_texts(part.model())
        yield from _model_texts(part.model(), QModelIndex(), deep=isinstance(part, QTreeWidget))


def _header_texts(model: QAbstractItemModel) -> Iterator[str]:
    sides = ((Qt.Orientation.Horizontal, _columns(model)), (Qt.Orientation.Vertical, model.rowCount(QModelIndex())))
    for side, count in sides:
        for place in range(count):
            yield from (str(text) for role in ROLES if (text := model.headerData(place, side, role)) is not None)


def _columns(model: QAbstractItemModel, parent: QModelIndex = QModelIndex()) -> int:  # noqa: B008 - the invalid index
    # that of a list is private
    return 1 if isinstance(model, QAbstractListModel) else model.columnCount(parent)


def _model_texts(model: QAbstractItemModel, parent: QModelIndex, *, deep: bool = False) -> Iterator[str]:
    for row in range(model.rowCount(parent)):
        for column in range(_columns(model, parent)):
            index = model.index(row, column, parent)
            yield from (str(text) for role in ROLES if (text := model.data(index, role)) is not None)
        if deep:
            yield from _model_texts(model, model.index(row, 0, parent), deep=True)


def painted_texts(whole: QWidget, patch: pytest.MonkeyPatch) -> list[tuple[str, str]]:
    """The texts that Python code paints while `whole` is drawn once."""
    found: list[tuple[str, str]] = []
    real = QPainter.drawText

    def draw(painter: QPainter, *given: object) -> object:
        found.extend(("painted", each) for each in given if isinstance(each, str))
        return real(painter, *given)  # type: ignore[call-overload]

    with patch.context() as painting:
        painting.setattr(QPainter, "drawText", draw)
        whole.grab()
        QApplication.processEvents()
    return found
