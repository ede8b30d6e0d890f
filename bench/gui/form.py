"""A form made from the declaration of a protocol's parameters: nothing is declared twice."""

from collections.abc import Mapping
from typing import Any

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QCheckBox, QComboBox, QFormLayout, QLabel, QLineEdit, QVBoxLayout, QWidget

from bench.cli.flags import given, in_words
from bench.config.declared import Declared, declared
from bench.config.validation import problems, validated
from bench.gui import texts
from bench.gui.header import set_level
from sim.parameters import Parameters

Field = QLineEdit | QComboBox | QCheckBox


class Form(QWidget):
    """One line per parameter: name, value, unit, and what is wrong with the value. An empty line is the default.

    Values are checked by the model, whole and strictly: one that is refused is shown as it was typed, never changed.
    """

    edited = Signal()

    def __init__(self, model: type[Parameters], values: Mapping[str, Any] | None = None) -> None:
        super().__init__()
        self._model = model
        self.fields: dict[str, Field] = {}
        self.errors: dict[str, QLabel] = {}
        layout = QFormLayout(self)
        for entry in declared(model):
            if entry.group is None:
                layout.addRow(_name(entry), self._line(entry, (values or {}).get(entry.name, entry.default)))
        self._check()

    def parameters(self) -> Parameters:
        """What the form says. Raises InvalidInput for the first value that is refused."""
        return validated(self._model, self._data())

    @property
    def refused(self) -> bool:
        """Whether a value is refused."""
        return bool(problems(self._model, self._data()))

    def _line(self, entry: Declared, value: Any) -> QWidget:
        field = _field(entry, value)
        field.setToolTip(_tip(entry))
        field.setAccessibleName(f"{entry.name} {entry.unit}".strip())
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
            found.setdefault(problem.item.split("[")[0].split(".")[0], problem.allowed)
        for name, label in self.errors.items():
            label.setVisible(name in found)
            label.setText(f"▲ {found.get(name, '')}")
            set_level(label, "alarm")

    def _data(self) -> dict[str, Any]:
        """Plain data as a file would hold it; lines that are empty are left out."""
        typed: dict[str, Any] = {}
        for entry in declared(self._model):
            field = self.fields.get(entry.name)
            if isinstance(field, QCheckBox):
                typed[entry.name] = field.isChecked()
            elif isinstance(field, QComboBox):
                typed[entry.name] = field.currentText() or None
            elif isinstance(field, QLineEdit) and (text := field.text().strip()):
                typed[entry.name] = _parts(entry, text) if entry.many else text
        return given(self._model, typed)


def _parts(entry: Declared, text: str) -> list[str]:
    """Several values: texts may hold spaces, and are set apart by semicolons; numbers by spaces, as everywhere."""
    return [part.strip() for part in text.split(";") if part.strip()] if entry.kind is str else [text]


def _field(entry: Declared, value: Any) -> Field:
    if entry.kind is bool:
        box = QCheckBox()
        box.setChecked(bool(value))
        return box
    if entry.choices and not entry.many:
        choice = QComboBox()
        choice.addItems([*([""] if entry.optional else []), *entry.choices])
        choice.setCurrentText("" if value is None else str(getattr(value, "value", value)))
        return choice
    return QLineEdit(_typed(entry, value))


def _typed(entry: Declared, value: Any) -> str:
    if value is None or type(value).__name__ == "PydanticUndefinedType":
        return ""
    if entry.many:
        return ("; " if entry.kind is str else " ").join(in_words(each) for each in value)
    return in_words(value)


def _name(entry: Declared) -> str:
    unit = "" if entry.unit in ("", "1") else f" [{entry.unit}]"
    return f"{entry.name.replace('_', ' ')}{unit}"


def _tip(entry: Declared) -> str:
    """What it is, between which limits, and what stands for an empty line."""
    lines = [
        f"{entry.description[:1].upper()}{entry.description[1:]}.",
        texts.MUST_BE.format(allowed=entry.allowed_in_unit),
    ]
    default = _typed(entry, entry.default)
    return "\n".join([*lines, texts.DEFAULT_TIP.format(default=default)] if default else lines)
