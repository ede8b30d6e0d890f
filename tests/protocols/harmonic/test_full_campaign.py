"""The campaign of the paper (section 4.3) on the virtual bench: two points in every run, all twelve in a long one."""

import json
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from bench.app.cli.main import main

pytestmark = pytest.mark.usefixtures("shared_results")

UNSTABLE = ((12.5, 0.64), (15.0, 0.97))
"""Neimark-Sacker windows: beta 0.64 below 13.10 rad/s, beta 0.97 from 14.35 to 15.43 rad/s."""


class Asked(NamedTuple):
    """Frequencies [rad/s] and stiffness ratios of a campaign."""

    omegas: tuple[float, ...]
    betas: tuple[float, ...]

    @property
    def points(self) -> list[tuple[float, float]]:
        return [(omega, beta) for beta in self.betas for omega in self.omegas]


# one orbit that is stable, and one that is not
FEW = Asked((15.0, 20.0), (0.97,))
WHOLE = Asked((12.5, 15.0, 17.5, 20.0), (0.25, 0.64, 0.97))


class Campaign(NamedTuple):
    """What was asked for, and the summary of the run."""

    asked: Asked
    points: list[dict[str, Any]]


@pytest.fixture(
    scope="module",
    params=[FEW, pytest.param(WHOLE, marks=pytest.mark.soak)],
    ids=lambda asked: f"{len(asked.points)} points",
)
def campaign(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    asked: Asked = request.param
    folder = tmp_path_factory.mktemp("campaign") / "run"
    command = ["run", "harmonic", "--yes", "--json", "--out", str(folder), "--seed", "7"]
    command += ["--omega", *map(str, asked.omegas), "--beta", *map(str, asked.betas)]
    assert main(command) == 0
    return Campaign(asked, json.loads(Path(folder / "summary.json").read_text(encoding="utf-8"))["points"])


def test_all_points_are_reported(campaign: Campaign) -> None:
    assert [(point["omega_rad_s"], point["beta"]) for point in campaign.points] == campaign.asked.points
    assert {point["status"] for point in campaign.points} <= {"steady", "held", "resting"}


def test_every_stable_point_is_reached_and_agrees_with_its_branch(campaign: Campaign) -> None:
    stable = [point for point in campaign.points if point["predicted_stable"]]
    assert len(stable) == len(set(campaign.asked.points) - set(UNSTABLE))
    for point in stable:
        assert point["status"] in ("steady", "resting"), point
        assert point["agrees"], point


def test_where_the_orbit_is_unstable_it_is_held_and_agrees(campaign: Campaign) -> None:
    unstable = [point for point in campaign.points if not point["predicted_stable"]]
    expected = [each for each in UNSTABLE if each in campaign.asked.points]
    assert [(point["omega_rad_s"], point["beta"]) for point in unstable] == expected
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
