"""Read-only tree of a configuration."""

from typing import cast

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QHeaderView,
    QTreeWidget,
    QTreeWidgetItem,
)

from bench.app.display import texts
from bench.app.display.typography import typeset
from bench.app.formatting import ABSENT, as_typed
from bench.config.declared import Declared, declared, summary
from bench.config.model import BenchConfiguration
from bench.document.typography import unit_text
from sim.parameters import Parameters

KEY = Qt.ItemDataRole.UserRole + 1
"""Role of the key of an item in the configuration file, without the tables above it; the number of a group in a list.
"""


class ConfigurationTree(QTreeWidget):
    """Read-only view of a configuration. Values that differ from their defaults are bold. Top-level groups are
    expanded, and so are nested groups with such values.
    """

    def __init__(self) -> None:
        super().__init__()
        self.setColumnCount(len(texts.CONFIGURATION_TITLES))
        self.setHeaderLabels(texts.CONFIGURATION_TITLES)
        self.setAccessibleName(texts.NAMES["configuration"])
        self.setAlternatingRowColors(True)
        self.header().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)

    def use(self, configuration: BenchConfiguration) -> None:
        """Show a configuration, without the tables of the rig backends that it does not use."""
        self.clear()
        unused = {"simulation", "hardware", "rig"} - {configuration.table}
        values, groups = list[QTreeWidgetItem](), list[QTreeWidgetItem]()
        for of in declared(BenchConfiguration):
            if of.name not in unused:
                line = _line(of, getattr(configuration, of.name), of.name)
                (groups if line.childCount() else values).append(line)
        self.addTopLevelItems([*values, *groups])
        for item in self._all():
            if item.childCount():
                item.setExpanded(item.parent() is None or item.data(0, Qt.ItemDataRole.UserRole) is True)

    def value(self, *path: str) -> str:
        """Value of a key, with its unit. Raises KeyError for an unknown key."""
        items = [self.topLevelItem(k) for k in range(self.topLevelItemCount())]
        found: QTreeWidgetItem | None = None
        for key in path:
            found = next((item for item in items if item is not None and item.data(0, KEY) == key), None)
            if found is None:
                raise KeyError(".".join(path))
            items = [found.child(k) for k in range(found.childCount())]
        return "" if found is None else f"{found.text(1)} {found.text(2)}".strip()

    def _all(self) -> list[QTreeWidgetItem]:
        waiting = [self.topLevelItem(k) for k in range(self.topLevelItemCount())]
        found: list[QTreeWidgetItem] = []
        while waiting:
            item = waiting.pop()
            if item is not None:
                found.append(item)
                waiting += [item.child(k) for k in range(item.childCount())]
        return found


def _line(of: Declared, value: object, key: str) -> QTreeWidgetItem:
    """Item of the dotted `key`, with child items for the keys below it; its first column stores whether the value, or
    any value below it, differs from the default.
    """
    changed = value != of.default
    item = _item(of.name)
    if isinstance(value, Parameters):
        _fill(item, value, key)
        tip = of.description or summary(type(value))
    elif groups := _groups(value):
        for number, each in enumerate(groups):
            below = _item(str(number + 1))
            _fill(below, each, key)
            item.addChild(below)
        tip = of.description
    else:
        item.setText(1, _words(value))
        item.setText(2, "" if of.unit == "1" or value is None else unit_text(of.unit))
        tip = f"{of.description}\n{texts.MUST_BE.format(allowed=of.allowed_in_unit)}"
    tip = typeset(tip[:1].upper() + tip[1:])
    item.setToolTip(0, f"{tip}\n{texts.KEY_IN_FILE.format(key=key)}")
    for column in (1, 2):
        item.setToolTip(column, tip)
    item.setData(0, Qt.ItemDataRole.UserRole, changed)
    font = item.font(1)
    font.setBold(changed)
    item.setFont(1, font)
    return item


def _item(name: str) -> QTreeWidgetItem:
    item = QTreeWidgetItem([name.replace("_", " "), "", ""])
    item.setData(0, KEY, name)
    return item


def _fill(item: QTreeWidgetItem, group: Parameters, key: str) -> None:
    for of in declared(type(group)):
        item.addChild(_line(of, getattr(group, of.name), f"{key}.{of.name}"))


def _groups(value: object) -> list[Parameters]:
    """The parameter groups that a value contains; empty for a value without any."""
    several = cast(tuple[object, ...], value) if isinstance(value, tuple) else ()
    return [each for each in several if isinstance(each, Parameters)]


def _words(value: object) -> str:
    if value is None:
        return ABSENT
    if isinstance(value, tuple):
        return " ".join(as_typed(each) for each in cast(tuple[object, ...], value)) or ABSENT
    return as_typed(getattr(value, "value", value))
