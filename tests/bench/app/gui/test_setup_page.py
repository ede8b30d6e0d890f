"""The configuration as it is in its file, the devices as `rockbench devices` lists them, the check line by line."""

import sys
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QTreeWidgetItem
from pytestqt.qtbot import QtBot

from bench.analysis.check_line import CheckLine, judged, stated
from bench.app.catalogue import load_protocol
from bench.app.display import texts
from bench.app.display.typography import typeset
from bench.app.gui.configuration_tree import KEY, ConfigurationTree
from bench.app.gui.window import Window
from bench.app.ipc.messages import Ended, Published, Run
from bench.config.model import BenchConfiguration
from bench.config.result_files import write_specimen
from bench.config.template import as_toml, write_template
from bench.document.typography import unit_text
from bench.events import PointFinished
from sim.identified import Finding, Identified
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.ipc.experiment import bench, order
from tests.patience import LONG_MS

pytestmark = pytest.mark.usefixtures("without_plots")

HARDWARE = """
backend = "hardware"
[limits]
drift = 0.05
"""


def _leaves(tree: ConfigurationTree) -> list[QTreeWidgetItem]:
    waiting = [tree.topLevelItem(k) for k in range(tree.topLevelItemCount())]
    found: list[QTreeWidgetItem] = []
    while waiting:
        item = waiting.pop()
        assert item is not None
        waiting += [item.child(k) for k in range(item.childCount())]
        if not item.childCount():
            found.append(item)
    return found


def test_every_key_of_the_configuration_is_in_the_tree_with_its_unit(qtbot: QtBot, tmp_path: Path) -> None:
    """Against the commented file, which is written by other code: each key, its unit and its meaning."""
    tree = ConfigurationTree()
    qtbot.addWidget(tree)
    tree.use(BenchConfiguration(backend="simulated"))
    write_template(tmp_path / "bench.toml")
    lines = (tmp_path / "bench.toml").read_text(encoding="utf-8").splitlines()
    shown = [(str(item.data(0, KEY)), item) for item in _leaves(tree)]
    assert len(shown) > 60
    for name, item in shown:
        meaning = [above for above, line in pairwise(lines) if line.lstrip("# ").startswith(f"{name} = ")]
        meaning += [line for line in lines if line.startswith(f"# {name}, not to be set here: ")]
        if any(line.startswith(f"# {name}: ") for line in lines):
            # a group that is absent
            assert (item.text(1), item.text(2)) == ("-", ""), name
            continue
        assert meaning, name
        unit = item.text(2)
        assert any(f"[{unit}]" in unit_text(each) for each in meaning) or not unit, name
        told = item.toolTip(1).partition("\n")[0]
        assert any(typeset(told[1:]) in typeset(each) for each in meaning), name


def test_values_are_those_of_the_bench_and_what_was_changed_is_bold(qtbot: QtBot) -> None:
    tree = ConfigurationTree()
    qtbot.addWidget(tree)
    tree.use(bench())
    assert tree.value("acquisition", "block_duration") == "0.05 s"
    assert tree.value("limits", "late") == "5 s"
    with pytest.raises(KeyError):
        tree.value("hardware", "sample_rate")
    bold = {item.data(0, KEY) for item in _leaves(tree) if item.font(1).bold()}
    assert {"block_duration", "late"} <= bold
    assert "laser_range" not in bold


def test_another_configuration_is_opened_and_a_refused_one_keeps_the_old(
    window: Window, qtbot: QtBot, tmp_path: Path
) -> None:
    page, good, bad = window.setup, tmp_path / "real.toml", tmp_path / "bad.toml"
    good.write_text(HARDWARE, encoding="utf-8")
    bad.write_text(HARDWARE.replace("0.05", "-1"), encoding="utf-8")
    window.pages.setCurrentWidget(page)
    qtbot.mouseClick(page.open_file, Qt.MouseButton.LeftButton)
    dialog = page.findChild(QFileDialog)
    assert isinstance(dialog, QFileDialog)
    dialog.setDirectory(str(tmp_path))
    dialog.selectFile(str(good))
    dialog.accept()
    assert not dialog.isVisible()
    assert (page.configuration.backend, page.configuration.limits.drift) == ("hardware", 0.05)
    assert page.tree.value("limits", "drift") == "0.05 m"
    assert str(good) in page.source.text()
    assert "real.toml" in window.windowTitle()
    assert window.protocol.person.isChecked()
    assert not window.protocol.realtime.isEnabled()
    shown = as_toml(page.configuration)
    page.open_configuration(bad)
    assert "bad.toml: limits.drift = -1 is refused" in page.source.text()
    assert "stays" in page.source.text()
    assert f"{texts.CONFIGURATION}: {good}" in page.source.text()
    assert as_toml(page.configuration) == shown
    assert page.path == good
    window.protocol.check_plan()


