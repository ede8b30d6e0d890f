"""How a protocol is run, as opposed to what it asks for."""

from pathlib import Path

from PySide6.QtWidgets import QCheckBox, QFormLayout, QLineEdit, QVBoxLayout, QWidget

from bench.config.model import BenchConfiguration
from bench.gui import texts
from bench.link.messages import Run, Survey
from bench.queue.queued import Queued


class RunOptions(QWidget):
    """Where its results go, who runs it, who answers its questions."""

    def __init__(self, configuration: BenchConfiguration) -> None:
        super().__init__()
        self._configuration = configuration
        self.folder, self.operator, self.note = QLineEdit(), QLineEdit(), QLineEdit()
        self.realtime, self.person, self.keep_going = (
            QCheckBox(name) for name in (texts.REALTIME, texts.ASK, texts.GO_ON)
        )
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        lines = QFormLayout()
        for name, field, tip in (
            (texts.FOLDER, self.folder, texts.FOLDER_TIP),
            (texts.OPERATOR, self.operator, texts.OPERATOR_TIP),
            (texts.NOTE, self.note, texts.NOTE_TIP),
        ):
            lines.addRow(name, field)
            field.setToolTip(tip)
            field.setAccessibleName(name)
        column.addLayout(lines)
        for box in (self.realtime, self.person, self.keep_going):
            column.addWidget(box)
        self.realtime.setToolTip(texts.REALTIME_TIP)
        self.keep_going.setToolTip(texts.GO_ON_TIP)
        self.use(configuration)

    def use(self, configuration: BenchConfiguration) -> None:
        """Begin anew, as it suits this bench: a real one asks."""
        self._configuration = configuration
        self.realtime.setChecked(True)
        self.realtime.setEnabled(configuration.backend == "simulated")
        self.person.setChecked(not configuration.serves_itself)
        self.person.setToolTip(texts.ASK_TIP if configuration.serves_itself else texts.ASK_REAL_TIP)

    @property
    def out(self) -> Path | None:
        """The folder that was typed; None when none was."""
        text = self.folder.text().strip()
        return Path(text) if text else None

    @property
    def unattended(self) -> bool:
        """Whether every question is answered with yes on a bench that needs a person."""
        return not self.person.isChecked() and not self._configuration.serves_itself

    @property
    def for_queue(self) -> dict[str, object]:
        """The fields of a queued test that are decided here."""
        return {
            "operator": self.operator.text().strip(),
            "note": self.note.text().strip(),
            "realtime": self.realtime.isChecked() and self.realtime.isEnabled(),
            "ask": self.person.isChecked() and self._configuration.serves_itself,
            "unattended": self.unattended,
            "keep_going": self.keep_going.isChecked(),
        }

    def run(self, plan: Survey) -> Run:
        """The run of a plan."""
        told = {"operator": self.operator.text().strip(), "notes": self.note.text().strip()}
        return Run(
            plan.protocol,
            plan.parameters,
            plan.configuration,
            plan.out,
            realtime=self.realtime.isChecked(),
            person=self.person.isChecked(),
            keep_going=self.keep_going.isChecked(),
            about={name: text for name, text in told.items() if text},
        )

    def load(self, test: Queued) -> None:
        """As they are for a test of the queue."""
        self.folder.setText(test.out or "")
        self.operator.setText(test.operator)
        self.note.setText(test.note)
        self.realtime.setChecked(test.realtime)
        self.person.setChecked((test.ask or not self._configuration.serves_itself) and not test.unattended)
        self.keep_going.setChecked(test.keep_going)
