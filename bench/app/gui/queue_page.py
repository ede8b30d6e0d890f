"""The Queue page: tests in order, with their states and actions."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QSpinBox,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from bench.app.display import texts
from bench.app.formatting import ABSENT, as_typed
from bench.app.gui.controller import Controller
from bench.app.gui.queue_runner import QueueRunner
from bench.app.gui.widgets import FITTING, give_key, scrolling, set_level
from bench.app.queue.queue import MOST_COPIES, OPEN, Queued, Stage
from bench.config.declared import Declared, declared
from bench.document.typography import label, unit_text
from bench.protocol import Protocol

LOWEST = 150
"""Height below which the list with its buttons scrolls [px]."""
COPIES, COPIES_TIP = "times", "Number of copies that Repeat inserts below the selected test."
QUEUE_ACTIONS = (
    ("up", "Up", "Ctrl+Up", "Moves the test one place up"),
    ("down", "Down", "Ctrl+Down", "Moves the test one place down"),
    ("repeat", "Repeat", "Ctrl+R", "Inserts copies below the test, each with a separate folder"),
    ("skip", "Skip", "Ctrl+T", "Skips the test, or restores it"),
    ("edit", "Edit …", "Ctrl+Shift+E", "Opens a pending test in the form on the Protocol page"),
    ("remove", "Remove", "Del", "Removes the test from the list; its results are kept"),
)
"""Name, label, key and tooltip of each action on the selected test."""


class QueuePage(QWidget):
    """List of tests; every action applies to the selected test and has a shortcut key."""

    edit_requested = Signal(object, int)
    """Emits a `Queued` that has not begun and is to be edited, and its number, counted from 1."""

    def __init__(self, controller: Controller, runner: QueueRunner, entries: Sequence[Protocol[Any]]) -> None:
        super().__init__()
        self._controller, self._runner = controller, runner
        self._entries = {entry.name: entry for entry in entries}
        self.status, self.kept = QLabel(wordWrap=True), QLabel(wordWrap=True)
        self.kept.setProperty("role", "faint")
        self.start = QPushButton(texts.QUEUE_STARTS)
        self.copies = QSpinBox(minimum=1, maximum=MOST_COPIES, value=1, prefix="× ")
        self.buttons = {name: QPushButton(label) for name, label, _, _ in QUEUE_ACTIONS}
        self.table = QTableWidget(0, len(texts.QUEUE_TITLES))
        self._arrange()
        self.start.clicked.connect(self._start_or_pause)
        self.table.itemSelectionChanged.connect(self._refresh_actions)
        self.table.itemActivated.connect(self._edit)
        for name, act in (
            ("up", lambda: self._move(-1)),
            ("down", lambda: self._move(1)),
            ("repeat", self._repeat),
            ("skip", self._skip),
            ("edit", self._edit),
            ("remove", self._remove),
        ):
            self.buttons[name].clicked.connect(act)
        runner.changed.connect(self.refresh)
        controller.changed.connect(self._refresh_start)
        self.refresh()

    @property
    def selected(self) -> int | None:
        """Index of the selected test; None without a selection."""
        row = self.table.currentRow()
        return row if 0 <= row < len(self._runner.queue.tests) else None

    def refresh(self) -> None:
        """Show the current queue."""
        tests, row = self._runner.queue.tests, self.table.currentRow()
        self.table.setRowCount(len(tests))
        for index, test in enumerate(tests):
            for column, text in enumerate(self._cells(index, test)):
                item = QTableWidgetItem(text)
                item.setToolTip(self._all_parameters(test) if column == 3 else text)
                self.table.setItem(index, column, item)
        if tests:
            self.table.setCurrentCell(min(max(row, 0), len(tests) - 1), 0)
        self._refresh_start()
        self._refresh_actions()

    def _refresh_start(self) -> None:
        runner = self._runner
        why = "" if runner.going else runner.why_not
        self.start.setText(texts.QUEUE_PAUSES if runner.going else texts.QUEUE_STARTS)
        self.start.setEnabled(not why)
        self.start.setToolTip(why or (texts.QUEUE_PAUSES_TIP if runner.going else texts.QUEUE_STARTS_TIP))
        n, running = runner.queue.waiting, runner.queue.running
        if runner.checking is not None:
            text = texts.QUEUE_CHECKING.format(number=runner.checking + 1, n=n)
        elif runner.going or running is not None:
            text = (texts.QUEUE_GOING if runner.going else texts.QUEUE_LAST).format(n=n)
        elif runner.why:
            text = texts.QUEUE_PAUSED.format(why=runner.why, n=n)
        else:
            text = texts.QUEUE_IDLE.format(n=n) if runner.queue.tests else texts.QUEUE_EMPTY
        self.status.setText(text)
        set_level(self.status, "alarm" if runner.why and not runner.going else "good" if runner.going else "calm")

    def _refresh_actions(self) -> None:
        index, tests = self.selected, self._runner.queue.tests
        test = None if index is None else tests[index]
        begun = test is None or test.stage not in OPEN
        running = test is None or test.stage is Stage.RUNNING
        known = test is not None and test.protocol in self._entries
        for name, possible in (
            ("up", not begun and index != 0),
            ("down", not begun and index != len(tests) - 1),
            ("repeat", test is not None),
            ("skip", not begun),
            ("edit", not begun and known),
            ("remove", not running),
        ):
            self.buttons[name].setEnabled(possible)
        skipped = test is not None and test.stage is Stage.SKIPPED
        self.buttons["skip"].setText(texts.TAKE_IN if skipped else QUEUE_ACTIONS[3][1])

    def _cells(self, index: int, test: Queued) -> tuple[str, ...]:
        outcome = test.outcome or self._options_of(test)
        return (
            str(index + 1),
            texts.STAGES[test.stage],
            test.protocol,
            self._changed_parameters(test),
            test.out or ABSENT,
            outcome,
        )

    def _changed_parameters(self, test: Queued) -> str:
        """Parameters that differ from the defaults."""
        return ", ".join(_parameter_text(of, value) for of, value in self._values(test) if value != _plain(of.default))

    def _all_parameters(self, test: Queued) -> str:
        return "\n".join(_parameter_text(of, value) for of, value in self._values(test))

    def _values(self, test: Queued) -> list[tuple[Declared, object]]:
        entry = self._entries.get(test.protocol)
        fields = () if entry is None else declared(entry.parameters)
        return [(of, test.parameters[of.name]) for of in fields if of.name in test.parameters]

    def _options_of(self, test: Queued) -> str:
        return ", ".join(word for name, word in texts.OPTIONS.items() if getattr(test, name))

    def _start_or_pause(self) -> None:
        if self._runner.going:
            self._runner.pause()
        else:
            self._runner.start()

    def _move(self, by: int) -> None:
        index, queue = self.selected, self._runner.queue
        if index is not None and self._runner.do(lambda: queue.move(index, by)):
            self.table.setCurrentCell(min(max(index + by, 0), len(queue.tests) - 1), 0)

    def _repeat(self) -> None:
        index, times = self.selected, self.copies.value()
        if index is not None:
            self._runner.do(lambda: self._runner.queue.repeat(index, times))

    def _skip(self) -> None:
        index = self.selected
        if index is not None:
            self._runner.do(lambda: self._runner.queue.skip(index))

    def _remove(self) -> None:
        index = self.selected
        if index is not None:
            self._runner.do(lambda: self._runner.queue.remove(index))

    def _edit(self) -> None:
        index = self.selected
        if index is not None and self.buttons["edit"].isEnabled():
            self.edit_requested.emit(self._runner.queue.tests[index], index + 1)

    def _arrange(self) -> None:
        self.table.setHorizontalHeaderLabels(texts.QUEUE_TITLES)
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.table.setAccessibleName(texts.NAMES["queue"])
        self.table.setToolTip(texts.QUEUE_TIP)
        self.table.verticalHeader().hide()
        self.table.setWordWrap(False)
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(3, QHeaderView.ResizeMode.Stretch)
        header.setStretchLastSection(True)
        give_key(self.start, "Ctrl+Shift+Q")
        self.start.setMinimumHeight(48)
        # a key press meant for the list must not start a run
        self.start.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.copies.setToolTip(COPIES_TIP)
        self.copies.setAccessibleName(COPIES)
        path: Path | None = self._runner.path
        self.kept.setText(texts.QUEUE_UNKEPT if path is None else texts.QUEUE_FILE.format(path=path))
        top, row = QHBoxLayout(), QHBoxLayout()
        top.addWidget(self.status, 1)
        top.addWidget(self.start)
        for name, _, key, tip in QUEUE_ACTIONS:
            button = self.buttons[name]
            give_key(button, key)
            button.setToolTip(f"{tip} ({key}).")
            row.addWidget(button)
            if name == "repeat":
                row.addWidget(self.copies)
        row.addStretch(1)
        content = QWidget()
        column = QVBoxLayout(content)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.table, 1)
        column.addLayout(row)
        column.addWidget(self.kept)
        whole = QVBoxLayout(self)
        # the status and the start button never scroll
        whole.addLayout(top)
        whole.addWidget(scrolling(content, FITTING[0], LOWEST), 1)


def _plain(default: object) -> object:
    """A default value as plain data, as it is read from a file."""
    return [*cast(tuple[object, ...], default)] if isinstance(default, tuple) else getattr(default, "value", default)


def _parameter_text(of: Declared, value: object) -> str:
    """A parameter with value and unit, as typed in the form."""
    values = cast(list[object], value) if isinstance(value, list) else [value]
    text = " ".join(as_typed(each) for each in values if each is not None) or texts.NO_VALUE
    unit = "" if of.unit in ("", "1") or text == texts.NO_VALUE else f" {unit_text(of.unit)}"
    return f"{label(of.name)} {text}{unit}"