def test_a_specimen_file_goes_before_what_is_assumed(window: Window, tmp_path: Path) -> None:
    page, path = window.setup, tmp_path / "specimen.json"
    found = Finding(name="k1", value=201.5, standard_uncertainty=1.5, source="free vibration", date=datetime.now(UTC))
    write_specimen(path, Identified(findings=(found,)))
    page.open_identified(path)
    assert page.configuration.known_specimen.frame.k1 == 201.5
    assert page.tree.value("identified", "findings", "1", "name") == "k1"
    assert str(path) in page.source.text()
    page.open_identified(tmp_path / "absent.json")
    assert "there is no such file" in page.source.text()
    assert page.configuration.known_specimen.frame.k1 == 201.5


@pytest.mark.usefixtures("spoken")
def test_nothing_of_the_bench_is_changed_while_a_run_is_under_way(window: Window) -> None:
    page = window.setup
    window._controller.start(order(Path("never")))
    for button in (page.open_file, page.open_specimen, page.devices.ask, page.loop.check):
        assert not button.isEnabled()
        assert button.toolTip() == texts.START_BUSY
    window._controller.press_stop()
    assert page.loop.check.toolTip() == texts.START_BUSY


def test_devices_are_asked_for_by_the_command_and_the_window_goes_on(
    window: Window, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """With a stand-in for the interpreter that says how it was called."""
    called = tmp_path / "called.py"
    called.write_text(
        f"#!{sys.executable}\nimport sys\nprint('NI devices:', *sys.argv[1:])\nsys.exit('refused' in sys.argv[-1])\n"
    )
    called.chmod(0o755)
    monkeypatch.setattr("bench.app.gui.background.sys.executable", str(called))
    panel = window.setup.devices
    window.pages.setCurrentWidget(window.setup)
    assert "simulated bench has no devices" in panel.message.text()
    qtbot.mouseClick(panel.ask, Qt.MouseButton.LeftButton)
    assert panel.message.text() == texts.FINDING
    assert not panel.ask.isEnabled()
    qtbot.waitUntil(lambda: panel.message.text() == texts.FOUND, timeout=LONG_MS)
    assert panel.found.toPlainText() == "NI devices: -P -m bench devices"
    panel.use(window.setup.configuration, tmp_path / "refused")
    panel.look()
    qtbot.waitUntil(lambda: "search for devices failed" in panel.message.text(), timeout=LONG_MS)
    assert f"--config {tmp_path / 'refused'}" in panel.message.text()
    assert panel.ask.isEnabled()
    # another configuration is opened during a search
    panel.look()
    panel.use(window.setup.configuration, None)
    qtbot.waitUntil(panel.ask.isEnabled, timeout=LONG_MS)
    assert (panel.message.text(), panel.found.toPlainText()) == (texts.FIND_SIMULATED, "")


LINES = (
    judged("laser_1", "noise at rest", 2e-6, (1e-8, 8e-6), "m", ""),
    judged("table_acceleration", "scale", 1.2, (0.98, 1.02), "1", "see to its range", uncertainty=0.01),
    stated("force", "noise at rest", 0.25, "N"),
)


def _check(
    window: Window, spoken: type[ScriptedClient], qtbot: QtBot, lines: tuple[CheckLine, ...], status: str
) -> None:
    window.pages.setCurrentWidget(window.setup)
    qtbot.mouseClick(window.setup.loop.check, Qt.MouseButton.LeftButton)
    run = spoken.latest.assignment
    assert isinstance(run, Run)
    assert (run.protocol, run.parameters, run.person) == ("check", load_protocol("check").parameters(), False)
    spoken.latest.said = [Published(PointFinished(line, time=1.0)) for line in lines]
    window._controller._look()
    spoken.latest.said = [Ended(status, "told", {"points": []}, "", run.out)]
    window._controller._look()


def test_the_lines_of_the_check_come_with_their_verdicts(
    window: Window, spoken: type[ScriptedClient], qtbot: QtBot
) -> None:
    loop = window.setup.loop
    _check(window, spoken, qtbot, LINES, "completed")
    cells = [[loop.table.item(row, column).text() for column in range(6)] for row in range(3)]
    assert cells[0] == ["✓ passed", "laser 1", "noise at rest", "2e-06 m", "-", "1e-08 .. 8e-06"]
    assert cells[1] == ["▲ failed", "table acceleration", "scale", "1.2", "0.01", "0.98 .. 1.02"]
    assert cells[2][0] == "· stated"
    assert "1 passed, 1 failed, 1 without verdict" in loop.message.text()
    assert "table acceleration: see to its range" in loop.message.text()
    assert loop.message.property("level") == "alarm"
    assert window.pages.currentWidget() is window.setup, "whoever checks stays on the page"
    _check(window, spoken, qtbot, LINES[:1], "completed")
    assert loop.table.rowCount() == 1
    assert loop.message.property("level") == "good"


def test_a_check_that_was_cut_short_is_not_good(window: Window, spoken: type[ScriptedClient], qtbot: QtBot) -> None:
    _check(window, spoken, qtbot, LINES[:1], "aborted")
    assert texts.CHECK_CUT in window.setup.loop.message.text()
    assert window.setup.loop.message.property("level") == "alarm"
