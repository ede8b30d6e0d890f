"""The campaign of the paper (section 4.3) on the virtual bench; `test_holding` and `test_point` have a point each."""

import json
from pathlib import Path
from typing import Any

import pytest

from bench.app.cli.main import main

pytestmark = [pytest.mark.soak, pytest.mark.usefixtures("shared_results")]

UNSTABLE = ((12.5, 0.64), (15.0, 0.97))
"""Neimark-Sacker windows: beta 0.64 below 13.10 rad/s, beta 0.97 from 14.35 to 15.43 rad/s."""


OMEGAS, BETAS = (12.5, 15.0, 17.5, 20.0), (0.25, 0.64, 0.97)
ASKED = [(omega, beta) for beta in BETAS for omega in OMEGAS]


@pytest.fixture(scope="module")
def points(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    folder = tmp_path_factory.mktemp("campaign") / "run"
    command = ["run", "harmonic", "--yes", "--json", "--out", str(folder), "--seed", "7"]
    command += ["--omega", *map(str, OMEGAS), "--beta", *map(str, BETAS)]
    assert main(command) == 0
    return json.loads(Path(folder / "summary.json").read_text(encoding="utf-8"))["points"]


def test_all_points_are_reported(points: list[dict[str, Any]]) -> None:
    assert [(point["omega_rad_s"], point["beta"]) for point in points] == ASKED
    assert {point["status"] for point in points} <= {"steady", "held", "resting"}


def test_every_stable_point_is_reached_and_agrees_with_its_branch(points: list[dict[str, Any]]) -> None:
    stable = [point for point in points if point["predicted_stable"]]
    assert len(stable) == len(set(ASKED) - set(UNSTABLE))
    for point in stable:
        assert point["status"] in ("steady", "resting"), point
        assert point["agrees"], point


def test_where_the_orbit_is_unstable_it_is_held_and_agrees(points: list[dict[str, Any]]) -> None:
    unstable = [point for point in points if not point["predicted_stable"]]
    assert [(point["omega_rad_s"], point["beta"]) for point in unstable] == list(UNSTABLE)
    for point in unstable:
        # an orbit that is unstable on fixed ground may be stable on this table, where it is reached slowly
        on_table = point["table_multiplier"]
        slow = on_table is not None and on_table < 1.0
        assert point["status"] in (("held", "steady") if slow else ("held",)), point["reason"]
        assert point["agrees"], point["reason"]
        assert abs(point["alpha_2"] / point["alpha_2_predicted"] - 1.0) < 0.01
        if point["status"] == "held":
            assert point["control_share"] < 1e-3
        if not slow:
            assert point["free_agrees"], point["reason"]
