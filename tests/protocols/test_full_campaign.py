"""The paper's campaign (section 4.3), whole, on the virtual bench."""

import json
from pathlib import Path
from typing import Any

import pytest

from bench.cli.main import main


@pytest.fixture(scope="module")
def summary(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("campaign") / "run"
    assert main(["run", "harmonic", "--yes", "--json", "--out", str(folder), "--seed", "7"]) == 0
    return json.loads(Path(folder / "summary.json").read_text(encoding="utf-8"))


def test_all_twelve_points_are_reported(summary: dict[str, Any]) -> None:
    asked = [(omega, beta) for beta in (0.25, 0.64, 0.97) for omega in (12.5, 15.0, 17.5, 20.0)]
    assert [(point["omega_rad_s"], point["beta"]) for point in summary["points"]] == asked
    assert {point["status"] for point in summary["points"]} <= {"steady", "modulated", "resting", "overturned"}


def test_every_stable_point_is_reached_and_agrees_with_its_layer(summary: dict[str, Any]) -> None:
    stable = [point for point in summary["points"] if point["predicted_stable"]]
    assert len(stable) == 10
    for point in stable:
        assert point["status"] in ("steady", "resting"), point
        assert point["agrees"], point


def test_where_the_orbit_is_unstable_the_point_says_what_it_did(summary: dict[str, Any]) -> None:
    """Neimark-Sacker windows: beta 0.64 below 13.10 rad/s, beta 0.97 from 14.35 to 15.43 rad/s."""
    unstable = [point for point in summary["points"] if not point["predicted_stable"]]
    assert [(point["omega_rad_s"], point["beta"]) for point in unstable] == [(12.5, 0.64), (15.0, 0.97)]
    for point in unstable:
        assert point["status"] in ("modulated", "overturned")
        assert point["reason"]
        assert point["agrees"] is None
