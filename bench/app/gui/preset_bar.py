"""Row above a protocol's form: defaults, last checked values, and named presets."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from bench.app.display import texts
from bench.app.formatting import as_typed
from bench.app.gui.form import Form
from bench.app.gui.widgets import ElidingLabel, ignore_wheel, set_level
from bench.app.presets import Presets
from bench.protocol import Protocol
from sim.errors import RockbenchError


class PresetBar(QWidget):
    """Fills the form of a protocol, and saves its values. Without a `folder` only the defaults are available.

    The page places `last_values` and `defaults` next to the choice of the protocol.
    """

    filled = Signal(object)
    """Emits unvalidated values for the form, by parameter name; absent parameters have their defaults."""

    def __init__(self, folder: Path | None) -> None:
        super().__init__()
        self._presets = None if folder is None else Presets(folder)
        self._protocol: Protocol[Any] | None = None
        self._form: Form | None = None
        self._loaded = self._replaced = ""
        self.name = QComboBox(editable=True, insertPolicy=QComboBox.InsertPolicy.NoInsert)
        self.name.setAccessibleName(texts.PRESET)
        self.name.setToolTip(texts.PRESET_TIP)
        self.name.setMinimumContentsLength(6)
        self.name.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        ignore_wheel(self.name)
        self.save, self.delete, self.last_values, self.defaults = (
            QPushButton(text) for text in (texts.PRESET_SAVE, texts.PRESET_DELETE, texts.LAST_VALUES, texts.DEFAULTS)
        )
        self.message = ElidingLabel()
        self.message.hide()
        row = QHBoxLayout()
        row.addWidget(self.name, 1)
        for button in (self.save, self.delete):
            row.addWidget(button)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(row)
        column.addWidget(self.message)
        edit = self.name.lineEdit()
        if edit is not None:
            edit.setPlaceholderText(texts.PRESET_HINT)
        self.name.activated.connect(self.load)
        self.name.editTextChanged.connect(self._refresh)
        self.save.clicked.connect(self._save)
        self.delete.clicked.connect(self._delete)
        self.last_values.clicked.connect(self._fill_last)
        self.defaults.clicked.connect(lambda: self._fill(dict, ""))
        self.defaults.setToolTip(texts.DEFAULTS_TIP)

    def use(self, protocol: Protocol[Any], form: Form) -> None:
        """Connect this row to `form`, the displayed form of a protocol."""
        if self._form is not None:
            # the form may have been replaced and deleted
            with suppress(RuntimeError):
                self._form.edited.disconnect(self._edited)
        changed, self._protocol, self._form = protocol is not self._protocol, protocol, form
        form.edited.connect(self._edited)
        if changed:
            self._loaded = self._replaced = ""
            self._say("", "calm")
            self._list("")
        self._refresh()

    def last(self, protocol: Protocol[Any]) -> dict[str, Any] | None:
        """The unvalidated values of the last checked plan; None if there are none or they cannot be read."""
        try:
            return None if self._presets is None else self._presets.last(protocol.name)
        except RockbenchError:
            # a press of the button for the last values shows the error
            return None

    def keep_last(self) -> None:
        """Store the values of the form as those of the last checked plan."""
        presets, protocol, form = self._presets, self._protocol, self._form
        if presets is None or protocol is None or form is None:
            return
        try:
            presets.keep_last(protocol, form.typed())
        except RockbenchError as error:
            self._say(str(error), "alarm")
        self._refresh()

    def report(self, done: str) -> None:
        """Show `done`, which states the origin of the values in the form, the values for which the protocol has no
        parameter, and whether any value is invalid.
        """
        form, words = self._form, [done]
        if form is not None and form.unknown:
            shown = ", ".join(f"{name} = {as_typed(value)}" for name, value in form.unknown.items())
            words.append(texts.PRESET_UNKNOWN.format(values=shown))
        if form is not None and form.refused:
            words.append(texts.PRESET_INVALID)
        self._say(" ".join(filter(None, words)), "alarm" if len(words) > 1 else "calm")

    def load(self) -> None:
        """Fill the form with the named preset."""
        presets, protocol, name = self._presets, self._protocol, self.name.currentText().strip()
        if presets is None or protocol is None or not self._listed(name):
            return
        if self._fill(lambda: presets.load(protocol.name, name), texts.PRESET_LOADED.format(name=name)):
            self._loaded, self._replaced = name, ""

    def _fill_last(self) -> None:
        presets, protocol = self._presets, self._protocol
        if presets is not None and protocol is not None:
            self._fill(lambda: presets.last(protocol.name) or {}, texts.LAST_VALUES_SHOWN)

    def _fill(self, values: Callable[[], Mapping[str, Any]], done: str) -> bool:
        """Whether the values could be read."""
        try:
            self.filled.emit(values())
        except RockbenchError as error:
            self._say(str(error), "alarm")
            return False
        self.report(done)
        return True

    def _save(self) -> None:
        presets, protocol, form, name = self._presets, self._protocol, self._form, self.name.currentText().strip()
        if presets is None or protocol is None or form is None:
            return
        if self._listed(name) and name not in (self._loaded, self._replaced):
            self._replaced = name
            self._say(texts.PRESET_EXISTS.format(name=name), "wait")
            return
        try:
            path = presets.save(protocol, name, form.typed())
        except RockbenchError as error:
            self._say(str(error), "alarm")
        else:
            self._say(texts.PRESET_SAVED.format(path=path), "calm")
            self._loaded, self._replaced = name, ""
            self._list(name)

    def _delete(self) -> None:
        presets, protocol, name = self._presets, self._protocol, self._listed(self.name.currentText().strip())
        if presets is None or protocol is None or not name:
            return
        try:
            presets.delete(protocol.name, name)
        except RockbenchError as error:
            self._say(str(error), "alarm")
        else:
            self._say(texts.PRESET_DELETED.format(name=name), "calm")
            self._list("")

    def _edited(self) -> None:
        self._say("", "calm")
        self._refresh()

    def _listed(self, name: str) -> str:
        """The preset of this name in its own spelling, or one that differs only in case, which denotes the same file on
        some systems; empty if there is none.
        """
        names = [self.name.itemText(place) for place in range(self.name.count())]
        return next((each for each in names if each == name), "") or next(
            (each for each in names if each.casefold() == name.casefold()), ""
        )

    def _list(self, name: str) -> None:
        """List the presets of the protocol, and show `name`."""
        self.name.blockSignals(True)
        self.name.clear()
        if self._presets is not None and self._protocol is not None:
            self.name.addItems(self._presets.names(self._protocol.name))
        self.name.setCurrentIndex(self.name.findText(name))
        self.name.setEditText(name)
        if (edit := self.name.lineEdit()) is not None:
            # so that the beginning of a long name is visible
            edit.setCursorPosition(0)
        self.name.blockSignals(False)
        self._refresh()

    def _say(self, text: str, level: str) -> None:
        self.message.setText(f"▲ {text}" if level == "alarm" else text)
        self.message.setVisible(bool(text))
        set_level(self.message, level)

    def _refresh(self) -> None:
        """Enable or disable the buttons; the tooltip of a disabled button gives the reason."""
        presets, protocol, form, name = self._presets, self._protocol, self._form, self.name.currentText().strip()
        invalid = texts.START_BAD if form is not None and form.refused else ""
        unnamed = "" if name else texts.PRESET_NO_NAME
        unknown = "" if self._listed(name) else texts.PRESET_NONE
        checked = presets is not None and protocol is not None and presets.has_last(protocol.name)
        for button, why, tip in (
            (self.save, unnamed or invalid, texts.PRESET_SAVE_TIP),
            (self.delete, unnamed or unknown, texts.PRESET_DELETE_TIP),
            (self.last_values, "" if checked else texts.LAST_VALUES_NONE, texts.LAST_VALUES_TIP),
        ):
            button.setEnabled(not why)
            button.setToolTip(why or tip)
        for part in (self.name, self.save, self.delete, self.last_values):
            part.setVisible(presets is not None)
