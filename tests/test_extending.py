"""The examples of docs/extending.md, each in a package of its own beside the project, used as their readers would."""

import json
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Generator
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from bench.catalogue import PROTOCOLS, all_protocols, load_format, load_protocol
from bench.cli.main import main
from bench.cli.scene import Scene
from bench.config.declared import declared
from bench.events import LiveValue
from bench.record.reader import open_record
from tests.installed import installed

PLUGINS = Path(__file__).parent / "plugins"
SWEEP = PLUGINS / "tone_sweep" / "tone_sweep.py"
Said = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def plugged(tmp_path_factory: pytest.TempPathFactory) -> Generator[None]:
    """The package of the example protocol, as an installer leaves it."""
    folder = tmp_path_factory.mktemp("plugin") / "site"
    folder.mkdir()
    shutil.copy(SWEEP, folder)
    project = tomllib.loads((SWEEP.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    with installed(folder, project["name"], project["entry-points"]):
        yield


@pytest.fixture(scope="module")
def done(plugged: None, tmp_path_factory: pytest.TempPathFactory) -> Path:  # noqa: ARG001
    """The folder of a run."""
    folder = tmp_path_factory.mktemp("sweep") / "run"
    assert main(["run", "tone-sweep", "--omega", "10", "40", "--volts", "0.1", "--out", str(folder)]) == 0
    return folder


def test_the_example_is_one_file_of_at_most_120_lines() -> None:
    assert len(SWEEP.read_text(encoding="utf-8").splitlines()) <= 120


@pytest.mark.usefixtures("plugged")
def test_its_flags_and_its_form_come_from_the_declaration(capsys: Said) -> None:
    assert main(["run", "tone-sweep", "--help"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    for text in ("Gain of the table at a few frequencies.", "--omega", "Amplitude of the drive", "[default: 0.05 V]"):
        assert text in shown
    assert main(["run", "--help"]) == 0
    assert "tone-sweep" in capsys.readouterr().out
    # what the window makes a line of its form from
    assert [entry.name for entry in declared(load_protocol("tone-sweep").parameters)] == ["omega", "volts", "cycles"]
    assert main(["run", "tone-sweep", "--volts", "9"]) == 2
    assert "--volts = 9" in capsys.readouterr().err


@pytest.mark.usefixtures("plugged")
def test_its_dry_run_has_margins(capsys: Said, tmp_path: Path) -> None:
    out = str(tmp_path / "run")
    assert main(["run", "tone-sweep", "--volts", "0.1", "--dry-run", "--json", "--out", out]) == 0
    plan = json.loads(capsys.readouterr().out)
    by_name = {each["quantity"]: each for each in plan["margins"]}
    # a hundred millivolts, and what friction takes besides
    assert 0.1 <= by_name["drive_voltage"]["demand"] < 0.12
    assert by_name["acceleration"]["margin"] > 0.9
    (tmp_path / "tight.toml").write_text("[limits]\nacceleration = 0.1\n", encoding="utf-8")
    tight = ["--config", str(tmp_path / "tight.toml"), "--dry-run", "--out", out]
    assert main(["run", "tone-sweep", "--volts", "0.1", *tight]) == 2
    assert "limits.acceleration = 0.1 is refused" in capsys.readouterr().err


def test_its_run_leaves_table_figure_and_live_numbers(done: Path) -> None:
    assert {"campaign.h5", "summary.json", "gain.png"} <= {path.name for path in done.iterdir()}
    summary = json.loads((done / "summary.json").read_text(encoding="utf-8"))
    gains = {point["omega_rad_s"]: point["gain_m_s2_v"] for point in summary["points"]}
    with open_record(done / "campaign.h5") as record:
        predicted = dict(zip(*(record.tables["prediction"][name].values for name in ("omega", "gain")), strict=True))
        rows = record.tables["planned_drive"]
        assert set(rows["omega"].values) == {10.0, 40.0}
    for omega, gain in gains.items():
        # friction takes a part of so small a drive
        assert 0.7 * predicted[omega] < gain < 1.02 * predicted[omega]


def test_its_live_number_is_shown_as_it_is_measured() -> None:
    scene = Scene()
    scene.update(LiveValue("gain of the table", 1.03, "m/s2/V", 0.01, 1.05))
    assert any("gain of the table" in str(value) for value in vars(scene).values())


def test_its_file_replays_bit_for_bit_and_is_reported(done: Path, capsys: Said) -> None:
    file = str(done / "campaign.h5")
    assert main(["replay", file]) == 0
    shown = capsys.readouterr().out
    assert "Identical to the file in every bit" in shown
    assert "2 live values" in shown
    page = done / "report.html"
    assert main(["report", file, "--html", str(page)]) == 0
    assert "Tone sweep" in page.read_text(encoding="utf-8")


def test_a_plug_in_that_fails_to_load_is_named_and_hinders_nothing_else(tmp_path: Path, capsys: Said) -> None:
    folder = tmp_path / "site"
    folder.mkdir()
    (folder / "half_written.py").write_text("PROTOCOL = 1 / 0\n", encoding="utf-8")
    (folder / "no_protocol.py").write_text("PROTOCOL = 'text'\n", encoding="utf-8")
    entries = {"broken": "half_written:PROTOCOL", "text": "no_protocol:PROTOCOL", "gone": "nowhere:PROTOCOL"}
    with installed(folder, "rockbench-broken", {PROTOCOLS: entries}):
        found, failed = all_protocols()
        assert {"harmonic", "check"} <= {each.name for each in found}
        broken, gone, text = failed
        assert "half_written:PROTOCOL of rockbench-broken 1.0 cannot be loaded (ZeroDivisionError" in broken
        assert "ModuleNotFoundError: No module named 'nowhere'" in gone
        assert "is no bench.protocol.Protocol" in text
        assert main(["run", "--help"]) == 0
        assert "Not available" in capsys.readouterr().out
        assert main(["run", "broken"]) == 2
        (line,) = [each for each in capsys.readouterr().err.splitlines() if "error" in each]
        assert "ZeroDivisionError: division by zero" in line
        assert main(["run", "harmonic", "--help"]) == 0


def test_an_export_format_is_found_and_has_every_sample(done: Path, tmp_path: Path) -> None:
    example = PLUGINS / "numpy_archive" / "numpy_archive.py"
    assert len(example.read_text(encoding="utf-8").splitlines()) <= 60
    folder = tmp_path / "site"
    folder.mkdir()
    shutil.copy(example, folder)
    project = tomllib.loads((example.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    file, out = done / "campaign.h5", tmp_path / "arrays"
    with installed(folder, project["name"], project["entry-points"]):
        assert load_format("npz").title == "NumPy"
        command = [sys.executable, "-m", "bench", "export", str(file), "--to", "npz", "--out", str(out)]
        ran = subprocess.run(command, capture_output=True, text=True, check=False)
        assert ran.returncode == 0, ran.stderr
    with open_record(file) as record, np.load(out / "run-1.npz") as arrays:
        run = record.runs[0]
        np.testing.assert_array_equal(arrays["table_acceleration"], run.channels["table_acceleration"])
        assert arrays["time"].shape == arrays["drive"].shape
    with np.load(out / "points.npz") as points:
        assert points["omega_rad_s"].tolist() == [10.0, 40.0]
    assert json.loads((out / "units.json").read_text(encoding="utf-8"))["table_acceleration"] == "m/s2"


@pytest.mark.usefixtures("plugged")
def test_its_form_is_made_for_the_window(qtbot: QtBot) -> None:
    from bench.gui.form import Form

    form = Form(load_protocol("tone-sweep").parameters)
    qtbot.addWidget(form)
    assert list(form.fields) == ["omega", "volts", "cycles"]
    assert form.parameters().model_dump() == {"omega": (10.0, 20.0, 40.0), "volts": 0.05, "cycles": 8}
