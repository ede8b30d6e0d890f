"""Holds of unstable points on the simulated bench, through engine, guard and sensors, in virtual time."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.app.cli.main import main
from bench.datafile.reader import open_datafile
from protocols.common.sine.holding import HoldCycle

pytestmark = pytest.mark.usefixtures("shared_results", "few_specimens", "no_figures")

QUICK = ["--settle-limit", "15", "--ramp-time", "4", "--harmonics", "5", "--starts", "2"]
BLOCKS = "[acquisition]\nblock_duration = 0.2\n[simulation.bench]\nsample_rate = 1000.0\n"


def point(folder: Path, *options: str) -> dict[str, Any]:
    blocks = folder.parent / "blocks.toml"
    blocks.write_text(BLOCKS, encoding="utf-8")
    command = ["run", "harmonic", "--yes", "--json", "--omega", "15", "--beta", "0.97", "--config", str(blocks)]
    assert main([*command, *QUICK, "--seed", "7", "--out", str(folder), *options]) == 0
    (found,) = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["points"]
    return found


def replayed_and_analysed(path: Path, held: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """The point of a file that replays to the last bit, analysed again: held, with the same gain."""
    assert main(["replay", str(path)]) == 0
    assert "Bit-identical to the file" in "".join(capsys.readouterr())
    assert main(["analyse", str(path), "--json"]) == 0
    (again,) = json.loads(capsys.readouterr().out)["points"]
    assert again["status"] == "held"
    assert again["alpha_2"] == pytest.approx(held["alpha_2"], rel=2e-3)
    return again


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("hold") / "run"


@pytest.fixture(scope="module")
def held(folder: Path) -> dict[str, Any]:
    return point(folder)


def test_the_unstable_orbit_is_held_and_its_gain_agrees(held: dict[str, Any]) -> None:
    assert held["status"] == "held", held["reason"]
    assert held["agrees"] is True
    assert held["alpha_2"] == pytest.approx(held["alpha_2_predicted"], rel=0.01)
    assert held["alpha_2"] == pytest.approx(held["drift_peak_m"] / held["bare_drift_peak_m"], rel=1e-9)
    assert held["control_share"] < 1e-3
    assert held["captured_cycles"] < 200
    assert held["predicted_stable"] is False
    assert held["free_agrees"], held["reason"]


def test_the_spread_of_the_free_motion_is_stated_beside_it(held: dict[str, Any]) -> None:
    assert held["alpha_2"] < 0.1 < held["alpha_2_least"] < held["alpha_2_mean"] < held["alpha_2_greatest"]
    assert "free: not steady" in held["reason"]


def test_the_file_has_every_cycle_of_the_hold(held: dict[str, Any], folder: Path) -> None:
    with open_datafile(folder / "campaign.h5") as record:
        cycles = record.columns_of(HoldCycle)
    assert list(cycles["cycle"]) == list(range(1, len(cycles["cycle"]) + 1))
    controls, peaks = np.array(cycles["control"]), np.array(cycles["drift_peak"])
    assert controls.max() == pytest.approx(0.1, rel=1e-6)
    # the last cycles are those after the release
    measured = slice(int(np.flatnonzero(controls)[-1]) - 23, int(np.flatnonzero(controls)[-1]) + 1)
    assert np.sqrt(np.mean(controls[measured] ** 2)) == pytest.approx(held["control_share"], rel=1e-6)
    assert peaks[measured].mean() < 0.2 * peaks[:12].max()
    assert np.ptp(peaks[-10:]) > 10.0 * np.ptp(peaks[measured])


def test_the_file_replays_to_the_last_bit_and_its_hold_is_analysed_again(
    held: dict[str, Any], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    replayed_and_analysed(folder / "campaign.h5", held, capsys)


def test_more_cycles_are_not_taken_from_before_the_capture(
    held: dict[str, Any], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert held["captured_cycles"] > 24
    assert main(["analyse", str(folder / "campaign.h5"), "--json", "--set", "measured_cycles=200"]) == 0
    (again,) = json.loads(capsys.readouterr().out)["points"]
    assert again["cycles_measured"] == 24
    assert again["alpha_2"] == pytest.approx(held["alpha_2"], rel=2e-3)


def test_the_multiplier_is_measured_after_the_release(held: dict[str, Any]) -> None:
    assert held["multiplier"] == pytest.approx(held["table_multiplier"], abs=max(0.005, held["multiplier_uncertainty"]))
    assert np.degrees(held["multiplier_angle_rad"]) == pytest.approx(166.0, abs=1.5)


@pytest.mark.soak
def test_without_a_hold_only_the_free_motion_is_measured(tmp_path: Path) -> None:
    free = point(tmp_path / "run", "--no-hold")
    assert free["status"] == "modulated"
    assert free["control_share"] is None
    assert free["alpha_2"] == free["alpha_2_greatest"]
    assert free["alpha_2"] == pytest.approx(free["drift_peak_m"] / free["bare_drift_peak_m"], rel=1e-9)
