"""The form says what the declaration says; nothing starts before its plan was checked."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication, QLabel, QLineEdit, QTableWidgetItem, QWidget
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.display.typography import typeset
from bench.app.gui.form import Form
from bench.app.gui.window import Window
from bench.app.ipc.messages import Ended, PlanChecked, Refused, Run
from bench.config.declared import declared
from bench.preflight.margins import Demand, Margin, bounds
from bench.protocol import Protocol
from protocols.harmonic.protocol import HarmonicParameters
from sim.errors import Cause, InvalidInput
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.gui.shared_window import PROTOCOLS
from tests.bench.app.ipc.experiment import bench
from tests.patience import LONG_MS

pytestmark = pytest.mark.usefixtures("without_plots")

FINE = PlanChecked((), None, (), 60.0, 1e6, 1e9, "hash", {})


def _type(field: object, text: str) -> None:
    assert isinstance(field, QLineEdit)
    field.setText(text)


@pytest.mark.parametrize("entry", PROTOCOLS, ids=lambda entry: entry.name)
def test_an_untouched_form_is_the_defaults(entry: Protocol[Any], qtbot: QtBot) -> None:
    form = Form(entry.parameters)
    qtbot.addWidget(form)
    values = [each for each in declared(entry.parameters) if each.group is None]
    assert list(form.fields) == [each.name for each in values]
    for each in values:
        tip = form.fields[each.name].toolTip()
        assert typeset(each.description)[1:] in tip
        assert typeset(each.allowed) in tip
    try:
        expected = entry.parameters()
    except ValueError:
        # something is required, and the form says so beside it
        assert form.refused
        assert any(not label.isHidden() for label in form.errors.values())
    else:
        assert form.parameters() == expected


def test_what_is_typed_is_what_is_asked(qtbot: QtBot) -> None:
    form = Form(HarmonicParameters)
    qtbot.addWidget(form)
    _type(form.fields["omega"], "12.5 16:18:2")
    _type(form.fields["ramp_time"], "4")
    _type(form.fields["starts"], "")
    assert form.parameters() == HarmonicParameters(omega=(12.5, 16.0, 18.0), ramp_time=4.0)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("omega", "16 99", "at most 40"),
        ("omega", "12,5 16", "write 12.5; separate values by spaces"),
        ("omega", "12.5, 16", "separate values by spaces"),
        ("harmonics", "2.5", "whole number"),
        ("ramp_time", "soon", "a number"),
        ("ramp_time", "4 mm", "not have the dimension of s"),
    ],
)
def test_a_refused_value_stays_as_typed_and_says_why(name: str, text: str, said: str, qtbot: QtBot) -> None:
    form = Form(HarmonicParameters)
    qtbot.addWidget(form)
    _type(form.fields[name], text)
    field = form.fields[name]
    assert isinstance(field, QLineEdit)
    assert field.text() == text
    assert said in form.errors[name].text()
    assert [each for each, label in form.errors.items() if not label.isHidden()] == [name]
    with pytest.raises(InvalidInput):
        form.parameters()


def test_start_follows_the_check(window: Window, spoken: type[ScriptedClient], qtbot: QtBot) -> None:
    page = window.protocol
    assert (page.start.isEnabled(), page.start.toolTip()) == (False, texts.START_UNCHECKED)
    qtbot.mouseClick(page.check, Qt.MouseButton.LeftButton)
    spoken.latest.said.append(FINE)
    window._controller._look()
    assert page.start.isEnabled()
    _type(page.form.fields["cycles"], "7")
    assert (page.start.isEnabled(), page.start.toolTip()) == (False, texts.START_UNCHECKED)
    _type(page.form.fields["cycles"], "many")
    assert page.start.toolTip() == texts.START_BAD
    _type(page.form.fields["cycles"], "7")
    page.check_plan()
    spoken.latest.said.append(FINE)
    window._controller._look()
    page.keep_going.setChecked(True)
    page.operator.setText("A. Person")
    page.begin()
    run = spoken.latest.assignment
    assert isinstance(run, Run)
    assert run.parameters.model_dump()["cycles"] == 7
    assert (run.keep_going, run.about) == (True, {"operator": "A. Person"})
    assert window.pages.currentWidget() is window.run
    assert page.why_not == texts.START_BUSY


@pytest.mark.parametrize(("typed", "left"), [(None, ""), ("runs/next", "runs/next")])
def test_the_folder_of_the_next_run_is_kept_when_a_run_ends(
    typed: str | None, left: str, window: Window, spoken: type[ScriptedClient], tmp_path: Path
) -> None:
    page = window.protocol
    page.folder.setText(str(tmp_path / "first"))
    page.check_plan()
    spoken.latest.said.append(FINE)
    window._controller._look()
    page.begin()
    if typed is not None:
        page.folder.setText(typed)
    spoken.latest.said.append(Ended("completed", "", {}, "", tmp_path / "first"))
    window._controller._look()
    assert page.folder.text() == left


def test_a_plan_checked_during_a_run_stays_checked_when_the_run_ends(
    window: Window, spoken: type[ScriptedClient], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    page = window.protocol
    page.folder.clear()

    def check() -> None:
        page.check_plan()
        spoken.latest.said.append(replace(FINE))
        window._controller._look()

    check()
    page.begin()
    run = spoken.latest
    field = next(each for each in page.form.fields.values() if isinstance(each, QLineEdit))
    field.setText(field.text() + " ")
    check()
    run.said.append(Ended("completed", "", {}, "", tmp_path / "first"))
    window._controller._look()
    assert page.start.isEnabled()
    # but a plan that was carried out is checked again
    page.begin()
    spoken.latest.said.append(Ended("completed", "", {}, "", tmp_path / "second"))
    window._controller._look()
    assert not page.start.isEnabled()


@pytest.mark.parametrize("left", [(), ("campaign.h5",)])
def test_a_folder_that_another_program_made_meanwhile_is_left_to_it(
    left: tuple[str, ...],
    window: Window,
    spoken: type[ScriptedClient],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    page = window.protocol
    page.folder.clear()
    shown = Path(page.folder.placeholderText())
    page.check_plan()
    spoken.latest.said.append(FINE)
    window._controller._look()
    shown.mkdir(parents=True)
    for name in left:
        (shown / name).touch()
    page.begin()
    run = spoken.latest.assignment
    assert isinstance(run, Run)
    assert run.out == shown.with_name(f"{shown.name}-2")
    assert run.out.is_dir()
    for name in left:
        (run.out / name).touch()
    spoken.latest.said.append(Refused("not now"))
    window._controller._look()
    # what holds nothing is removed again, the other program's folder stays
    assert run.out.exists() == bool(left)
    assert shown.is_dir()


@pytest.mark.parametrize(
    "found",
    [
        PlanChecked((), "limits.drift = 0.08 is refused: too near", (), None, None, None, "", {}),
        Refused("limits.drift = 0.08 is refused: too near", Cause("invalid_input", "limits.drift")),
    ],
)
def test_a_refused_plan_says_why_and_does_not_start(
    found: PlanChecked | Refused, window: Window, spoken: type[ScriptedClient]
) -> None:
    page = window.protocol
    page.check_plan()
    spoken.latest.said.append(found)
    window._controller._look()
    assert "limits.drift = 0.08 is refused" in page.plan.verdict.text()
    assert not page.start.isEnabled()
    page.begin()
    assert not window._controller.running


@pytest.mark.usefixtures("spoken")
def test_results_are_never_overwritten(window: Window) -> None:
    page = window.protocol
    folder = Path(page.folder.text())
    folder.mkdir()
    (folder / "campaign.h5").touch()
    page.check_plan()
    assert "never overwritten" in page.plan.verdict.text()
    assert not window._controller.running


def test_what_the_plan_says_is_not_cut_off(window: Window, spoken: type[ScriptedClient], qtbot: QtBot) -> None:
    page = window.protocol
    window.resize(window.minimumSize())
    page.check_plan()
    warnings = tuple(
        f"with a specimen at the 95 % of its uncertainty limit {k} would be exceeded" * 2 for k in range(3)
    )
    spoken.latest.said.append(PlanChecked((), None, warnings, 60.0, 1e6, 1e9, "hash", {}))
    window._controller._look()
    for label in (page.plan.verdict, page.plan.details):
        qtbot.waitUntil(lambda label=label: label.height() >= label.heightForWidth(label.width()), timeout=LONG_MS)


def test_the_margin_shown_is_the_one_that_95_percent_of_the_specimens_keep(
    window: Window, spoken: type[ScriptedClient]
) -> None:
    page, bound = window.protocol, bounds(bench())
    wide = Margin(bound["drift"], Demand("drift", 0.675 * bound["drift"].limit, 0.92 * bound["drift"].limit, "rocking"))
    tight = Margin(bound["force"], Demand("force", 0.8 * bound["force"].limit, None, "rocking"))
    page.check_plan()
    spoken.latest.said.append(PlanChecked((tight, wide), None, (), 60.0, 1e6, 1e9, "hash", {}))
    window._controller._look()
    table = page.plan.table
    cells = [[item.text() for column in range(7) if (item := table.item(row, column))] for row in range(2)]
    assert [row[5] for row in cells] == ["8.0", "20.0"]
    assert cells[0][0] == "drift"
    assert "32.5" in (table.item(0, 5) or QTableWidgetItem()).toolTip()
    assert "drift" in page.plan.details.text()


def test_the_wheel_over_the_list_changes_nothing_and_typed_values_stay(window: Window) -> None:
    page = window.protocol
    page.choice.setCurrentText("harmonic")
    field = page.form.fields["omega"]
    assert isinstance(field, QLineEdit)
    field.setText("17.25")
    at = QPointF(5, 5)
    turn = QWheelEvent(
        at, at, QPoint(), QPoint(0, -120), Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(page.choice, turn)
    assert page.choice.currentText() == "harmonic"
    page.choice.setCurrentText("earthquake")
    page.choice.setCurrentText("harmonic")
    again = page.form.fields["omega"]
    assert isinstance(again, QLineEdit)
    assert again.text() == "17.25"


def test_the_first_value_follows_the_protocol_in_the_tab_order(window: Window) -> None:
    page = window.protocol
    page.choice.setCurrentText("harmonic")
    order, widget = list[QWidget](), page.choice.nextInFocusChain()
    while widget is not page.choice and len(order) < 500:
        if widget.focusPolicy() & Qt.FocusPolicy.TabFocus:
            order.append(widget)
        widget = widget.nextInFocusChain()
    fields = list(page.form.fields.values())
    assert order[: len(fields)] == fields


def test_units_and_symbols_are_printed(window: Window) -> None:
    page = window.protocol
    page.choice.setCurrentText("harmonic")
    names = [label.text() for label in page.form.findChildren(QLabel)]
    assert "ω [rad/s]" in names
    assert not [name for name in names if "_" in name or "m/s2" in name]
