"""`rockbench file` on the file of a re-analysis: a kind of its own, with checksums, tied to the campaign's file."""

import json
from pathlib import Path
from typing import Any

import h5py  # pyright: ignore[reportMissingTypeStubs]
import pytest

from bench.app.cli.main import main
from bench.config.model import BenchConfiguration
from bench.datafile.reader import open_datafile
from bench.events import PointFinished
from bench.replay.analysis import Analysis, write_analysis
from protocols.harmonic.protocol import HarmonicPoint
from tests.bench.datafile.example import FULL, begin, block


@pytest.fixture
def analysis(tmp_path: Path) -> Path:
    path = tmp_path / "campaign.h5"
    recorder = begin(path)
    recorder(block(0, 100))
    recorder(PointFinished(FULL, time=1.0))
    recorder.close("completed")
    new = FULL.model_copy(update={"alpha_2": 0.31})
    given = Analysis([new], HarmonicPoint, {"measured_cycles": 12}, FULL, BenchConfiguration())
    with open_datafile(path) as record:
        return write_analysis(path, record, given)


def told(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main(["file", *words]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    return captured.err


def test_it_is_looked_into_and_verified(analysis: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["file", "verify", str(analysis)]) == 0
    assert "is intact" in capsys.readouterr().out
    assert main(["file", "info", str(analysis), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["kind"] == "rocking-bench analysis"
    assert (content["points"], content["settings"], content["original_is"]) == (1, {"measured_cycles": 12}, "unchanged")
    assert content["original"]["file"] == "campaign.h5"
    assert main(["file", "info", str(analysis)]) == 0
    assert "campaign.h5, unchanged" in capsys.readouterr().out


def test_a_result_that_was_changed_is_found(analysis: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with h5py.File(analysis, "r+") as file:
        points: Any = file["entry/points/alpha_2"]
        points[0] = 0.5
    assert "/entry/points/alpha_2 was changed" in told(capsys, "verify", str(analysis))


def test_a_campaign_that_is_another_one_now_is_told(analysis: Path, capsys: pytest.CaptureFixture[str]) -> None:
    original = analysis.with_name("campaign.h5")
    original.write_bytes(original.read_bytes() + b"\0")
    assert "campaign.h5 is not the file that was analysed" in told(capsys, "verify", str(analysis))
    original.unlink()
    assert main(["file", "verify", str(analysis)]) == 0


def test_one_without_checksums_is_told(analysis: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with h5py.File(analysis, "r+") as file:
        del file["entry/checksums"]
    assert "no checksums" in told(capsys, "verify", str(analysis))


def test_it_is_not_taken_for_a_campaign(analysis: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = analysis.read_bytes()
    assert "a re-analysis of campaign.h5" in told(capsys, "recover", str(analysis))
    assert analysis.read_bytes() == before
