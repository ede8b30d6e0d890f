"""Forms generated from the declared parameters of a protocol, and the options of a run."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QCheckBox, QComboBox, QFormLayout, QHBoxLayout, QLabel, QLineEdit, QVBoxLayout, QWidget

from bench.app.display import texts
from bench.app.display.typography import typeset
from bench.app.formatting import as_typed
from bench.app.gui.widgets import ignore_wheel, set_level
from bench.app.ipc.messages import PlanCheck, Run
from bench.app.queue.queue import Queued
from bench.config.declared import Declared, declared
from bench.config.model import BenchConfiguration
from bench.config.validation import problems, read_fields, validated, with_present_names
from bench.document.typography import label, unit_text
from sim.parameters import Parameters

Field = QLineEdit | QComboBox | QCheckBox


class Form(QWidget):
    """One line per parameter: name, value, unit, and error message. An empty field means the default. The parameter
    model validates the values strictly; an invalid value stays as typed.
    """

    edited = Signal()

    def __init__(self, model: type[Parameters], values: Mapping[str, Any] | None = None) -> None:
        super().__init__()
        self._model = model
        values = with_present_names(model, values or {})
        self.unknown = {name: value for name, value in values.items() if name not in model.model_fields}
        """Given values for which the protocol has no parameter."""
        self.fields: dict[str, Field] = {}
        self.errors: dict[str, QLabel] = {}
        layout = QFormLayout(self)
        for entry in declared(model):
            if entry.group is None:
                layout.addRow(_name(entry), self._line(entry, values.get(entry.name, entry.default)))
        self._check()

    def entry_of(self, field: QObject | None) -> Declared | None:
        """The parameter of a field; None for anything else."""
        return next((each for each in declared(self._model) if self.fields.get(each.name) is field), None)

    def parameters(self) -> Parameters:
        """Parameters as entered. Raises InvalidInput for the first invalid value."""
        return validated(self._model, self._data())

    @property
    def refused(self) -> bool:
        """Whether any value is invalid."""
        return self._refused

    def _line(self, entry: Declared, value: Any) -> QWidget:
        field = _field(entry, value)
        field.setToolTip(_tip(entry))
        field.setAccessibleName(_name(entry))
        self.fields[entry.name], self.errors[entry.name] = field, QLabel(wordWrap=True)
        self.errors[entry.name].hide()
        changed = (
            field.textChanged
            if isinstance(field, QLineEdit)
            else field.currentTextChanged
            if isinstance(field, QComboBox)
            else field.toggled
        )
        changed.connect(self._on_change)
        line = QWidget()
        column = QVBoxLayout(line)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(field)
        column.addWidget(self.errors[entry.name])
        return line

    def _on_change(self) -> None:
        self._check()
        self.edited.emit()

    def _check(self) -> None:
        found: dict[str, str] = {}
        for problem in problems(self._model, self._data()):
            found.setdefault(problem.item.split("[")[0].split(".")[0], typeset(problem.allowed))
        self._refused = bool(found)
        for name, error in self.errors.items():
            error.setVisible(name in found)
            error.setText(f"▲ {found.get(name, '')}")
            set_level(error, "alarm")

    def typed(self) -> dict[str, str | bool | list[str]]:
        """The values as typed; empty fields are omitted."""
        typed: dict[str, str | bool | list[str]] = {}
        for entry in declared(self._model):
            field = self.fields.get(entry.name)
            if isinstance(field, QCheckBox):
                typed[entry.name] = field.isChecked()
            elif isinstance(field, QComboBox):
                if field.currentText():
                    typed[entry.name] = field.currentText()
            elif isinstance(field, QLineEdit) and (text := field.text().strip()):
                typed[entry.name] = _parts(text) if entry.many and entry.kind is str else text
        return typed

    def _data(self) -> dict[str, Any]:
        """The values as plain data, as if read from a file; empty fields are omitted."""
        return read_fields(self._model, self.typed())


def _parts(text: str) -> list[str]:
    """Split the text of a list of strings, which may contain spaces, at semicolons."""
    return [part.strip() for part in text.split(";") if part.strip()]


def _field(entry: Declared, value: Any) -> Field:
    if entry.kind is bool:
        box = QCheckBox()
        box.setChecked(bool(value))
        return box
    if entry.choices and not entry.many:
        choice = QComboBox()
        ignore_wheel(choice)
        choice.addItems([*([""] if entry.optional else []), *entry.choices])
        chosen = "" if _absent(value) else str(getattr(value, "value", value))
        if chosen and choice.findText(chosen) < 0:
            # an invalid value is shown as well, and its error message states the reason
            choice.addItem(chosen)
        choice.setCurrentText(chosen)
        return choice
    return QLineEdit(_typed(entry, value))


def _typed(entry: Declared, value: Any) -> str:
    if _absent(value):
        return ""
    if isinstance(value, list | tuple):
        values = cast(Sequence[object], value)
        return ("; " if entry.kind is str else " ").join(map(_exactly, values))
    return _exactly(value)


def default_text(entry: Declared) -> str:
    """The default as the user would type it; empty if there is none."""
    return _typed(entry, entry.default)


def _absent(value: object) -> bool:
    return value is None or type(value).__name__ == "PydanticUndefinedType"


def _exactly(value: object) -> str:
    """A value as the user would type it, with all its digits."""
    text = as_typed(value)
    return repr(value) if isinstance(value, float) and float(text) != value else text


def _name(entry: Declared) -> str:
    unit = "" if entry.unit in ("", "1") else f" [{unit_text(entry.unit)}]"
    return f"{label(entry.name)}{unit}"


def _tip(entry: Declared) -> str:
    """Tooltip of a field: description, valid values and default."""
    lines = [
        f"{typeset(entry.description[:1].upper() + entry.description[1:])}.",
        texts.MUST_BE.format(allowed=typeset(entry.allowed_in_unit)),
    ]
    default = default_text(entry)
    return "\n".join([*lines, texts.DEFAULT_TIP.format(default=default)] if default else lines)


class RunOptions(QWidget):
    """Form of the options of a run: folder of the results, operator, note, real time, questions to the operator, and
    continuation without the window.
    """

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
        boxes = QHBoxLayout()
        for box in (self.realtime, self.person):
            boxes.addWidget(box)
        boxes.addStretch(1)
        column.addLayout(boxes)
        column.addWidget(self.keep_going)
        self.realtime.setToolTip(texts.REALTIME_TIP)
        self.keep_going.setToolTip(texts.GO_ON_TIP)
        self.use(configuration)

    def use(self, configuration: BenchConfiguration) -> None:
        """Use this configuration. Real time is then selected, and the operator answers the questions unless the bench
        can perform all operator tasks itself.
        """
        self._configuration = configuration
        self.realtime.setChecked(True)
        self.realtime.setEnabled(not configuration.real_time_only)
        self.person.setChecked(not configuration.serves_itself)
        self.person.setToolTip(texts.ASK_TIP if configuration.serves_itself else texts.ASK_REAL_TIP)

    @property
    def out(self) -> Path | None:
        """The folder in the text field; None if the field is empty."""
        text = self.folder.text().strip()
        return Path(text) if text else None

    @property
    def unattended(self) -> bool:
        """Whether questions are answered with yes automatically although the bench needs an operator."""
        return not self.person.isChecked() and not self._configuration.serves_itself

    @property
    def for_queue(self) -> dict[str, object]:
        """The options as fields of a queued test."""
        return {
            "operator": self.operator.text().strip(),
            "note": self.note.text().strip(),
            "realtime": self.realtime.isChecked() and self.realtime.isEnabled(),
            "ask": self.person.isChecked() and self._configuration.serves_itself,
            "unattended": self.unattended,
            "keep_going": self.keep_going.isChecked(),
        }

    def run(self, plan: PlanCheck) -> Run:
        """The request to run a plan with these options."""
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

    def kept(self) -> Callable[[], None]:
        """A function that shows the present options again."""
        lines = [(field, field.text()) for field in (self.folder, self.operator, self.note)]
        boxes = [(box, box.isChecked()) for box in (self.realtime, self.person, self.keep_going)]

        def restore() -> None:
            for field, text in lines:
                field.setText(text)
            for box, checked in boxes:
                box.setChecked(checked)

        return restore

    def load(self, test: Queued) -> None:
        """Show the options of a queued test."""
        self.folder.setText(test.out or "")
        self.operator.setText(test.operator)
        self.note.setText(test.note)
        self.realtime.setChecked(test.realtime)
        self.person.setChecked((test.ask or not self._configuration.serves_itself) and not test.unattended)
        self.keep_going.setChecked(test.keep_going)
