"""Boundaries of stability against frequency: the orbits at their two sides, and the command."""

import json
from pathlib import Path

import numpy as np
import pytest

from bench.app.cli.main import main
from bench.prediction.requests import StabilityRequest
from bench.prediction.stability import BOUNDARY, boundaries_table, multipliers_table
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import rocking_orbit
from sim.table_orbit import table_orbit

ASKED = StabilityRequest(omega=(13.2, 12.2, 12.7), beta=(0.64,), harmonics=5)
AMPLITUDE = ASKED.amplitude_factor * Specimen().uplift_acceleration


def stable(omega: float, ground: str) -> bool:
    orbit = rocking_orbit(Specimen().coupled(0.64), omega, AMPLITUDE)
    return orbit.stable if ground == "fixed ground" else table_orbit(orbit, Shaker(), ASKED.harmonics).stable


def test_the_motion_is_stable_on_one_side_of_each_boundary() -> None:
    points = multipliers_table(Specimen(), Shaker(), ASKED)
    assert points["omega_rad_s"].values.tolist() == [12.2, 12.7, 13.2]
    found = boundaries_table(Specimen(), Shaker(), ASKED, points)
    assert found["ground"].values.tolist() == ["fixed ground"] * 2 + ["table"] * 2
    assert found["kind"].values.tolist() == ["Neimark-Sacker"] * 4
    for k, (omega, ground) in enumerate(zip(found["omega_rad_s"].values, found["ground"].values, strict=True)):
        sides = [stable(float(omega) + side, str(ground)) for side in (-BOUNDARY, BOUNDARY)]
        assert sides == ([True, False] if k % 2 == 0 else [False, True])


def test_a_lighter_table_moves_the_boundary(capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--omega", "12.3", "12.7", "--beta", "0.64", "--json"]
    found = list[float]()
    for mass in ("20", "50"):
        assert main(["predict", "stability", *flags, "--table-mass", mass]) == 0
        rows = json.loads(capsys.readouterr().out)["boundaries"]
        assert [row["ground"] for row in rows] == ["fixed ground", "table"]
        found += [row["omega_rad_s"] for row in rows]
    assert found[0] == found[2] < found[1] < found[3]


def test_a_table_that_is_too_heavy_for_the_shaker_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--omega", "12.3", "12.5", "--beta", "0.64", "--table-mass", "3000", "--json"]
    assert main(["predict", "stability", *flags]) == 0
    told = capsys.readouterr()
    assert "points at which the shaker cannot move this table as requested: 2" in told.err
    assert [row["table_modulus"] for row in json.loads(told.out)["points"]] == [None, None]


def test_no_boundary_is_said_and_the_multipliers_are_still_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flags = ["--omega", "16", "17", "--beta", "0.64", "--csv", str(tmp_path / "points.csv")]
    assert main(["predict", "stability", *flags, "--plot", str(tmp_path / "stability.png")]) == 0
    assert "there is no stability boundary in the range" in capsys.readouterr().out
    assert (tmp_path / "stability.png").stat().st_size > 1000
    (points,) = (path for path in tmp_path.iterdir() if path.suffix == ".csv" and "points" in path.name)
    rows = np.genfromtxt(points, delimiter=",", names=True)
    np.testing.assert_array_less(rows["table_modulus"], 1.0)


def test_where_the_shaker_cannot_move_the_table_only_fixed_ground_is_known() -> None:
    points = multipliers_table(Specimen(), Shaker(voltage_limit=0.5), ASKED)
    assert np.isnan(points["table_modulus"].values).all()
    assert np.isfinite(points["modulus"].values).all()
    found = boundaries_table(Specimen(), Shaker(voltage_limit=0.5), ASKED, points)
    assert {*found["ground"].values.tolist()} == {"fixed ground"}
