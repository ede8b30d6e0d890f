"""Every page of the window shows printed names, symbols and units, with every protocol and its recorded results."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from bench.app.catalogue import installed_protocol, parameters_of
from bench.app.display import texts
from bench.app.display.theme import LIGHT
from bench.app.gui.controller import Controller
from bench.app.gui.help_panel import reference_text
from bench.app.gui.panels import TASKS, UNKNOWN_TASK
from bench.app.gui.window import Window
from bench.app.ipc.messages import PlanChecked, Run
from bench.app.preflight import compile_run
from bench.app.queue.queue import Stage, queued
from bench.app.run_display import Notice
from bench.config.declared import declared
from bench.config.model import BenchConfiguration
from bench.config.toml import read_configuration
from bench.config.validation import validated
from bench.datafile.reader import DataFile, open_datafile
from bench.events import PointFinished
from bench.protocol import Protocol
from bench.replay.session import stored_configuration
from tests.bench.app.gui.run_files import show
from tests.bench.app.gui.shared_window import PROTOCOLS, undressed
from tests.bench.app.gui.visible_text import painted_texts, widget_texts
from tests.first_edition.command import DATA, unpack
from tests.test_visible_text import RUNS
from tests.visible_text import faults

pytestmark = pytest.mark.usefixtures("shared_results")

QUICK = {"check", "free_vibration", "coupling_stiffness", "laser_calibration", "free_rocking", "identify"}
"""Runs whose plan is computed in a moment."""


@pytest.fixture(scope="module")
def shown(qapp: QApplication) -> Iterator[Window]:  # noqa: ARG001 - Qt needs its application
    """One window for all tests, which it takes a second to build."""
    controller = Controller()
    with undressed():
        window = Window(controller, BenchConfiguration(), PROTOCOLS, LIGHT, tour=True)
    window.resize(1280, 720)
    window.show()
    yield window
    window.leave()


def _faults(part: QWidget, patch: pytest.MonkeyPatch) -> list[str]:
    QApplication.processEvents()
    found = [*widget_texts(part), *painted_texts(part, patch)]
    assert found
    return faults(found)


def _constants(value: object) -> Iterator[tuple[str, str]]:
    if isinstance(value, str):
        yield "texts", value
    elif isinstance(value, dict | tuple):
        for each in value.values() if isinstance(value, dict) else value:
            yield from _constants(each)


def test_the_texts_of_the_window_are_printed() -> None:
    """Those that no page shows at present too."""
    constants = {name: value for name, value in vars(texts).items() if name.isupper()}
    assert len(constants) > 200
    assert not faults(_constants(constants))
    assert not faults(_constants({"tasks": tuple(TASKS.values()), "unknown": UNKNOWN_TASK}))


@pytest.mark.parametrize("name", ["", "every_key.toml", "emulated.toml"])
def test_the_setup_page(shown: Window, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """Of the simulated bench, of a file with every key, and of the hardware."""
    shown.pages.setCurrentWidget(shown.setup)
    if name:
        shown.setup.open_configuration(DATA / name)
        assert shown.setup.configuration == read_configuration(DATA / name)
    assert not _faults(shown, monkeypatch)


@pytest.mark.parametrize("protocol", PROTOCOLS, ids=[each.name for each in PROTOCOLS])
def test_the_form_of_every_protocol_and_its_test_in_the_queue(
    shown: Window, monkeypatch: pytest.MonkeyPatch, protocol: Protocol[Any]
) -> None:
    page = shown.protocol
    shown.pages.setCurrentWidget(page)
    page.choice.setCurrentText(protocol.name)
    page.explain()
    assert not _faults(page, monkeypatch)
    assert not faults(("help", text) for each in declared(protocol.parameters) for text in reference_text(each))
    for field in page.form.fields.values():
        if hasattr(field, "setText"):
            # every value is refused, with its reason
            field.setText("-")
    assert page.form.refused
    assert not _faults(page, monkeypatch)
    test = queued(protocol, protocol.parameters(), Path("runs", "test"), realtime=True)
    shown.runner.queue.add(test.model_copy(update={"stage": Stage.FAILED, "outcome": "aborted: drift 0.081 m exceeds"}))
    shown.runner.changed.emit()
    shown.pages.setCurrentWidget(shown.queue)
    assert not _faults(shown.queue, monkeypatch)


@pytest.mark.parametrize("name", RUNS)
def test_the_results_of_every_protocol(
    shown: Window, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str
) -> None:
    # the name of a folder is shown as it was typed
    (tmp_path / "monday").mkdir()
    path = unpack(name, tmp_path / "monday").rename(tmp_path / "monday" / "campaign.h5")
    results = shown.results
    shown.pages.setCurrentWidget(results)
    show(results, path)
    for everything in (True, False):
        results.everything.setChecked(everything)
        for place in range(results.parts.count()):
            results.parts.setCurrentIndex(place)
        assert not _faults(results, monkeypatch)
    with open_datafile(path) as record:
        _play(shown, record)
        assert not _faults(shown.run, monkeypatch)
        assert not _faults(shown.header, monkeypatch)
        if name in QUICK:
            _check_plan(shown, record)
            assert not _faults(shown.protocol, monkeypatch)


def _play(window: Window, record: DataFile) -> None:
    """What the run page was told in a recorded run: its journal, fits and points."""
    controller, protocol = window._controller, installed_protocol(record)
    assert protocol is not None
    parameters = parameters_of(record, protocol)
    window.pages.setCurrentWidget(window.run)
    controller.began.emit(Run(protocol.name, parameters, stored_configuration(record), Path("runs", "played")))
    for entry in record.events:
        controller.noticed.emit(Notice(entry.time, entry.kind, entry.text))
    for fit in record.fits:
        controller.event_received.emit(fit)
    for row in record.points:
        point = validated(protocol.point, {name: value for name, value in row.items() if value == value})
        controller.event_received.emit(PointFinished(point, time=1.0))
    window.pages.setCurrentWidget(window.run)
    window.run._draw()
    assert window.run.log.toPlainText().count("\n") > 5


def _check_plan(window: Window, record: DataFile) -> None:
    """The plan of the recorded run, as a session computes it."""
    protocol = installed_protocol(record)
    assert protocol is not None
    prepared = protocol.prepare(parameters_of(record, protocol), stored_configuration(record), record.tables)
    found = compile_run(protocol.name, prepared, Path())
    window.protocol.plan.show_plan(
        PlanChecked(found.margins, None, found.warnings, 60.0, 1e6, 1e9, found.plan_hash, prepared.prediction)
    )
    window.pages.setCurrentWidget(window.protocol)


def test_the_texts_of_plots_are_read(qtbot: QtBot, shown: Window) -> None:
    """Those of axes and of paintings, which no widget has."""
    found = {text for _, text in widget_texts(shown.run)}
    assert any("Hz" in text for text in found)
    assert any("drift" in text for text in found)
    with pytest.MonkeyPatch.context() as patch:
        assert painted_texts(shown.run, patch)
    qtbot.addWidget(view := QWidget())
    assert not list(widget_texts(view))
