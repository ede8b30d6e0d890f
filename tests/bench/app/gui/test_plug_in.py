"""The example protocol of docs/extending.md in the window: form, check of the plan, run, live number."""

import json
from collections.abc import Generator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from bench.app.catalogue import load_protocol
from bench.app.display.theme import LIGHT
from bench.app.formatting import measurement
from bench.app.gui.controller import Controller
from bench.app.gui.window import Window
from tests.bench.app.gui.shared_window import PROTOCOLS, undressed
from tests.bench.app.ipc.experiment import bench
from tests.installed import example
from tests.patience import LONG_MS


@pytest.fixture
def window(qtbot: QtBot, tmp_path: Path) -> Generator[Window]:
    """The window with the protocols of the project and the installed one, which its sessions find as well."""
    with example(tmp_path / "site", "tone_sweep"):
        entries = (*PROTOCOLS, load_protocol("tone-sweep"))
        with undressed():
            # the small bench rests soon and ramps fast
            shown = Window(Controller(), bench(), entries, LIGHT)
        qtbot.addWidget(shown)
        shown.show()
        yield shown
        shown.leave()


@pytest.mark.usefixtures("forked")
def test_its_form_its_run_and_its_live_number(window: Window, qtbot: QtBot, tmp_path: Path) -> None:
    page, run = window.protocol, window.run
    page.choice.setCurrentText("tone-sweep")
    assert list(page.form.fields) == ["omega", "volts", "cycles"]
    assert page.form.parameters().model_dump() == {"omega": (10.0, 20.0, 40.0), "volts": 0.05, "cycles": 8}
    for name, text in {"omega": "40", "volts": "0.1", "cycles": "4"}.items():
        field = page.form.fields[name]
        assert isinstance(field, QLineEdit)
        assert field.isVisible()
        field.setText(text)
    page.folder.setText(str(tmp_path / "run"))
    # paced by the clock, so that the number stands while the drive is taken back
    page.realtime.setChecked(True)
    page.person.setChecked(False)
    page.check_plan()
    qtbot.waitUntil(page.start.isEnabled, timeout=LONG_MS)
    qtbot.mouseClick(page.start, Qt.MouseButton.LeftButton)

    def measured() -> bool:
        return run.verdict.isVisible() and run.verdict.sentence.startswith("gain of the table")

    qtbot.waitUntil(measured, timeout=LONG_MS)
    assert window.pages.currentWidget() is run
    assert window.header.word.text() == "RUNNING"
    shown, predicted, _difference = run.verdict.sentence.split(" · ")
    (plot,) = run.live.shown
    # it is drawn at the next tick after its message
    qtbot.waitUntil(lambda: not plot.figure.notice, timeout=LONG_MS)
    expected, drawn = plot.figure.curves
    qtbot.waitUntil(lambda: window.pages.currentWidget() is window.results, timeout=LONG_MS)
    summary = json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))
    (point,) = summary["points"]
    gain = measurement(point["gain_m_s2_v"], point["gain_uncertainty"], "m/s²/V")
    assert shown == f"gain of the table  {gain}"
    assert (drawn.name, drawn.x.tolist(), drawn.y.tolist()) == ("measured", [40.0], [point["gain_m_s2_v"]])
    assert (expected.name, plot.figure.x_label, plot.figure.y_label) == ("predicted", "ω [rad/s]", "gain [m/s²/V]")
    assert predicted.startswith("predicted ")
