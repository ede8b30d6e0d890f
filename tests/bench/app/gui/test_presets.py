"""Values of the form that are kept: the last checked ones, named presets, and the recent configurations."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QSettings, Qt
from PySide6.QtWidgets import QCheckBox, QComboBox, QLineEdit
from pytestqt.qtbot import QtBot

from bench.app.catalogue import load_protocol
from bench.app.cli.inputs import parameters_from
from bench.app.display import texts
from bench.app.display.theme import LIGHT
from bench.app.gui.controller import Controller
from bench.app.gui.form import Form
from bench.app.gui.protocol_page import ProtocolPage
from bench.app.gui.setup_page import SetupPage
from bench.app.gui.window import Window
from bench.app.ipc.messages import PlanChecked
from bench.app.presets import LAST, Presets
from bench.config.template import write_template
from bench.protocol import Protocol
from sim.errors import InvalidInput
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.gui.shared_window import PROTOCOLS, undressed
from tests.bench.app.ipc.experiment import bench

pytestmark = pytest.mark.usefixtures("without_plots", "spoken")

FINE = PlanChecked((), None, (), 60.0, 1e6, 1e9, "hash", {})


def _opened(qtbot: QtBot, folder: Path) -> Window:
    settings = QSettings(str(folder / "kept.ini"), QSettings.Format.IniFormat)
    with undressed():
        window = Window(Controller(), bench(), PROTOCOLS, LIGHT, settings=settings, presets=folder / "presets")
    qtbot.addWidget(window)
    window.show()
    window.pages.setCurrentWidget(window.protocol)
    return window


def _page(qtbot: QtBot, folder: Path) -> ProtocolPage:
    page = ProtocolPage(Controller(), bench(), PROTOCOLS, False, folder / "presets")
    qtbot.addWidget(page)
    page.show()
    return page


def _setup(qtbot: QtBot, folder: Path) -> SetupPage:
    settings = QSettings(str(folder / "kept.ini"), QSettings.Format.IniFormat)
    page = SetupPage(Controller(), bench(), None, LIGHT, settings)
    qtbot.addWidget(page)
    page.show()
    return page


def _monday(folder: Path, text: str) -> Path:
    """The file of a preset Monday that was written by hand."""
    file = folder / "presets" / "harmonic" / "Monday.toml"
    file.parent.mkdir(parents=True)
    file.write_text(text, encoding="utf-8")
    return file


def _line(form: Form, name: str) -> QLineEdit:
    field = form.fields[name]
    assert isinstance(field, QLineEdit)
    return field


def _check(window: Window, spoken: type[ScriptedClient]) -> None:
    window.protocol.check_plan()
    spoken.latest.said.append(FINE)
    window._controller._look()
    assert window.protocol.start.isEnabled()


def test_checked_values_are_there_after_a_restart(qtbot: QtBot, tmp_path: Path, spoken: type[ScriptedClient]) -> None:
    first = _opened(qtbot, tmp_path)
    page = first.protocol
    page.choice.setCurrentText("harmonic")
    assert not page.presets.last_values.isEnabled()
    _line(page.form, "omega").setText("16:18:3")
    _line(page.form, "ramp_time").setText("2500ms")
    expected = page.form.parameters()
    _check(first, spoken)
    _line(page.form, "omega").setText("12")
    first.leave()

    page = _opened(qtbot, tmp_path).protocol
    page.choice.setCurrentText("harmonic")
    assert (_line(page.form, "omega").text(), _line(page.form, "ramp_time").text()) == ("16:18:3", "2500ms")
    assert page.form.parameters() == expected
    assert page.presets.message.text() == texts.LAST_VALUES_SHOWN
    assert not page.start.isEnabled(), "what was checked yesterday must be checked again"
    qtbot.mouseClick(page.presets.defaults, Qt.MouseButton.LeftButton)
    assert page.form.parameters() == page.entry.parameters()
    assert page.presets.message.isHidden()
    qtbot.mouseClick(page.presets.last_values, Qt.MouseButton.LeftButton)
    assert page.form.parameters() == expected


def test_a_preset_is_saved_loaded_and_deleted(qtbot: QtBot, tmp_path: Path) -> None:
    page = _page(qtbot, tmp_path)
    bar = page.presets
    page.choice.setCurrentText("harmonic")
    assert bar.save.toolTip() == texts.PRESET_NO_NAME
    _line(page.form, "omega").setText("14.123456789 15.5")
    bar.name.setEditText("Monday, β = 0.4")
    qtbot.mouseClick(bar.save, Qt.MouseButton.LeftButton)
    file = tmp_path / "presets" / "harmonic" / "Monday, β = 0.4.toml"
    assert str(file) in bar.message.text()
    # the command line reads the same file
    assert parameters_from(page.entry.parameters, {}, file) == page.form.parameters()
    expected = page.form.parameters()
    page.choice.setCurrentText("identify")
    assert (bar.name.count(), bar.name.currentText()) == (0, "")
    page.choice.setCurrentText("harmonic")
    qtbot.mouseClick(bar.defaults, Qt.MouseButton.LeftButton)
    assert page.form.parameters() != expected
    bar.name.setCurrentIndex(0)
    bar.name.activated.emit(0)
    assert page.form.parameters() == expected
    assert bar.message.text() == texts.PRESET_LOADED.format(name="Monday, β = 0.4")
    qtbot.mouseClick(bar.delete, Qt.MouseButton.LeftButton)
    assert not file.exists()
    assert bar.name.count() == 0
    assert page.form.parameters() == expected, "the form keeps its values"


def test_a_preset_that_was_not_loaded_is_replaced_after_a_second_press_only(qtbot: QtBot, tmp_path: Path) -> None:
    file = _monday(tmp_path, "# by hand\nomega = [12.5]\n")
    page = _page(qtbot, tmp_path)
    page.choice.setCurrentText("harmonic")
    page.presets.name.setEditText("monday")
    qtbot.mouseClick(page.presets.save, Qt.MouseButton.LeftButton)
    assert "# by hand" in file.read_text(encoding="utf-8")
    assert page.presets.message.text() == texts.PRESET_EXISTS.format(name="monday")
    page.presets.name.setEditText("Monday")
    qtbot.mouseClick(page.presets.save, Qt.MouseButton.LeftButton)
    assert "# by hand" in file.read_text(encoding="utf-8")
    qtbot.mouseClick(page.presets.save, Qt.MouseButton.LeftButton)
    assert "# by hand" not in file.read_text(encoding="utf-8")


def test_a_name_in_another_case_deletes_the_preset_that_it_shows(qtbot: QtBot, tmp_path: Path) -> None:
    file = _monday(tmp_path, "omega = [12.5]\n")
    page = _page(qtbot, tmp_path)
    page.choice.setCurrentText("harmonic")
    page.presets.name.setEditText("monday")
    qtbot.mouseClick(page.presets.delete, Qt.MouseButton.LeftButton)
    assert page.presets.message.text() == texts.PRESET_DELETED.format(name="Monday")
    assert not file.exists()


def test_a_preset_that_cannot_be_read_is_not_replaced_at_the_first_press(qtbot: QtBot, tmp_path: Path) -> None:
    file = _monday(tmp_path, "omega = [12.5")
    page = _page(qtbot, tmp_path)
    page.choice.setCurrentText("harmonic")
    page.presets.name.setCurrentIndex(0)
    page.presets.name.activated.emit(0)
    assert "not valid TOML" in page.presets.message.text()
    qtbot.mouseClick(page.presets.save, Qt.MouseButton.LeftButton)
    assert file.read_text(encoding="utf-8") == "omega = [12.5"


def test_values_that_no_longer_hold_are_shown_with_the_reason(qtbot: QtBot, tmp_path: Path) -> None:
    folder = tmp_path / "presets" / "free-vibration"
    folder.mkdir(parents=True)
    (folder / "old.toml").write_text('drift = 5.0\nexcitation = "hammer"\nrepeats = [1, 2]\npushes = 3\n', "utf-8")
    page = _page(qtbot, tmp_path)
    page.choice.setCurrentText("free-vibration")
    page.presets.name.setCurrentIndex(0)
    page.presets.name.activated.emit(0)
    form = page.form
    assert form.refused
    choice = form.fields["excitation"]
    assert isinstance(choice, QComboBox)
    assert (_line(form, "drift").text(), choice.currentText()) == ("5", "hammer")
    for name in ("drift", "excitation", "repeats"):
        assert not form.errors[name].isHidden(), name
    assert "pushes = 3" in page.presets.message.text()
    assert page.presets.message.property("level") == "alarm"
    assert page.presets.save.toolTip() == texts.START_BAD
    assert not page.start.isEnabled()


@pytest.mark.parametrize("entry", PROTOCOLS, ids=[each.name for each in PROTOCOLS])
def test_every_form_is_saved_as_typed(entry: Protocol[Any], qtbot: QtBot, tmp_path: Path) -> None:
    """What was typed comes back from the file, and the file is one of the command line if the form is valid."""
    form = Form(entry.parameters)
    qtbot.addWidget(form)
    for field in form.fields.values():
        if isinstance(field, QCheckBox):
            field.toggle()
    presets = Presets(tmp_path)
    path = presets.save(entry, "all", form.typed())
    again = Form(entry.parameters, presets.load(entry.name, "all"))
    qtbot.addWidget(again)
    assert again.typed() == form.typed()
    assert again.unknown == {}
    if not form.refused:
        assert parameters_from(entry.parameters, {}, path) == form.parameters()


@pytest.mark.parametrize(
    "text", ["16", "-0.25", "1e-3", "60 mm", "2.5Hz", 'say "no"\\', "0x10", "true", "1979-05-27", "a; b", "β", "0,25"]
)
def test_a_typed_text_is_kept_as_it_is(tmp_path: Path, text: str) -> None:
    path = Presets(tmp_path).save(load_protocol("harmonic"), "x", {"value": text})
    value = tomllib.loads(path.read_text(encoding="utf-8"))["value"]
    assert value == text if isinstance(value, str) else value == float(text)


@pytest.mark.parametrize("name", ["", " a", "../a", "a/b", "a\\b", ".a", "a.", "a:b", "x" * 61, LAST + "/x"])
def test_a_name_that_is_no_file_name_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidInput, match="preset"):
        Presets(tmp_path).save(load_protocol("harmonic"), name, {})
    assert not list(tmp_path.rglob("*"))


@pytest.mark.parametrize("name", ["CON", "nul", "Aux", "prn", "COM1", "lpt9", "com¹", "con.x", "NUL .a", "Com7.b.c"])
def test_a_device_of_windows_is_refused_as_a_name(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        Presets(tmp_path).save(load_protocol("harmonic"), name, {})
    assert str(refused.value).startswith(f"preset = {name!r} is refused: Windows reserves this name for a device; ")
    assert not list(tmp_path.rglob("*"))
    # the remedy that the message gives, and names that only resemble a device
    for good in (f"preset {name}", "console", "COM0", "com10", "LPT", "a.con"):
        assert Presets(tmp_path).save(load_protocol("harmonic"), good, {}).is_file()


@pytest.mark.parametrize("name", ["Monday.", "Monday ", "a. "])
def test_a_name_that_windows_would_shorten_is_refused_with_the_remedy(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidInput, match=r"dot or space at the end of a name; omit it") as refused:
        Presets(tmp_path).save(load_protocol("harmonic"), name, {})
    assert repr(name) in str(refused.value)


def test_a_damaged_file_is_reported_and_changes_nothing(qtbot: QtBot, tmp_path: Path) -> None:
    folder = tmp_path / "presets" / LAST
    folder.mkdir(parents=True)
    (folder / "harmonic.toml").write_text("omega = [", "utf-8")
    page = _page(qtbot, tmp_path)
    page.choice.setCurrentText("harmonic")
    assert page.form.parameters() == page.entry.parameters()
    qtbot.mouseClick(page.presets.last_values, Qt.MouseButton.LeftButton)
    assert "not valid TOML" in page.presets.message.text()
    assert page.form.parameters() == page.entry.parameters()


def test_recent_configurations_are_listed_and_opened(qtbot: QtBot, tmp_path: Path) -> None:
    paths = [tmp_path / f"bench-{name}.toml" for name in ("a", "b")]
    for path in paths:
        write_template(path, "minimal")
    first = _setup(qtbot, tmp_path)
    assert first.recent.isHidden()
    for path in paths:
        first.open_configuration(path)
    setup = _setup(qtbot, tmp_path)
    assert setup.recent.paths == [*reversed(paths)]
    assert setup.path is None
    setup.recent.activated.emit(1)
    assert setup.path == paths[0]
    assert setup.recent.paths == paths
    paths[1].unlink()
    setup.recent.activated.emit(1)
    assert "there is no such file" in setup.source.text()
    assert setup.path == paths[0]
