"""`rockbench records fit`: what it says, what it writes, and that the file is the fitted motion."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from bench.accelerograms.read import read_accelerogram
from bench.accelerograms.synthetic import synthetic_record
from bench.analysis.response_spectrum import pseudo_acceleration
from bench.app.cli.main import main
from bench.control.stroke_fit import PERIODS
from sim.specimen import Frame

REACH = 0.9 * 0.060, 0.9 * 0.60
"""Of the default bench: 90 % of its limits [m], [m/s]."""


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def fitted(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main(["records", "fit", "synthetic:erzincan", *arguments, "--json"]) == 0
    shown = capsys.readouterr()
    assert shown.out.count("\n") == 1
    return json.loads(shown.out)


def test_both_methods_are_compared_and_the_spectra_are_those_of_the_motions(
    capsys: pytest.CaptureFixture[str],
) -> None:
    answer = fitted(capsys, "--peak-factor", "1.2", "--out", "fitted.csv")
    assert list(answer["fits"]) == ["least-change", "high-pass"]
    assert answer["before"]["peak_displacement_m"] > REACH[0]
    for fit in answer["fits"].values():
        assert fit["peak_displacement_m"] <= REACH[0]
        assert fit["peak_velocity_m_s"] <= REACH[1]
        assert abs(fit["final_velocity_m_s"]) < 1e-13
        assert abs(fit["final_displacement_m"]) < 1e-12
        assert fit["own_periods_s"] == pytest.approx([2.0 * np.pi / omega for omega in Frame().natural_frequencies])
    good = answer["fits"]["least-change"]
    assert good["change_rms"] < answer["fits"]["high-pass"]["change_rms"]
    # the file is the fitted motion, digit by digit, and its spectrum is the one that was told
    record = read_accelerogram(Path("fitted.csv"))
    assert (record.unit, record.dt) == ("m/s2", 0.01)
    assert record.peak == good["peak_m_s2"]
    after = pseudo_acceleration(record.acceleration, record.dt, np.concatenate((PERIODS, good["own_periods_s"])))
    spectrum = answer["response_spectrum"]
    assert np.interp(PERIODS, spectrum["period_s"], spectrum["least-change_m_s2"]) == pytest.approx(after[:-2])
    reference = np.interp(PERIODS, spectrum["period_s"], spectrum["before_m_s2"])
    assert good["change_max"] == pytest.approx(np.abs(after[:-2] / reference - 1.0).max(), abs=1e-9)
    before = np.interp(good["own_periods_s"], spectrum["period_s"], spectrum["before_m_s2"])
    assert good["change_at_own_periods"] == pytest.approx(after[-2:] / before - 1.0, abs=1e-9)
    t = np.arange(record.acceleration.size) * record.dt
    lines = make_interp_spline(t, record.acceleration, k=1)
    assert np.abs(lines.antiderivative(2)(t)).max() == pytest.approx(good["peak_displacement_m"], rel=1e-9)
    assert abs(lines.antiderivative(2)(t[-1])) < 1e-10


def test_the_file_says_where_it_comes_from_and_nothing_is_written_unasked(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["records", "fit", "synthetic:erzincan", "--peak-factor", "1.2"]) == 0
    shown = capsys.readouterr().out
    assert not list(Path().iterdir())
    for text in (
        "synthetic erzincan",
        "54 mm and 0.54 m/s",
        "least-change",
        "high-pass at",
        "at 0.994 s",
        "at 0.384 s",
    ):
        assert text in shown
    options = ("--method", "high-pass", "--peak-factor", "1.2", "--out", "fitted.csv", "--plot", "fitted.png")
    answer = fitted(capsys, *options)
    assert list(answer["fits"]) == ["high-pass"]
    lines = Path("fitted.csv").read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("# ")]
    assert any(synthetic_record("erzincan").sha256 in line for line in comments)
    assert any("zero-phase high-pass at" in line for line in comments)
    assert any("m/s2" in line and "dt = 0.01 s" in line for line in comments)
    assert lines[len(comments)] == "t [s],a [m/s2]"
    assert Path("fitted.png").read_bytes().startswith(b"\x89PNG")


def test_similitude_keeps_the_acceleration_and_shortens_the_time(capsys: pytest.CaptureFixture[str]) -> None:
    whole, small = fitted(capsys, "--trim", "0"), fitted(capsys, "--trim", "0", "--length-ratio", "0.04")
    assert small["before"]["dt_s"] == pytest.approx(0.2 * whole["before"]["dt_s"])
    assert small["before"]["peak_m_s2"] == whole["before"]["peak_m_s2"]
    moved = small["before"]["peak_displacement_m"], whole["before"]["peak_displacement_m"]
    assert moved[0] == pytest.approx(0.04 * moved[1], rel=1e-9)
    assert "similitude: length x 0.04, time x 0.2, acceleration unchanged" in small["before"]["steps"]


def test_the_bench_is_the_configured_one(capsys: pytest.CaptureFixture[str]) -> None:
    Path("bench.toml").write_text("[limits]\ndisplacement = 0.03\n", encoding="utf-8")
    answer = fitted(capsys, "--config", "bench.toml", "--share", "0.5", "--peak-factor", "1.2")
    assert answer["reach"] == pytest.approx({"displacement_m": 0.015, "velocity_m_s": 0.30})
    assert answer["fits"]["least-change"]["peak_displacement_m"] <= 0.015


def test_where_one_method_cannot_the_other_does_and_where_none_can_it_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    # what is above 2 Hz moves the table too far already: only the high-pass takes that away
    t = np.arange(2001) * 0.005
    values = 4.0 * np.sin(2.0 * np.pi * 2.6 * t) * np.sin(np.pi * t / t[-1]) ** 2
    rows = "".join(f"{x:.3f},{a!r}\n" for x, a in zip(t.tolist(), values.tolist(), strict=True))
    Path("fast.csv").write_text("t [s],a [m/s2]\n" + rows, encoding="utf-8")
    Path("bench.toml").write_text("[limits]\ndisplacement = 0.01\n", encoding="utf-8")
    assert main(["records", "fit", "fast.csv", "--config", "bench.toml", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert list(answer["fits"]) == ["high-pass"]
    assert "below 2 Hz" in answer["refused"]["least-change"]
    flags = ("--method", "least-change", "--out", "no.csv")
    assert main(["records", "fit", "fast.csv", "--config", "bench.toml", *flags]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    assert not Path("no.csv").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("absent.AT2", "absent.AT2"),
        ("synthetic:kobe --method tight", "--method = 'tight' is refused"),
        ("synthetic:kobe --share 2", "--share = 2.0 is refused"),
        ("synthetic:kobe --table-band 3:1", "--table-band = '3:1' is refused"),
        ("synthetic:kobe --length-ratio 0", "--length-ratio = 0.0 is refused"),
        ("synthetic:kobe --out taken", "the file exists and is never overwritten"),
        ("synthetic:kobe --plot figure.jpg", "its name must end with .png"),
    ],
)
def test_bad_input_is_refused_in_one_line(capsys: pytest.CaptureFixture[str], arguments: str, said: str) -> None:
    Path("taken").write_text("precious", encoding="utf-8")
    assert main(["records", "fit", *arguments.split()]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    assert said in shown.err
    assert Path("taken").read_text(encoding="utf-8") == "precious"
