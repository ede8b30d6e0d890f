"""What to run: the form of a protocol, what the plan comes to, and Start."""

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from bench.cli.catalogue import Entry
from bench.cli.output import check_folder, default_folder
from bench.config.model import BenchConfiguration
from bench.gui import texts
from bench.gui.controller import Controller
from bench.gui.form import Form
from bench.gui.plan_view import PlanView
from bench.link.messages import Ended, Refused, Run, Survey, Surveyed
from bench.results import FILE, SUMMARY
from sim.errors import RockbenchError


class ProtocolPage(QWidget):
    """A plan is checked before it can be started, and checked anew when anything in it has changed."""

    def __init__(
        self, controller: Controller, configuration: BenchConfiguration, entries: Sequence[Entry], tour: bool
    ) -> None:
        super().__init__()
        self._controller, self._configuration, self._entries = controller, configuration, tuple(entries)
        self._first_values = {"omega": (16.0,), "beta": (0.4,)} if tour else None
        self._checked: Surveyed | None = None
        self._checking = False
        self.choice = QComboBox()
        self.choice.addItems([entry.name for entry in entries])
        self.choice.setAccessibleName("protocol")
        self.form_area = QScrollArea(widgetResizable=True)
        self.plan = PlanView()
        self.folder, self.operator = QLineEdit(), QLineEdit()
        self.realtime, self.person, self.keep_going = (
            QCheckBox(name) for name in (texts.REALTIME, texts.ASK, texts.GO_ON)
        )
        self.check, self.start, self.clear = (QPushButton(name) for name in (texts.CHECK, texts.START, texts.CLEAR))
        self._prepare()
        self._arrange()
        self._choose(0)
        self.choice.currentIndexChanged.connect(self._choose)
        self.check.clicked.connect(self.survey)
        self.start.clicked.connect(self.begin)
        self.clear.clicked.connect(controller.clear_stop)
        controller.surveyed.connect(self._surveyed)
        controller.changed.connect(self.refresh)
        controller.ended.connect(self._ended)

    @property
    def entry(self) -> Entry:
        """The protocol that is chosen."""
        return self._entries[self.choice.currentIndex()]

    @property
    def why_not(self) -> str:
        """Why a run cannot be started now; empty when it can."""
        if self._controller.running:
            return texts.START_BUSY
        if self._controller.latched:
            return texts.LATCHED
        if self.form.refused:
            return texts.START_BAD
        if self._checked is None:
            return texts.CHECKING if self._checking else texts.START_UNCHECKED
        return texts.START_REFUSED if self._checked.refusal else ""

    def survey(self) -> None:
        """Have the plan computed."""
        try:
            asked = self._asked()
        except RockbenchError as error:
            self.plan.refuse(str(error))
            return
        self._checked, self._checking = None, True
        self.plan.say(texts.CHECKING)
        self._controller.survey(asked)
        self.refresh()

    def begin(self) -> None:
        """Start the run that was checked."""
        if self.why_not:
            return
        try:
            asked = self._asked()
        except RockbenchError as error:
            self.plan.refuse(str(error))
            return
        about = {"operator": self.operator.text().strip()} if self.operator.text().strip() else {}
        self._controller.start(
            Run(
                asked.make,
                asked.parameters,
                asked.configuration,
                asked.out,
                realtime=self.realtime.isChecked(),
                person=self.person.isChecked(),
                keep_going=self.keep_going.isChecked(),
                about=about,
            )
        )

    def refresh(self) -> None:
        """Show what may be pressed, and why not."""
        why = self.why_not
        self.start.setEnabled(not why)
        self.start.setToolTip(why or texts.START_TIP)
        busy = self._controller.running
        self.check.setEnabled(not busy and not self._checking and not self.form.refused)
        self.check.setToolTip(texts.START_BUSY if busy else texts.CHECK_TIP)
        self.clear.setVisible(self._controller.latched and not busy)

    def _asked(self) -> Survey:
        """The plan as the form has it. Raises InvalidInput."""
        entry, parameters = self.entry, self.form.parameters()
        experiment = entry.campaign(parameters)
        out = Path(self.folder.text().strip() or self.folder.placeholderText())
        further = getattr(experiment, "further_figures", ())
        kept = getattr(experiment, "kept_name", None)
        check_folder(out, (FILE, SUMMARY, experiment.figure_name, *further, *([kept] if kept else [])))
        return Survey(entry.campaign, parameters, self._configuration, out)

    def _choose(self, index: int) -> None:
        entry = self._entries[index]
        self.form = Form(entry.parameters, self._first_values if entry.name == "harmonic" else None)
        self.form.edited.connect(self._edited)
        self.form_area.setWidget(self.form)
        self.choice.setToolTip(f"{entry.summary}\n{entry.details}")
        self._edited()

    def _edited(self) -> None:
        self._checked, self._checking = None, False
        self.folder.setPlaceholderText(str(default_folder(self.entry.name, datetime.now())))
        self.plan.say(texts.START_UNCHECKED.capitalize() + ".")
        self.refresh()

    def _surveyed(self, found: Surveyed | Refused | Ended) -> None:
        if not self._checking:
            return
        self._checking = False
        if isinstance(found, Surveyed):
            self._checked = found
            self.plan.show_plan(found)
        elif isinstance(found, Refused):
            self.plan.refuse(found.text)
        self.refresh()

    def _ended(self) -> None:
        # the folder is taken now: another run needs another
        self.folder.clear()
        self._edited()

    def _prepare(self) -> None:
        serves_itself = self._configuration.serves_itself
        simulated = self._configuration.backend == "simulated"
        self.realtime.setChecked(True)
        self.realtime.setEnabled(simulated)
        self.person.setChecked(not serves_itself)
        self.person.setEnabled(serves_itself)
        for widget, tip in (
            (self.realtime, texts.REALTIME_TIP),
            (self.person, texts.ASK_TIP),
            (self.keep_going, texts.GO_ON_TIP),
            (self.folder, texts.FOLDER_TIP),
            (self.operator, texts.OPERATOR_TIP),
            (self.clear, texts.CLEAR_TIP),
        ):
            widget.setToolTip(tip)
        self.check.setShortcut("Ctrl+K")
        self.start.setShortcut("Ctrl+Return")
        # a key that was meant for the form must not start a run
        self.start.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.start.setMinimumHeight(48)

    def _arrange(self) -> None:
        left, right = QVBoxLayout(), QVBoxLayout()
        left.addWidget(self.choice)
        left.addWidget(self.form_area, 1)
        details = QFormLayout()
        details.addRow(texts.FOLDER, self.folder)
        details.addRow(texts.OPERATOR, self.operator)
        left.addLayout(details)
        for box in (self.realtime, self.person, self.keep_going):
            left.addWidget(box)
        right.addWidget(self.plan, 1)
        buttons = QHBoxLayout()
        for button in (self.check, self.start, self.clear):
            buttons.addWidget(button)
        right.addLayout(buttons)
        row = QHBoxLayout(self)
        row.addLayout(left, 4)
        row.addLayout(right, 6)
