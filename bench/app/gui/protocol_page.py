"""The Protocol page: parameter form, plan check, and start or queueing of a run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtWidgets import (
    QApplication,
    QComboBox,
    QHBoxLayout,
    QPushButton,
    QScrollArea,
    QSplitter,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from bench.app.display import texts
from bench.app.display.typography import typeset
from bench.app.folders import checked_folder, default_folder, make_folder, remove_unused, result_names
from bench.app.gui.controller import Controller
from bench.app.gui.form import Form, RunOptions
from bench.app.gui.help_panel import HelpPanel
from bench.app.gui.plan_view import PlanView
from bench.app.gui.preset_bar import PresetBar
from bench.app.gui.widgets import FITTING, give_key, ignore_wheel, scrolling
from bench.app.ipc.messages import PlanCheck, PlanChecked, Refused
from bench.app.queue.queue import Queued, queued
from bench.config.model import BenchConfiguration
from bench.protocol import Protocol
from sim.errors import RockbenchError


class ProtocolPage(QWidget):
    """Form and plan of a run. A plan must be checked before it is started or queued, and again after each change."""

    queued = Signal(object)
    """Emits a `Queued` to append to the queue."""
    saved = Signal(object, object)
    """Emits the edited `Queued` and its replacement."""
    left = Signal()
    """Emitted when the editing of a queued test has ended."""
    predicted = Signal(object)
    """Emits the prediction of the run that is about to begin."""

    def __init__(
        self,
        controller: Controller,
        configuration: BenchConfiguration,
        entries: Sequence[Protocol[Any]],
        tour: bool,
        presets: Path | None = None,
    ) -> None:
        super().__init__()
        self._controller, self._configuration, self._entries = controller, configuration, tuple(entries)
        self._first_values = {"omega": (16.0,), "beta": (0.4,)} if tour else None
        self._checked: PlanChecked | None = None
        self._carried_out: PlanChecked | None = None
        self._checking = self._began = self._unattended = False
        self._edited_test: Queued | None = None
        self._show_former: Callable[[], None] | None = None
        """Shows the options of a run that the form had before a queued test was edited."""
        self._made: Path | None = None
        self._folder = ""
        """Text of the folder of the current or last run."""
        # created before the choice of the protocol, so that the values follow that choice in the tab order
        self.presets = PresetBar(presets)
        self.choice = QComboBox()
        self.choice.addItems([entry.name for entry in entries])
        self.choice.setAccessibleName(texts.NAMES["protocol"])
        ignore_wheel(self.choice)
        self._forms: dict[str, Form] = {}
        self.form_area = QScrollArea(widgetResizable=True)
        self.plan, self.options = PlanView(), RunOptions(configuration)
        self.help, self.ask_help, self.right = HelpPanel(), QPushButton(texts.HELP), QStackedWidget()
        self.folder, self.operator = self.options.folder, self.options.operator
        self.realtime, self.person, self.keep_going = (
            self.options.realtime,
            self.options.person,
            self.options.keep_going,
        )
        self.check, self.start, self.add, self.leave = (
            QPushButton(name) for name in (texts.CHECK, texts.START, texts.ADD, texts.LEAVE)
        )
        self._arrange()
        self._choose(0)
        self.choice.currentIndexChanged.connect(self._choose)
        self.presets.filled.connect(self._fill)
        self.folder.textChanged.connect(self._edited)
        for box in (self.realtime, self.person):
            box.toggled.connect(self.refresh)
        self.check.clicked.connect(self.check_plan)
        self.start.clicked.connect(self.begin)
        self.add.clicked.connect(self.enqueue)
        self.leave.clicked.connect(self.leave_editing)
        self.ask_help.clicked.connect(self.explain)
        self.help.closed.connect(self._show_plan)
        controller.plan_checked.connect(self._plan_checked)
        controller.changed.connect(self.refresh)
        controller.ended.connect(self._ended)

    @property
    def entry(self) -> Protocol[Any]:
        """The selected protocol."""
        return self._entries[self.choice.currentIndex()]

    @property
    def why_not_planned(self) -> str:
        """Reason why no plan can be started or queued; empty if one can."""
        if self.form.refused:
            return texts.START_BAD
        if self._checked is None:
            return texts.CHECKING if self._checking else texts.START_UNCHECKED
        return texts.START_REFUSED if self._checked.refusal else ""

    @property
    def why_not(self) -> str:
        """Reason why a run cannot be started now; empty if it can."""
        if busy := self._controller.why_busy:
            return busy
        if self._controller.latched:
            return texts.LATCHED
        return self._controller.held or self.why_not_planned

    def use(self, configuration: BenchConfiguration) -> None:
        """Use another configuration; the plan must then be checked again."""
        self._configuration = configuration
        self.options.use(configuration)
        self._edited()

    def check_plan(self) -> None:
        """Request a plan check."""
        try:
            plan = self._plan_check()
        except RockbenchError as error:
            self._show_plan()
            self.plan.refuse(str(error))
            return
        self._checked, self._checking = None, True
        self._show_plan()
        self.plan.show_text(texts.CHECKING)
        self._controller.check_plan(plan, by=self)
        self.refresh()

    def begin(self) -> None:
        """Start the checked run."""
        checked = self._checked
        if self.why_not or checked is None:
            return
        try:
            plan = self._plan_check()
            if self.options.out is None:
                self._made = make_folder(plan.out)
                plan = replace(plan, out=self._made)
        except RockbenchError as error:
            self._show_plan()
            self.plan.refuse(str(error))
            return
        self._began, self._folder, self._carried_out = True, self.folder.text(), checked
        self.predicted.emit(checked.prediction)
        self._controller.start(self.options.run(plan))

    def enqueue(self) -> None:
        """Append the checked plan to the queue, or replace the test being edited."""
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
        """Show `test`, number `number` of the queue, in the form to be edited."""
        if self._edited_test is None:
            self._show_former = self.options.kept()
        self._edited_test = test
        self.choice.setCurrentIndex([entry.name for entry in self._entries].index(test.protocol))
        self._show_form(Form(self.entry.parameters, test.parameters))
        self.presets.report("")
        self.options.load(test)
        self.add.setText(texts.SAVE)
        self.add.setToolTip(texts.SAVE_TIP.format(number=number))
        self.leave.show()
        self.refresh()

    def leave_editing(self) -> None:
        """End the editing of a queued test."""
        if self._edited_test is not None:
            self._edited_test = None
            if self._show_former is not None:
                self._show_former()
            if self._folder and not self._began and self.folder.text() == self._folder:
                # the folder of a run that ended during the editing is now in use
                self.folder.clear()
            self.add.setText(texts.ADD)
            self.leave.hide()
            self.refresh()
            self.left.emit()

    def explain(self) -> None:
        """Show the help on the parameter whose field has the focus, or on the first one."""
        form = self.form
        entry = form.entry_of(QApplication.focusWidget()) or form.entry_of(next(iter(form.fields.values()), None))
        if entry is not None:
            self.help.explain(self.entry, entry)
            self.right.setCurrentWidget(self.help)

    def refresh(self) -> None:
        """Enable or disable the buttons; the tooltip of a disabled button gives the reason."""
        why, unplanned = self.why_not, self.why_not_planned
        self.start.setEnabled(not why)
        self.start.setToolTip(why or texts.START_TIP)
        self.add.setEnabled(not unplanned)
        if self._edited_test is None:
            self.add.setToolTip(unplanned or texts.ADD_TIP)
        self.check.setEnabled(not self._checking and not self.form.refused)
        self.check.setToolTip(texts.START_BAD if self.form.refused else texts.CHECK_TIP)
        unattended = self.options.unattended
        if unattended and not self._unattended:
            # the warning must not be hidden behind the help
            self._show_plan()
        self._unattended = unattended
        self.plan.warn(texts.UNATTENDED if unattended else "")

    def _show_plan(self) -> None:
        self.right.setCurrentWidget(self.plan)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """If the help is shown, show that of the parameter with the focus."""
        if event.type() == QEvent.Type.FocusIn and self.right.currentWidget() is self.help:
            entry = self.form.entry_of(watched)
            if entry is not None:
                self.help.explain(self.entry, entry)
        return super().eventFilter(watched, event)

    def _plan_check(self) -> PlanCheck:
        """Plan check with the values of the form. Raises InvalidInput for an invalid value or an unusable folder."""
        entry, parameters = self.entry, self.form.parameters()
        out = checked_folder(self.options.out, Path(self.folder.placeholderText()), result_names(entry))
        return PlanCheck(entry.name, parameters, self._configuration, out)

    def _choose(self, index: int) -> None:
        entry = self._entries[index]
        self.choice.setToolTip(typeset(f"{entry.summary}\n{entry.details}"))
        form = self._forms.get(entry.name)
        first = self._first_values if entry.name == "harmonic" else None
        last = self.presets.last(entry) if form is None and first is None else None
        self._show_form(form or Form(entry.parameters, first or last))
        if last is not None:
            self.presets.report(texts.LAST_VALUES_SHOWN)

    def _fill(self, values: Mapping[str, Any]) -> None:
        """Fill the form of the selected protocol with unvalidated values; the editing of a queued test continues."""
        self._show_form(Form(self.entry.parameters, values))

    def _show_form(self, form: Form) -> None:
        """Show the form of the selected protocol; the other forms keep their values."""
        former = cast(Form | None, self.form_area.takeWidget())
        if former is not None:
            former.edited.disconnect(self._edited)
        self.form = self._forms[self.entry.name] = form
        self.presets.use(self.entry, form)
        form.edited.connect(self._edited)
        for field in form.fields.values():
            field.installEventFilter(self)
        self.form_area.setWidget(form)
        form.show()
        order = [self.choice, *form.fields.values(), self.folder]
        for before, after in pairwise(order):
            QWidget.setTabOrder(before, after)
        self._edited()

    def _edited(self) -> None:
        self._checked, self._checking = None, False
        self._controller.cancel_check(self)
        self.folder.setPlaceholderText(str(default_folder(self.entry.name, datetime.now())))
        self.plan.show_text(texts.START_UNCHECKED.capitalize() + ".")
        self.refresh()

    def _plan_checked(self, found: PlanChecked | Refused, by: object) -> None:
        if by is not self or not self._checking:
            return
        self._checking = False
        if isinstance(found, PlanChecked):
            self._checked = found
            self.plan.show_plan(found)
            self.presets.keep_last()
        else:
            self.plan.refuse(found.text)
        self.refresh()

    def _ended(self) -> None:
        if self._made is not None:
            remove_unused(self._made)
            self._made = None
        if self._began:
            self._began = False
            used = self._folder or self._checked is self._carried_out
            if self._edited_test is None and used and self.folder.text() == self._folder:
                # the folder is now in use: the next run needs another. Without a folder, a plan that was checked during
                # the run stays checked
                self.folder.clear()
                self._edited()

    def _arrange(self) -> None:
        for button, key, tip in (
            (self.check, "Ctrl+K", texts.CHECK_TIP),
            (self.start, "Ctrl+Return", texts.START_TIP),
            (self.add, "Ctrl+J", texts.ADD_TIP),
            (self.leave, "Esc", texts.LEAVE_TIP),
        ):
            give_key(button, key)
            button.setToolTip(tip)
            button.setMinimumHeight(48)
        give_key(self.ask_help, "F1")
        self.ask_help.setToolTip(texts.HELP_TIP)
        # so that the field keeps the focus
        self.ask_help.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        # a key press meant for the form must not start a run
        self.start.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.leave.hide()
        left, right = QWidget(), QWidget()
        plan, found = QVBoxLayout(left), QVBoxLayout(right)
        top = QHBoxLayout()
        top.addWidget(self.choice, 1)
        for button in (self.presets.last_values, self.presets.defaults):
            top.addWidget(button)
        plan.addLayout(top)
        second = QHBoxLayout()
        second.addWidget(self.presets, 1)
        second.addWidget(self.ask_help, 0, Qt.AlignmentFlag.AlignTop)
        plan.addLayout(second)
        for part in (self.form_area, self.options):
            plan.addWidget(part, int(part is self.form_area))
        for part in (self.plan, self.help):
            self.right.addWidget(part)
        found.addWidget(self.right, 1)
        buttons = QHBoxLayout()
        buttons.addStretch(1)
        for button in (self.check, self.add, self.leave, self.start):
            buttons.addWidget(button)
        halves = QSplitter()
        halves.setChildrenCollapsible(False)
        for half, column in ((left, plan), (right, found)):
            column.setContentsMargins(0, 0, 0, 0)
            halves.addWidget(half)
        halves.setSizes([500, 740])
        whole = QVBoxLayout(self)
        whole.addWidget(scrolling(halves, *FITTING), 1)
        # the buttons never scroll
        whole.addLayout(buttons)
