"""What to run: the form of a protocol, what the plan comes to, and Start; or a place in the queue."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QPushButton, QScrollArea, QSplitter, QVBoxLayout, QWidget

from bench.cli.output import check_folder, default_folder, make_folder, remove_unused, result_names
from bench.cli.queueing import queued
from bench.config.model import BenchConfiguration
from bench.gui import texts
from bench.gui.buttons import give_key
from bench.gui.controller import Controller
from bench.gui.form import Form
from bench.gui.plan_view import PlanView
from bench.gui.run_options import RunOptions
from bench.link.messages import Refused, Survey, Surveyed
from bench.protocol import Protocol
from bench.queue.queued import Queued
from sim.errors import RockbenchError


class ProtocolPage(QWidget):
    """A plan is checked before it can be started or queued, and checked anew when anything in it has changed."""

    queued = Signal(object)
    """A `Queued` for the end of the queue."""
    saved = Signal(object, object)
    """The `Queued` that was edited, and the one that takes its place."""
    left = Signal()
    """The editing of a queued test is over."""
    predicted = Signal(object)
    """The prediction of the run that is about to begin."""

    def __init__(
        self, controller: Controller, configuration: BenchConfiguration, entries: Sequence[Protocol[Any]], tour: bool
    ) -> None:
        super().__init__()
        self._controller, self._configuration, self._entries = controller, configuration, tuple(entries)
        self._first_values = {"omega": (16.0,), "beta": (0.4,)} if tour else None
        self._checked: Surveyed | None = None
        self._checking = self._began = False
        self._edited_test: Queued | None = None
        self._made: Path | None = None
        self.choice = QComboBox()
        self.choice.addItems([entry.name for entry in entries])
        self.choice.setAccessibleName(texts.NAMES["protocol"])
        self.form_area = QScrollArea(widgetResizable=True)
        self.plan, self.options = PlanView(), RunOptions(configuration)
        self.folder, self.operator = self.options.folder, self.options.operator
        self.realtime, self.person, self.keep_going = (
            self.options.realtime,
            self.options.person,
            self.options.keep_going,
        )
        self.check, self.start, self.add, self.leave, self.clear = (
            QPushButton(name) for name in (texts.CHECK, texts.START, texts.ADD, texts.LEAVE, texts.CLEAR)
        )
        self._arrange()
        self._choose(0)
        self.choice.currentIndexChanged.connect(self._choose)
        self.folder.textChanged.connect(self._edited)
        for box in (self.realtime, self.person):
            box.toggled.connect(self.refresh)
        self.check.clicked.connect(self.survey)
        self.start.clicked.connect(self.begin)
        self.add.clicked.connect(self.enqueue)
        self.leave.clicked.connect(self.leave_editing)
        self.clear.clicked.connect(controller.clear_stop)
        controller.surveyed.connect(self._surveyed)
        controller.changed.connect(self.refresh)
        controller.ended.connect(self._ended)

    @property
    def entry(self) -> Protocol[Any]:
        """The protocol that is chosen."""
        return self._entries[self.choice.currentIndex()]

    @property
    def why_not_planned(self) -> str:
        """Why there is no plan that could be started or queued; empty when there is one."""
        if self.form.refused:
            return texts.START_BAD
        if self._checked is None:
            return texts.CHECKING if self._checking else texts.START_UNCHECKED
        return texts.START_REFUSED if self._checked.refusal else ""

    @property
    def why_not(self) -> str:
        """Why a run cannot be started now; empty when it can."""
        if self._controller.running:
            return texts.START_BUSY
        if self._controller.latched:
            return texts.LATCHED
        return self._controller.held or self.why_not_planned

    def use(self, configuration: BenchConfiguration) -> None:
        """From now on plan for this bench."""
        self._configuration = configuration
        self.options.use(configuration)
        self._edited()

    def survey(self) -> None:
        """Have the plan computed."""
        try:
            asked = self._asked()
        except RockbenchError as error:
            self.plan.refuse(str(error))
            return
        self._checked, self._checking = None, True
        self.plan.say(texts.CHECKING)
        self._controller.survey(asked, by=self)
        self.refresh()

    def begin(self) -> None:
        """Start the run that was checked."""
        checked = self._checked
        if self.why_not or checked is None:
            return
        try:
            asked = self._asked()
            if self.options.out is None:
                self._made = make_folder(asked.out)
                asked = replace(asked, out=self._made)
        except RockbenchError as error:
            self.plan.refuse(str(error))
            return
        self._began = True
        self.predicted.emit(checked.prediction)
        self._controller.start(self.options.run(asked))

    def enqueue(self) -> None:
        """Put the plan that was checked into the queue, or in place of the test that is edited."""
        if self.why_not_planned:
            return
        test = queued(self.entry, self.form.parameters(), self.options.out, **self.options.for_queue)
        edited = self._edited_test
        if edited is None:
            self.folder.clear()
            self.queued.emit(test)
        else:
            self.saved.emit(edited, test)
            self.leave_editing()

    def edit(self, test: Queued, number: int) -> None:
        """Open test `number` of the queue, which has not begun."""
        self._edited_test = test
        self.choice.setCurrentIndex([entry.name for entry in self._entries].index(test.protocol))
        self._show_form(test.parameters)
        self.options.load(test)
        self.add.setText(texts.SAVE)
        self.add.setToolTip(texts.SAVE_TIP.format(number=number))
        self.leave.show()
        self.refresh()

    def leave_editing(self) -> None:
        """The form is for new plans again."""
        if self._edited_test is not None:
            self._edited_test = None
            self.folder.clear()
            self.add.setText(texts.ADD)
            self.leave.hide()
            self.refresh()
            self.left.emit()

    def refresh(self) -> None:
        """Show what may be pressed, and why not."""
        why, unplanned = self.why_not, self.why_not_planned
        self.start.setEnabled(not why)
        self.start.setToolTip(why or texts.START_TIP)
        self.add.setEnabled(not unplanned)
        if self._edited_test is None:
            self.add.setToolTip(unplanned or texts.ADD_TIP)
        self.check.setEnabled(not self._checking and not self.form.refused)
        self.check.setToolTip(texts.START_BAD if self.form.refused else texts.CHECK_TIP)
        self.clear.setVisible(self._controller.latched and not self._controller.running)
        self.plan.warn(texts.UNATTENDED if self.options.unattended else "")

    def _asked(self) -> Survey:
        """The plan as the form has it. Raises InvalidInput."""
        entry, parameters = self.entry, self.form.parameters()
        out = self.options.out or Path(self.folder.placeholderText())
        check_folder(out, result_names(entry))
        return Survey(entry.name, parameters, self._configuration, out)

    def _choose(self, index: int) -> None:
        entry = self._entries[index]
        self.choice.setToolTip(f"{entry.summary}\n{entry.details}")
        self._show_form(self._first_values if entry.name == "harmonic" else None)

    def _show_form(self, values: Mapping[str, object] | None) -> None:
        self.form = Form(self.entry.parameters, values)
        self.form.edited.connect(self._edited)
        self.form_area.setWidget(self.form)
        self._edited()

    def _edited(self) -> None:
        self._checked, self._checking = None, False
        self._controller.give_up(self)
        self.folder.setPlaceholderText(str(default_folder(self.entry.name, datetime.now())))
        self.plan.say(texts.START_UNCHECKED.capitalize() + ".")
        self.refresh()

    def _surveyed(self, found: Surveyed | Refused, by: object) -> None:
        if by is not self or not self._checking:
            return
        self._checking = False
        if isinstance(found, Surveyed):
            self._checked = found
            self.plan.show_plan(found)
        else:
            self.plan.refuse(found.text)
        self.refresh()

    def _ended(self) -> None:
        if self._made is not None:
            remove_unused(self._made)
            self._made = None
        if self._began:
            # the folder is taken now: another run needs another
            self._began = False
            self.folder.clear()
            self._edited()

    def _arrange(self) -> None:
        for button, key, tip in (
            (self.check, "Ctrl+K", texts.CHECK_TIP),
            (self.start, "Ctrl+Return", texts.START_TIP),
            (self.add, "Ctrl+J", texts.ADD_TIP),
            (self.leave, "Esc", texts.LEAVE_TIP),
            (self.clear, "Ctrl+Shift+K", texts.CLEAR_TIP),
        ):
            give_key(button, key)
            button.setToolTip(tip)
            button.setMinimumHeight(48)
        # a key that was meant for the form must not start a run
        self.start.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.leave.hide()
        left, right = QWidget(), QWidget()
        asked, found = QVBoxLayout(left), QVBoxLayout(right)
        for part in (self.choice, self.form_area, self.options):
            asked.addWidget(part, int(part is self.form_area))
        found.addWidget(self.plan, 1)
        buttons = QHBoxLayout()
        for button in (self.check, self.add, self.leave, self.start, self.clear):
            buttons.addWidget(button)
        found.addLayout(buttons)
        halves = QSplitter()
        halves.setChildrenCollapsible(False)
        for half, column in ((left, asked), (right, found)):
            column.setContentsMargins(0, 0, 0, 0)
            halves.addWidget(half)
        halves.setSizes([500, 740])
        QVBoxLayout(self).addWidget(halves)
