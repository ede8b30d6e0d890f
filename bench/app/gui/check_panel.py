"""Panel of the loop check, which is started like any other run; each line appears with its verdict when complete."""

from datetime import datetime
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QColor
from PySide6.QtWidgets import (
    QAbstractItemView,
    QCheckBox,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from bench.analysis.check_line import CheckLine, Verdict
from bench.app.catalogue import CHECK, load_protocol
from bench.app.display import texts
from bench.app.display.theme import Theme
from bench.app.display.typography import spaced, typeset
from bench.app.folders import default_folder, make_folder, remove_unused
from bench.app.formatting import ABSENT
from bench.app.gui.controller import Controller
from bench.app.gui.widgets import give_key, set_level
from bench.app.ipc.messages import Ended, Refused, Run
from bench.config.model import BenchConfiguration
from bench.document.typography import label, unit_text
from bench.events import Event, PointFinished
from sim.errors import RockbenchError

MARKS = {
    Verdict.PASSED: ("✓", "good"),
    Verdict.FAILED: ("▲", "alarm"),
    Verdict.STATED: ("·", "calm"),
    Verdict.UNTESTED: ("?", "wait"),
}


class CheckPanel(QWidget):
    """Runs `rockbench check` with default parameters; other values can be set on the Protocol page."""

    predicted = Signal(object)
    """Emits an empty prediction when a check begins, since a check measures no gains."""

    def __init__(self, controller: Controller, theme: Theme) -> None:
        super().__init__()
        self._controller, self._theme = controller, theme
        self._configuration = BenchConfiguration()
        self._ours = False
        self._folder: Path | None = None
        self.lines: list[CheckLine] = []
        self.check, self.person = QPushButton(texts.CHECK_LOOP), QCheckBox(texts.ASK)
        give_key(self.check, "Ctrl+L")
        # an unintended key press must not move the table
        self.check.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.message = QLabel(texts.CHECK_LOOP_IDLE, wordWrap=True)
        self.table = QTableWidget(0, len(texts.CHECK_TITLES))
        self.table.setHorizontalHeaderLabels(texts.CHECK_TITLES)
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setAccessibleName(texts.NAMES["check"])
        self.table.setToolTip(texts.CHECK_TABLE_TIP)
        self.table.verticalHeader().hide()
        self.table.setWordWrap(False)
        self.table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.table.horizontalHeader().setSectionResizeMode(2, QHeaderView.ResizeMode.Stretch)
        row = QHBoxLayout()
        row.addWidget(self.message, 1)
        row.addWidget(self.person)
        row.addWidget(self.check)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(row)
        column.addWidget(self.table, 1)
        self.check.clicked.connect(self.start)
        controller.began.connect(self._began)
        controller.event_received.connect(self._tell)
        controller.ended.connect(self._ended)
        controller.changed.connect(self._refresh)
        self._refresh()

    def use(self, configuration: BenchConfiguration) -> None:
        """Use this configuration, and clear the table. If the bench cannot perform the operator tasks itself, the check
        always asks the operator.
        """
        self._configuration = configuration
        self.person.setChecked(not configuration.serves_itself)
        self.person.setEnabled(configuration.serves_itself)
        self.person.setToolTip(texts.ASK_TIP if configuration.serves_itself else texts.ASK_CHECK_TIP)
        self._clear()

    def start(self) -> None:
        """Run the check."""
        if self._why_not:
            return
        try:
            out = make_folder(default_folder(CHECK, datetime.now()))
        except RockbenchError as error:
            self._say(str(error), "alarm")
            return
        self._folder = out
        person = self.person.isChecked()
        self.predicted.emit({})
        self._controller.start(Run(CHECK, load_protocol(CHECK).parameters(), self._configuration, out, person=person))

    def _clear(self) -> None:
        self._say(texts.CHECK_LOOP_IDLE, "calm")
        self.lines.clear()
        self.table.setRowCount(0)

    def use_theme(self, theme: Theme) -> None:
        self._theme = theme
        for row, line in enumerate(self.lines):
            self._colour(row, line.verdict)

    @property
    def _why_not(self) -> str:
        if busy := self._controller.why_busy:
            return busy
        return texts.LATCHED if self._controller.latched else self._controller.held

    def _began(self, run: Run) -> None:
        # the check of another bench, to which this window is attached, is no check of this one
        self._ours = run.protocol == CHECK and run.configuration == self._configuration
        if self._ours:
            self.lines.clear()
            self.table.setRowCount(0)
            self._say(texts.CHECK_LOOP_RUNNING, "wait")

    def _tell(self, event: Event) -> None:
        if not self._ours or not isinstance(event, PointFinished) or not isinstance(event.point, CheckLine):
            return
        line, row = event.point, len(self.lines)
        self.lines.append(line)
        self.table.setRowCount(row + 1)
        for column, text in enumerate(_cells(line)):
            item = QTableWidgetItem(text)
            item.setToolTip(spaced(line.remedy) or text)
            if 3 <= column <= 5:
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            self.table.setItem(row, column, item)
        self._colour(row, line.verdict)
        self.table.scrollToBottom()

    def _colour(self, row: int, verdict: Verdict) -> None:
        item = self.table.item(row, 0)
        if item is not None:
            item.setForeground(QColor(str(getattr(self._theme, MARKS[verdict][1]))))

    def _ended(self, ended: Ended | Refused) -> None:
        if not self._ours:
            return
        self._ours = False
        if self._folder is not None:
            remove_unused(self._folder)
            self._folder = None
        passed, failed = (sum(line.verdict is kind for line in self.lines) for kind in (Verdict.PASSED, Verdict.FAILED))
        well = isinstance(ended, Ended) and ended.status == "completed"
        how = texts.CHECK_IN.format(out=ended.out) if isinstance(ended, Ended) and well else texts.CHECK_CUT
        counts = {"passed": passed, "failed": failed, "other": len(self.lines) - passed - failed}
        remedies = "\n".join(
            f"▲ {label(line.subject)}: {typeset(line.remedy)}" for line in self.lines if line.verdict is Verdict.FAILED
        )
        text = texts.CHECK_LOOP_ENDED.format(**counts, how=how)
        self._say(f"{text}\n{remedies}".strip(), "good" if well and not failed else "alarm")

    def _say(self, text: str, level: str) -> None:
        self.message.setText(text)
        set_level(self.message, level)

    def _refresh(self) -> None:
        if self._ours and not self._controller.running:
            # the window was detached from the run
            self._ours = False
            self._clear()
        why = self._why_not
        self.check.setEnabled(not why)
        self.check.setToolTip(why or texts.CHECK_LOOP_TIP)


def _cells(line: CheckLine) -> tuple[str, ...]:
    def number(value: float | None, digits: int = 4) -> str:
        return ABSENT if value is None else f"{value:.{digits}g}"

    allowed = ABSENT
    if line.lowest is not None:
        allowed = f"{number(line.lowest, 3)} .. {'' if line.highest is None else number(line.highest, 3)}".strip()
    unit = "" if line.measured is None or line.unit == "1" else f" {unit_text(line.unit)}"
    verdict = f"{MARKS[line.verdict][0]} {line.verdict}"
    return (
        verdict,
        label(line.subject),
        spaced(line.what),
        f"{number(line.measured)}{unit}",
        number(line.uncertainty, 2),
        allowed,
    )
