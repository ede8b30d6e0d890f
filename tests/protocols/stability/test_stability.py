"""Stability tests on the simulated bench, through engine, guard and sensors, in virtual time."""

import json
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.analysis.uncertainty import decimals
from bench.app.catalogue import load_protocol
from bench.app.cli.main import main
from bench.app.reports.report import campaign_report
from bench.datafile.reader import open_datafile
from bench.document.campaign import Campaign
from protocols.common.sine.holding import HoldCycle
from tests.visible_text import document_texts, faults

pytestmark = pytest.mark.usefixtures("shared_results")

QUICK = ["--harmonics", "5", "--starts", "2", "--measured-cycles", "12"]
BLOCKS = "[acquisition]\nblock_duration = 0.2\n[simulation.bench]\nsample_rate = 1000.0\n"
"""Fewer blocks and samples than usual; each block is shorter than a cycle."""


def points(folder: Path, *options: str) -> list[dict[str, Any]]:
    blocks = folder.parent / "blocks.toml"
    blocks.write_text(BLOCKS, encoding="utf-8")
    command = ["run", "stability", "--yes", "--json", "--config", str(blocks), "--out", str(folder), *QUICK, *options]
    assert main(command) == 0
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))["points"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("stability") / "run"


@pytest.fixture(scope="module")
def unstable(folder: Path) -> dict[str, Any]:
    (found,) = points(folder, "--omega", "15", "--seed", "7", "--no-bisect")
    return found


def test_the_multiplier_of_an_unstable_orbit(unstable: dict[str, Any]) -> None:
    assert unstable["status"] == "measured", unstable["reason"]
    assert unstable["modulus"] > 1.0 + unstable["modulus_uncertainty"]
    assert abs(unstable["modulus"] - unstable["modulus_predicted"]) <= max(0.003, unstable["modulus_uncertainty"])
    assert unstable["angle_rad"] == pytest.approx(unstable["angle_predicted_rad"], abs=np.radians(0.5))
    assert unstable["fixed_modulus"] == pytest.approx(1.0514, abs=2e-4)
    assert unstable["agrees"] is True
    assert abs(unstable["autocorrelation"]) < 0.4
    parts = json.loads(unstable["uncertainty_parts"])
    assert 2.0 * hypot(*parts.values()) == pytest.approx(unstable["modulus_uncertainty"], rel=1e-3)


def test_the_laws_of_restitution_are_compared(unstable: dict[str, Any], folder: Path) -> None:
    """The bench has Housner's restitution."""
    expected = unstable["modulus_predicted"]
    assert expected < unstable["consecutive_modulus"] < unstable["contact_modulus"]
    assert abs(unstable["implied_factor"] - 1.0) < unstable["implied_factor_uncertainty"]
    laws = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["restitution_laws"]
    assert [law["law"] for law in laws] == ["housner", "consecutive", "contact"]
    assert [law["closest_at"] for law in laws] == [1, 0, 0]
    assert [law["restitution"] for law in laws] == pytest.approx([254.0 / 260.0, 257.0 / 260.0, 256.0 / 258.0])
    assert abs(laws[0]["deviations"][0]) < abs(laws[1]["deviations"][0]) < abs(laws[2]["deviations"][0])


def test_the_deviation_grows_after_the_release_without_control(unstable: dict[str, Any], folder: Path) -> None:
    with open_datafile(folder / "campaign.h5") as record:
        cycles = record.columns_of(HoldCycle)
    controls, deviations = np.array(cycles["control"]), np.array(cycles["deviation"])
    free = int(np.flatnonzero(controls)[-1]) + 2
    assert len(controls) - free >= unstable["released_cycles"]
    assert deviations[-1] > 2.0 * deviations[free] > 0.0
    assert controls[free - 2 - 8 : free - 2].max() <= 0.1


def test_report_and_replay(unstable: dict[str, Any], folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (folder / "stability.png").stat().st_size > 10_000
    assert main(["replay", str(folder / "campaign.h5")]) == 0
    assert "Bit-identical to the file" in "".join(capsys.readouterr())
    with open_datafile(folder / "campaign.h5") as record:
        protocol = load_protocol("stability")
        document = campaign_report(Campaign(folder / "campaign.h5", record, protocol.parameters), protocol)
        texts = list(document_texts(document))
    assert not faults(texts)
    assert any("Stability of the rocking orbits" in text for _, text in texts)
    modulus = f"{unstable['modulus']:.{decimals(unstable['modulus_uncertainty'])}f}"
    assert any(modulus in text for _, text in texts)
    assert any("closest at 1 of 1 points" in text for _, text in texts)


@pytest.mark.soak
def test_the_boundary_is_bracketed(tmp_path: Path) -> None:
    found = points(tmp_path / "run", "--omega", "15.2", "15.6", "--seed", "3")
    assert sum(each["bisected"] for each in found) >= 3
    unstable = max(each["omega_rad_s"] for each in found if each["modulus"] > 1.0)
    stable = min(each["omega_rad_s"] for each in found if each["modulus"] < 1.0)
    # of the table of 50 kg; on fixed ground 15.41 rad/s
    assert unstable < stable <= unstable + 0.003 * stable
    assert abs(0.5 * (unstable + stable) - 15.357) < 0.05


@pytest.mark.soak
def test_the_multiplier_over_amplitude(tmp_path: Path) -> None:
    found = points(tmp_path / "run", "--omega", "15.3", "--amplitude-factor", "1.01", "1.1", "--no-bisect")
    assert [each["status"] for each in found] == ["measured", "measured"]
    assert all(abs(each["modulus"] - each["modulus_predicted"]) < 0.005 for each in found)
