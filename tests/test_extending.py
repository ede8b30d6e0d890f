"""The examples of docs/extending.md, each in a package of its own beside the project, used as their readers would."""

import json
import re
import subprocess
import sys
from collections.abc import Generator
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from bench.app.catalogue import PROTOCOLS, all_protocols, load_protocol
from bench.app.cli.main import main
from bench.app.export.format import load_format
from bench.app.formatting import measurement
from bench.config.declared import declared
from bench.datafile.reader import open_datafile
from tests.installed import PLUGINS, example, installed

SWEEP = PLUGINS / "tone_sweep" / "tone_sweep.py"
Said = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def plugged(tmp_path_factory: pytest.TempPathFactory) -> Generator[None]:
    """The package of the example protocol, as an installer leaves it."""
    with example(tmp_path_factory.mktemp("plugin") / "site", "tone_sweep"):
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
    with open_datafile(done / "campaign.h5") as record:
        predicted = dict(zip(*(record.tables["prediction"][name].values for name in ("omega", "gain")), strict=True))
        rows = record.tables["planned_drive"]
        assert set(rows["omega"].values) == {10.0, 40.0}
    for omega, gain in gains.items():
        # friction takes a part of so small a drive
        assert 0.7 * predicted[omega] < gain < 1.02 * predicted[omega]


class Terminal(StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.seconds
@pytest.mark.usefixtures("plugged")
def test_its_live_number_is_on_the_terminal_while_it_runs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    for name, value in {"TERM": "xterm", "COLUMNS": "110", "LINES": "40"}.items():
        monkeypatch.setenv(name, value)
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    # paced by the clock, so that the number stands while the drive is taken back
    command = ["run", "tone-sweep", "--omega", "40", "--cycles", "4", "--volts", "0.1", "--realtime"]
    assert main([*command, "--out", str(tmp_path / "run")]) == 0
    (point,) = json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))["points"]
    shown = measurement(point["gain_m_s2_v"], point["gain_uncertainty"], "m/s2/V")
    (line,) = {line.strip() for line in re.findall(r"gain of the table[^\r\n\x1b]*", terminal.getvalue())}
    assert line.startswith(f"gain of the table  {shown}, predicted ")


def test_its_file_replays_bit_for_bit_and_is_reported(done: Path, capsys: Said) -> None:
    file = str(done / "campaign.h5")
    assert main(["replay", file]) == 0
    shown = capsys.readouterr().out
    assert "Bit-identical to the file" in shown
    assert "2 live values" in shown
    page = done / "report.html"
    assert main(["report", file, "--html", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    assert "Tone sweep" in text
    # its own section is a figure: the points stand in the table that every protocol has
    assert 'id="points"' in text
    # whose headings have the unit once, and not again as the suffix of a name
    assert "gain [m/s²/V]" in text
    assert "gain m s2 v" not in text


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
        assert "is not a bench.protocol.Protocol" in text
        assert main(["run", "--help"]) == 0
        assert "Not available" in capsys.readouterr().out
        assert main(["run", "broken"]) == 2
        (line,) = [each for each in capsys.readouterr().err.splitlines() if "error" in each]
        assert "ZeroDivisionError: division by zero" in line
        assert main(["run", "harmonic", "--help"]) == 0


def test_an_export_format_is_found_and_has_every_sample(done: Path, tmp_path: Path) -> None:
    file, out = done / "campaign.h5", tmp_path / "arrays"
    with example(tmp_path / "site", "numpy_archive") as module:
        assert len(module.read_text(encoding="utf-8").splitlines()) <= 60
        assert load_format("npz").title == "NumPy"
        command = [sys.executable, "-m", "bench", "export", str(file), "--to", "npz", "--out", str(out)]
        ran = subprocess.run(command, capture_output=True, text=True, check=False)
        assert ran.returncode == 0, ran.stderr
    with open_datafile(file) as record, np.load(out / "run-1.npz") as arrays:
        run = record.runs[0]
        np.testing.assert_array_equal(arrays["table_acceleration"], run.channels["table_acceleration"])
        assert arrays["time"].shape == arrays["drive"].shape
    with np.load(out / "points.npz") as points:
        assert points["omega_rad_s"].tolist() == [10.0, 40.0]
    assert json.loads((out / "units.json").read_text(encoding="utf-8"))["table_acceleration"] == "m/s2"
