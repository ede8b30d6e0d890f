"""`rockbench records info`."""

import json
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from bench.app.cli.main import main
from bench.figures.record_figure import MOST_POINTS, RecordPicture, record_figure
from tests.bench.accelerograms import writers
from tests.bench.accelerograms.writers import Block


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A whole sine of 0.5 g, 0.5 s long, as PEER writes it."""
    t = np.linspace(0.0, 0.5, 101)
    block = Block([writers.fortran(value, 15, 7) for value in 0.5 * np.sin(4.0 * np.pi * t)], 5)
    file = tmp_path / "sine.AT2"
    file.write_text("\n".join(writers.peer(block, ".00500")))
    return file


def test_json_says_everything(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["records", "info", str(file), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    found = content["records"][0]
    assert (found["name"], found["format"], found["unit"]) == ("sine", "PEER AT2", "g")
    assert (found["samples"], found["dt_s"], found["duration_s"]) == (101, 0.005, 0.5)
    assert found["sha256"] == sha256(file.read_bytes()).hexdigest()
    assert found["header"]["line 4"].startswith("NPTS=")
    # closed forms of the sine; its samples are joined by straight lines, hence 1e-3
    a, w = 0.5 * 9.80665, 4.0 * np.pi
    assert found["pga_m_s2"] == pytest.approx(a, rel=1e-6)
    assert found["pgv_m_s"] == pytest.approx(2.0 * a / w, rel=1e-3)
    assert found["pgd_m"] == pytest.approx(0.5 * a / w, rel=1e-3)
    assert found["arias_m_s"] == pytest.approx(np.pi / (2.0 * 9.80665) * a * a * 0.25, rel=1e-3)
    assert found["synthetic"] is False
    spectrum = found["response_spectrum"]
    assert spectrum["damping_ratio"] == 0.05
    # the shortest oscillator nearly follows the ground
    assert spectrum["pseudo_acceleration_m_s2"][0] == pytest.approx(a, rel=0.05)
    assert len(spectrum["period_s"]) == len(spectrum["pseudo_acceleration_m_s2"])


def test_text_and_figure(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "out.png"
    command = ["records", "info", str(file), "synthetic:kobe@name=made", "--plot", str(picture)]
    assert main(command) == 0
    out = capsys.readouterr().out
    for word in ("sine", "4.9033 m/s2 = 0.5 g", "PEER AT2, samples in g", "101, every 0.005 s", "made", "SHA-256"):
        assert word in out
    assert picture.read_bytes().startswith(b"\x89PNG")
    before = picture.read_bytes()
    assert main(command) == 2
    assert "never overwritten" in capsys.readouterr().err
    assert picture.read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ([], "specify at least one record"),
        (["missing.AT2"], "no such file"),
        (["{file}", "--unit", "cm/s2"], "states g"),
        (["{file}", "--plot", "a.bmp"], ".png, .pdf, .svg"),
        (["{file}"] * 2, "name=ANOTHER"),
        (["{file}"] * 9 + ["--plot", "a.png"], "at most 8"),
    ],
)
def test_refusals_are_one_line_and_leave_nothing(
    file: Path, arguments: list[str], word: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(file.parent)
    assert main(["records", "info", *(argument.format(file=file) for argument in arguments)]) == 2
    said = capsys.readouterr()
    assert word in said.err
    assert said.out == ""
    assert len(said.err.splitlines()) == 1
    assert [path.name for path in file.parent.iterdir()] == ["sine.AT2"]


def test_a_drift_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "half.txt").write_text("\n".join(f"{value:.6f}" for value in np.sin(np.linspace(0.0, np.pi, 50))))
    assert main(["records", "info", str(tmp_path / "half.txt"), "--dt", "0.01", "--unit", "m/s2"]) == 0
    assert "baseline drift" in capsys.readouterr().out


def test_a_long_history_keeps_its_peaks_in_the_figure() -> None:
    values = np.zeros(50_000)
    values[31_234], values[40_001] = 3.0, -7.0
    periods = np.geomspace(0.05, 5.0, 5)
    figure = record_figure([RecordPicture("long", 0.01, values, values, values, periods, periods, 0.05)])
    panels = [panel for part in figure.subfigs for panel in part.axes]
    shown = np.asarray(panels[0].lines[0].get_ydata())
    assert shown.size == MOST_POINTS
    assert (shown.min(), shown.max()) == (-7.0, 3.0)
