"""Help on the parameter in the focus: its reference entry, the page, and that the page has it."""

import re
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QDesktopServices
from pytestqt.qtbot import QtBot

from bench.app.gui.help_panel import reference_page, reference_text
from bench.app.gui.window import Window
from bench.config.declared import declared
from bench.protocol import Protocol
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.gui.shared_window import PROTOCOLS

pytestmark = pytest.mark.usefixtures("without_plots", "spoken")


def test_f1_explains_the_field_in_the_focus_and_follows_it(
    window: Window, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = window.protocol
    page.choice.setCurrentText("harmonic")
    fields = page.form.fields
    fields["settle_tolerance"].setFocus()
    qtbot.keyClick(fields["settle_tolerance"], Qt.Key.Key_F1)
    assert page.help.isVisible()
    assert not page.plan.isVisible()
    assert page.help.title.text() == "harmonic: settle tolerance"
    assert "`--settle-tolerance`" in page.help.text.text()
    assert fields["settle_tolerance"].hasFocus()
    qtbot.keyClick(fields["settle_tolerance"], Qt.Key.Key_Tab)
    assert page.help.title.text() != "harmonic: settle tolerance"
    opened: list[QUrl] = []
    monkeypatch.setattr(QDesktopServices, "openUrl", opened.append)
    qtbot.mouseClick(page.help.open_page, Qt.MouseButton.LeftButton)
    assert [(Path(each.toLocalFile()).is_file(), each.fragment()) for each in opened] == [
        (True, "parameters-of-harmonic")
    ]
    qtbot.mouseClick(page.help.close_help, Qt.MouseButton.LeftButton)
    assert page.plan.isVisible()
    assert not page.help.isVisible()


def test_a_check_shows_its_plan_instead_of_the_help(window: Window, spoken: type[ScriptedClient]) -> None:
    page = window.protocol
    page.choice.setCurrentText("harmonic")
    page.explain()
    assert page.help.title.text() == "harmonic: ω", "the first one, as no field has the focus"
    page.check_plan()
    assert page.plan.isVisible()
    assert spoken.latest.assignment.protocol == "harmonic"


@pytest.mark.parametrize("entry", PROTOCOLS, ids=[each.name for each in PROTOCOLS])
def test_the_page_has_every_parameter_with_the_words_of_the_help(entry: Protocol[Any]) -> None:
    """Against the generated page, which other code writes."""
    _, address = reference_page(entry.name)
    assert address is not None
    page = (Path(__file__).parents[4] / "docs" / "reference" / "protocols.md").read_text(encoding="utf-8")
    heading = f"### Parameters of {entry.name}\n"
    assert re.sub(r"\W+", "-", heading.strip("# \n").lower()) == address.fragment()
    section = page.split(heading)[1].split("\n#")[0]
    for each in declared(entry.parameters):
        assert f"`{each.name}`" in section
        assert each.description.split("|")[0] in section
        assert len(reference_text(each)) >= 3


def test_without_pages_the_help_names_the_page(tmp_path: Path) -> None:
    assert reference_page("check", tmp_path) == ("docs/reference/protocols.md#parameters-of-check", None)
    built = tmp_path / "site" / "reference" / "protocols" / "index.html"
    built.parent.mkdir(parents=True)
    built.touch()
    page, address = reference_page("check", tmp_path)
    assert page == f"{built}#parameters-of-check"
    assert address is not None
    assert address.toLocalFile() == built.as_posix()
